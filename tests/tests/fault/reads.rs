//! Which bytes are read how often.

use std::collections::BTreeMap;
use std::path::PathBuf;

use suture_tests::binary::suture;
use suture_tests::scene::{Scene, six};
use suture_tests::trace::{Eyes, Next, Role, Stop, run};

use crate::LIMIT;

/// Counts reads and maps of files by process, through the file's name then.
#[derive(Default)]
struct Reader {
    reads: BTreeMap<(Role, PathBuf), u32>,
}

impl Eyes for Reader {
    fn numbers(&self) -> Vec<i64> {
        vec![libc::SYS_read, libc::SYS_pread64, libc::SYS_readv, libc::SYS_mmap, libc::SYS_copy_file_range, libc::SYS_sendfile]
    }

    fn before(&mut self, stop: &Stop) -> Next {
        let [first, second, _, _, fifth, _] = stop.arguments();
        let descriptor = match stop.number() {
            libc::SYS_mmap => fifth,
            libc::SYS_sendfile => second,
            _ => first,
        };
        if let Ok(path) = std::fs::read_link(stop.descriptor(descriptor)) {
            *self.reads.entry((stop.role, path)).or_default() += 1;
        }
        Next::Go
    }
}

/// The worker reads each result back, and hashes it then; the daemon takes its word, and reads no result. (It hashed each of them twice.)
#[test]
fn the_daemon_reads_no_result() {
    let scene = Scene::new(suture(), &six());
    let mut reader = Reader::default();
    let ended = run(&scene.once(), &scene.errors(), LIMIT, &mut reader).expect("the daemon can be traced");
    assert_eq!(ended.status.code(), Some(1), "{ended:?}");
    let is_result = |path: &PathBuf| path.ends_with("out.stl") || path.starts_with(scene.path().join("out"));
    let of = |role: Role| reader.reads.keys().filter(move |(who, path)| *who == role && is_result(path)).count();
    assert_eq!(of(Role::Daemon), 0, "{:#?}", reader.reads);
    assert_eq!(of(Role::Worker), 5, "of all but the picture, read back: {:#?}", reader.reads);
}
