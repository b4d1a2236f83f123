//! Archives that are sound, and archives that lie.

use std::path::Path;

use proptest::prelude::*;

use super::super::spool::Context;
use super::build::{Member, deflate, end, member, zip};
use super::*;
use crate::contract::error::{Error, Result};
use crate::contract::progress::{Progress, Quiet};
use crate::contract::settings::Limits;

/// The content of all entries of an archive, by both ways if they are small.
fn contents(bytes: &[u8]) -> Result<Vec<(String, Vec<u8>)>> {
    contents_with(bytes, &Quiet)
}

fn contents_with(bytes: &[u8], progress: &dyn Progress) -> Result<Vec<(String, Vec<u8>)>> {
    let limits = Limits::default();
    let folder = std::env::temp_dir();
    let context = Context { path: Path::new("part.3mf"), spool: &folder, limits: &limits, progress, passed: None };
    let archive = Archive::open(bytes).map_err(|rejection| rejection.at(context.path))?;
    let read = |entry: &Entry| {
        let spooled = archive.spooled(entry, &context)?.all().as_flattened().to_vec();
        assert_eq!(archive.find(&entry.name.to_ascii_uppercase()), Some(entry));
        match archive.small(entry, &context) {
            Ok(small) => assert_eq!(small, spooled),
            Err(error) => assert!(entry.plain > 1 << 20, "{error}"),
        }
        Ok((entry.name.clone(), spooled))
    };
    archive.entries.iter().map(read).collect()
}

fn reason(bytes: &[u8]) -> String {
    match contents(bytes) {
        Err(Error::Unreadable { reason, .. }) => reason,
        other => panic!("expected a refusal, got {other:?}"),
    }
}

/// More than one step of inflating, and not all the same.
fn long() -> Vec<u8> {
    (0..3_000_000u32).flat_map(|i| (i / 7).to_le_bytes()).take(1 << 21).collect()
}

fn sound() -> Vec<Member> {
    vec![
        member("[Content_Types].xml", "<Types/>"),
        Member { stored: true, ..member("_rels/.rels", "<Relationships/>") },
        Member { stored: true, ..member("3D/", "") },
        Member { described: true, ..member("3D/a.model", long()) },
        Member { wide: true, ..member("3D/b.model", "wide") },
        Member { wide: true, described: true, ..member("3D/c.model", "wide, described") },
        Member { wide: true, described: true, stored: true, ..member("3D/d.model", "") },
    ]
}

#[test]
fn every_way_to_hold_an_entry_comes_back() {
    let members = sound();
    let read = contents(&zip(&members)).unwrap();
    for (member, (name, content)) in members.iter().zip(&read) {
        assert_eq!((&member.name[..], &member.content), (name.as_bytes(), content));
    }
    assert_eq!(read.len(), members.len());
}

#[test]
fn the_raw_bytes_of_an_entry_make_the_same_entry_elsewhere() {
    let bytes = zip(&sound()[3..4]);
    let archive = Archive::open(&bytes).unwrap();
    let entry = &archive.entries[0];
    // The copy begins at byte 0 of its archive as it did in the first: its directory is the first one's.
    let mut copy = bytes[entry.whole.clone()].to_vec();
    let offset = copy.len() as u64;
    copy.extend(&bytes[entry.listed.clone()]);
    end(&mut copy, 1, entry.listed.len() as u64, offset, false);
    assert_eq!(contents(&copy).unwrap()[0].1, long());
}

#[test]
fn an_entry_that_is_not_for_us_is_refused_by_name() {
    let base = || member("3D/a.model", "some text");
    for (other, word) in [
        (Member { flags: 1, ..base() }, "encrypted"),
        (Member { flags: 1 << 6, ..base() }, "encrypted"),
        (Member { method: Some(14), ..base() }, "LZMA"),
        (Member { method: Some(77), ..base() }, "method 77"),
        (Member { name: b"../../a".into(), ..base() }, "leads out"),
        (Member { name: b"3D\\a".into(), ..base() }, "backslash"),
        (Member { name: b"".into(), ..base() }, "no name"),
        (Member { local_name: Some(b"3D/b.model".into()), ..base() }, "another name"),
        (Member { local_more: 1, ..base() }, "another size"),
        (Member { more: -1, ..base() }, "unpacks to more than the 8 bytes"),
        (Member { more: 1, ..base() }, "unpacks to 9 bytes, and claims 10"),
        (Member { more: 1 << 20, ..base() }, "impossible"),
        (Member { more: 1 << 20, stored: true, ..base() }, "impossible"),
        (Member { wrong_crc: true, ..base() }, "checksum"),
        (Member { attributes: 0o120_777 << 16, ..base() }, "symbolic link"),
    ] {
        let reason = reason(&zip(&[member("[Content_Types].xml", "<Types/>"), other.clone()]));
        assert!(reason.contains(word), "{word}: {reason}");
        assert!(other.name.is_empty() || reason.contains(&shown(&String::from_utf8_lossy(&other.name))), "{reason}");
    }
}

#[test]
fn f14_entries_that_share_a_name_or_bytes_are_refused() {
    let twice = |a: &str, b: &str| reason(&zip(&[member(a, "1"), member(b, "2")]));
    assert!(twice("3D/a.model", "3D/a.model").contains("is there twice"));
    assert!(twice("3D/a.model", "3d/A.Model").contains("is there twice"));
    // The second one's local header is inside of the first one's stored content.
    let inner = zip(&[member("b", "inner")]);
    let outer = Member { stored: true, ..member("a", &inner) };
    let mut bytes = zip(&[outer, member("b", "inner")]);
    let at = |needle: &[u8], bytes: &[u8]| memchr::memmem::rfind(bytes, needle).unwrap();
    let central = at(b"PK\x01\x02", &bytes);
    let place = 31u32; // 30 bytes of a local header and a name of one byte
    bytes[central + 42..central + 46].copy_from_slice(&place.to_le_bytes());
    assert!(reason(&bytes).contains("overlaps"), "{}", reason(&bytes));
    // All names for one and the same content, as zip bombs of our day do it.
    let bomb = [member("a", long()), Member { same_as: Some(0), local_name: None, ..member("a ", long()) }];
    assert!(reason(&zip(&bomb)).contains("another name"));
}

#[test]
fn a_directory_that_lies_is_refused() {
    let sound = zip(&sound()[..2]);
    let at = memchr::memmem::rfind(&sound, b"PK\x05\x06").unwrap();
    let with = |place: usize, value: u16| {
        let mut bytes = sound.clone();
        bytes[at + place..at + place + 2].copy_from_slice(&value.to_le_bytes());
        reason(&bytes)
    };
    assert!(with(4, 1).contains("several disks"));
    assert!(with(8, 3).contains("several disks"));
    let counted = |count: u16| {
        let mut bytes = sound.clone();
        bytes[at + 8..at + 12].copy_from_slice([count; 2].map(u16::to_le_bytes).as_flattened());
        reason(&bytes)
    };
    assert!(counted(1).contains("goes on behind its last entry"));
    assert!(counted(3).contains("entry 3") || counted(3).contains("room"));
    assert!(counted(u16::MAX).contains("room"));
    assert!(with(12, 0xfff0).contains("not where the archive says"));
    for cut in [0, 1, at, at + 21, sound.len() - 1] {
        assert!(reason(&sound[..cut]).contains("end of the ZIP archive is missing"), "{cut}");
    }
    let before = [b"some bytes before".as_slice(), &sound].concat();
    assert!(Archive::open(&before).is_err());
}

#[test]
fn f14_a_claim_of_more_than_the_machine_has_is_refused_before_it_is_believed() {
    let mut bytes = Vec::new();
    end(&mut bytes, u64::MAX, u64::MAX, 0, true);
    assert!(reason(&bytes).contains("entries"));
    let mut bytes = vec![0; 46];
    end(&mut bytes, 65_537, 46, 0, true);
    assert!(reason(&bytes).contains("65 537 entries"));
    assert!(contents(&zip(&[])).unwrap().is_empty());
}

#[test]
fn f14_a_bomb_is_refused_before_it_is_unpacked() {
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 56) as u8
    };
    let content: Vec<u8> = (0..150_000).map(|_| noise()).collect();
    let bomb = Member { more: 90 << 20, ..member("3D/3dmodel.model", content) };
    assert!(reason(&zip(&[bomb])).contains("times its size"));
}

#[test]
fn damaged_data_is_refused() {
    let good = zip(&[member("a", long())]);
    let packed = deflate(&long()).len();
    let mut bytes = good.clone();
    for byte in &mut bytes[31 + packed / 2..31 + packed / 2 + 16] {
        *byte ^= 0x5a;
    }
    assert!(reason(&bytes).starts_with("the archive's entry \"a\""), "{}", reason(&bytes));
}

#[test]
fn the_work_ends_when_it_is_told_to() {
    struct Ended;
    impl Progress for Ended {
        fn at(&self, _: &'static str, _: u64, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    assert!(contents_with(&zip(&sound()), &Ended).unwrap_err().is_cancellation());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn f13_any_bytes_of_an_archive_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = contents(&bytes);
    }

    /// An archive with some bytes changed never gives a content that is not its checksum's, nor another name twice.
    #[test]
    fn f13_a_changed_archive_is_read_or_refused(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let small: Vec<Member> = sound().into_iter().filter(|member| member.content.len() < 100).collect();
        let mut bytes = zip(&small);
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Ok(read) = contents(&bytes) {
            prop_assert!(read.len() <= small.len());
            prop_assert!(read.iter().all(|(_, content)| content.len() < 10_000));
        }
    }
}
