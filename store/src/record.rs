//! Records: how a value lies in a table.
//!
//! `SUTR` · schema (u16) · CRC-32 (u32) · JSON. Numbers are big-endian. The checksum is over the table, the key, the schema and
//! the JSON, so that a value under a wrong key is found, too. A record has at most [`MAX`] bytes.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::job::{Ending, Job, Kind, State};
use crate::news::{News, Notice, Word};
use crate::store::StoreError;
use crate::tables::Table;

/// Version of what the JSON means. Raised when an older program would misread it.
pub(crate) const SCHEMA: u16 = 8;
/// That of a record in which nothing is that version 2 did not know.
const PLAIN: u16 = 2;
/// That of a job that was approved.
const APPROVED: u16 = 3;
/// That of the head: from version 4 on, whose job is whose file stands in the jobs alone. An earlier program would look for it in an index that is
/// gone, and take each file that waits for a new one: the head's schema has it refuse the store.
const HEAD: u16 = 4;
/// That of news of the service in the outbox, where an earlier program would look for a job.
const WORD: u16 = 5;
/// That of a job that ends for want of a name, an end that an earlier program does not know.
const NAMELESS: u16 = 6;
/// That of a job whose file was carried, an end that an earlier program does not know.
const CARRIED: u16 = 7;
/// That of news that count such jobs.
const WORD_OF_CARRIED: u16 = 8;
/// Largest record in bytes. The database would put values from a quarter of its segment on into files of their own.
pub(crate) const MAX: usize = 7040;

const MAGIC: &[u8; 4] = b"SUTR";
const HEADER: usize = 10;

/// The error for a damaged record.
pub(crate) fn corrupt(what: &str, reason: &str) -> StoreError {
    StoreError::Corrupt { what: what.to_owned(), reason: reason.to_owned() }
}

fn checksum(table: Table, key: &[u8], schema: u16, json: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&[table as u8]);
    crc.update(&(key.len() as u64).to_be_bytes());
    crc.update(key);
    crc.update(&schema.to_be_bytes());
    crc.update(json);
    crc.finalize()
}

/// `job` as a record under `key`.
pub(crate) fn encode_job(key: &[u8], job: &Job) -> Result<Vec<u8>, StoreError> {
    encode_as(schema_of(job), Table::Jobs, key, job)
}

/// The lowest version that knows all of it.
fn schema_of(job: &Job) -> u16 {
    match (&job.state, job.publication().map(|publication| publication.ending)) {
        (State::Approved { .. }, _) => APPROVED,
        (_, Some(Ending::Carried)) => CARRIED,
        (_, Some(ending)) if ending.is_for_want_of_a_name() => NAMELESS,
        _ => PLAIN,
    }
}

/// `job`, as it stood at its end, as a record of the outbox under `key`.
pub(crate) fn encode_end(key: &[u8], job: &Job) -> Result<Vec<u8>, StoreError> {
    encode_as(schema_of(job), Table::Outbox, key, job)
}

/// The head as a record under `key`.
pub(crate) fn encode_head<T: Serialize>(key: &[u8], head: &T) -> Result<Vec<u8>, StoreError> {
    encode_as(HEAD, Table::Meta, key, head)
}

/// News as a record under `key`.
pub(crate) fn encode_word(key: &[u8], word: &Word) -> Result<Vec<u8>, StoreError> {
    let counts_carried = matches!(&word.news, News::Night { jobs, .. } if jobs.contains_key(&Kind::Carried));
    encode_as(if counts_carried { WORD_OF_CARRIED } else { WORD }, Table::Outbox, key, word)
}

/// `value` as a record under `key` of `table`.
pub(crate) fn encode<T: Serialize>(table: Table, key: &[u8], value: &T) -> Result<Vec<u8>, StoreError> {
    encode_as(PLAIN, table, key, value)
}

fn encode_as<T: Serialize>(schema: u16, table: Table, key: &[u8], value: &T) -> Result<Vec<u8>, StoreError> {
    let too_long = || StoreError::TooLong { what: name(table, key) };
    let mut bytes = Vec::with_capacity(1024);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&schema.to_be_bytes());
    bytes.extend_from_slice(&[0; 4]);
    serde_json::to_writer(&mut bytes, value).map_err(|_| too_long())?;
    if bytes.len() > MAX {
        return Err(too_long());
    }
    let (header, json) = bytes.split_at_mut(HEADER);
    header.split_at_mut(6).1.copy_from_slice(&checksum(table, key, schema, json).to_be_bytes());
    Ok(bytes)
}

/// The value of the record `bytes` under `key` of `table`.
pub(crate) fn decode<T: DeserializeOwned>(table: Table, key: &[u8], bytes: &[u8]) -> Result<T, StoreError> {
    read(table, key, opened(table, key, bytes)?.1)
}

/// The notice in the record `bytes` under `key` of the outbox.
pub(crate) fn decode_notice(key: &[u8], bytes: &[u8]) -> Result<Notice, StoreError> {
    match opened(Table::Outbox, key, bytes)? {
        (WORD | WORD_OF_CARRIED, json) => read(Table::Outbox, key, json).map(Notice::Word),
        (_, json) => read(Table::Outbox, key, json).map(|job| Notice::End(Box::new(job))),
    }
}

fn read<T: DeserializeOwned>(table: Table, key: &[u8], json: &[u8]) -> Result<T, StoreError> {
    serde_json::from_slice(json).map_err(|error| corrupt(&name(table, key), &error.to_string()))
}

/// Schema and JSON of a sound record.
fn opened<'a>(table: Table, key: &[u8], bytes: &'a [u8]) -> Result<(u16, &'a [u8]), StoreError> {
    let fail = |reason: &str| corrupt(&name(table, key), reason);
    let (header, json) = bytes.split_at_checked(HEADER).ok_or_else(|| fail("it is too short"))?;
    let [m0, m1, m2, m3, s0, s1, c0, c1, c2, c3] = *header else { return Err(fail("it is too short")) };
    if [m0, m1, m2, m3] != *MAGIC {
        return Err(fail("it does not begin as a record"));
    }
    let schema = u16::from_be_bytes([s0, s1]);
    if checksum(table, key, schema, json) != u32::from_be_bytes([c0, c1, c2, c3]) {
        return Err(fail("its checksum is wrong"));
    }
    if schema > SCHEMA {
        return Err(StoreError::Newer { found: schema, known: SCHEMA });
    }
    Ok((schema, json))
}

fn name(table: Table, key: &[u8]) -> String {
    match table {
        Table::Meta => format!("meta/{}", String::from_utf8_lossy(key)),
        Table::Jobs => match key.try_into() {
            Ok(id) => format!("job {}", u64::from_be_bytes(id)),
            Err(_) => "a job under a key that is no number".to_owned(),
        },
        Table::ByState => "by_state".to_owned(),
        Table::Outbox => "outbox".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::{Attempt, Boot, Epoch, Hash, JobId, Recipe, Seq, Time, Token};
    use crate::job::{
        Area, Blame, Decision, Hold, MAX_BY, MAX_DAEMON, MAX_REASON, Parked, Priority, Publication, Source, Verdict, Witness,
        one_line,
    };
    use crate::path::{MAX_NAMED, MAX_SOURCE, RelPath};

    /// Everything a job can hold, as long as it can be: no transition can fail for want of room.
    #[test]
    fn the_largest_job_fits() {
        let path = RelPath::new("p".repeat(MAX_NAMED)).unwrap();
        let name = "n".repeat(crate::queue::MAX_NAME - 2);
        let reason = one_line(&"\"".repeat(2 * MAX_REASON));
        let source = Source {
            folder: name.clone(),
            path: RelPath::new("p".repeat(MAX_SOURCE)).unwrap(),
            dev: u64::MAX,
            ino: u64::MAX,
            size: u64::MAX,
            mtime_ns: i64::MIN,
            profile: name,
        };
        let hold = Hold {
            attempt: Attempt(u32::MAX),
            epoch: Epoch(u64::MAX),
            token: Token(u64::MAX),
            alone: false,
            boot: Boot(u64::MAX),
        };
        let publication = Publication {
            ending: Ending::Quarantined,
            reason: reason.clone(),
            output: Some(path.clone()),
            output_hash: Some(Hash([0xff; 32])),
            report_hash: Some(Hash([0xff; 32])),
            recipe: Some(Recipe(u64::MAX)),
            reused: Some(JobId(u64::MAX)),
            source_ctime_ns: Some(i64::MIN),
            original: Some(path.clone()),
            stays: true,
            decision: Some(Box::new(Decision {
                at: Time(u64::MAX),
                ..Decision::new(Verdict::Rejected, &"b".repeat(MAX_BY), &reason).unwrap()
            })),
        };
        let number = u32::MAX;
        let (deaths, deaths_alone, in_hand, machine) = (number, number, u8::MAX, number);
        let blame = Blame { charges: number, deaths, deaths_alone, in_hand, machine, environment: number, kills: number };
        let mut job = Job::queued(JobId(u64::MAX), source, Time(u64::MAX));
        job.moved_to = Some((Area::Quarantine, path));
        job.state = State::Publishing { hold, publication };
        job.attempts = Attempt(number);
        job.blame = blame;
        job.needs_all = true;
        job.priority = Priority::HIGHEST;
        job.retried = Some(Time(u64::MAX));
        job.parked = Some(Parked { until: Some(Time(u64::MAX)), tries: number, committed: false });
        job.work = Some(Token(u64::MAX));
        job.note = reason;
        job.seq = Seq(u64::MAX);
        let key = job.id.0.to_be_bytes();
        for job in [with_witness(&job), job] {
            let bytes = encode_job(&key, &job).unwrap();
            assert_eq!(decode::<Job>(Table::Jobs, &key, &bytes).unwrap(), job);
        }
    }

    /// The same with the longest witness. No job has a decision as well: a witness goes when the job comes to rest, and only then someone decides.
    fn with_witness(job: &Job) -> Job {
        let long = "d".repeat(2 * MAX_DAEMON);
        let witness = Witness::new(&long, &long, Recipe(u64::MAX), Hash([0xff; 32]));
        let mut sampled = Job { witness: Some(Box::new(Witness { at: Time(u64::MAX), ..witness })), ..job.clone() };
        if let State::Publishing { publication, .. } = &mut sampled.state {
            publication.decision = None;
        }
        sampled
    }

    const LATER: u16 = SCHEMA + 1;

    /// F29, and F5.
    #[test]
    fn f29_records_of_another_time_or_place_are_told_apart() {
        let bytes = encode(Table::Meta, b"head", &7_u32).unwrap();
        assert_eq!(decode::<u32>(Table::Meta, b"head", &bytes).unwrap(), 7);
        let damaged = |result: Result<u32, StoreError>| assert!(matches!(result, Err(StoreError::Corrupt { .. })), "{result:?}");
        damaged(decode(Table::Meta, b"tail", &bytes));
        damaged(decode(Table::Outbox, b"head", &bytes));
        damaged(decode(Table::Meta, b"head", b""));
        // A record of a later version, whole in itself.
        let mut later = bytes;
        later[5] = LATER.to_be_bytes()[1];
        let crc = checksum(Table::Meta, b"head", LATER, b"7");
        later[6..10].copy_from_slice(&crc.to_be_bytes());
        let result = decode::<u32>(Table::Meta, b"head", &later);
        assert!(matches!(result, Err(StoreError::Newer { found: LATER, known: SCHEMA })), "{result:?}");
    }

    /// A job as version 1 wrote it, without what was added since.
    #[test]
    fn f29_jobs_of_schema_1_stay_readable() {
        let json = r#"{"id":7,"source":{"folder":"hot","path":"part.stl","dev":1,"ino":2,"size":84,"mtime_ns":3,"profile":"default"},
            "state":{"publishing":{"hold":{"attempt":1,"epoch":2,"token":9,"alone":false},"publication":{"ending":"clean","reason":"",
            "output":"part.stl","output_hash":null,"report_hash":null,"original":"part.stl"}}},"attempts":1,
            "blame":{"charges":0,"deaths":1,"deaths_alone":0,"environment":0,"kills":0},"work":9,"submitted":5,"changed":6,"seq":11}"#;
        let key = 7_u64.to_be_bytes();
        let job: Job = decode(Table::Jobs, &key, &written(Table::Jobs, &key, 1, json)).unwrap();
        assert_eq!((job.kind(), job.blame.deaths, job.hold().unwrap().boot), (Kind::Publishing, 1, Boot(0)));
        assert_eq!((job.priority, job.waits_since()), (Priority::default(), Time(5)));
    }

    /// A record as it lies on the disk.
    fn written(table: Table, key: &[u8], schema: u16, json: &str) -> Vec<u8> {
        let crc = checksum(table, key, schema, json.as_bytes());
        [&MAGIC[..], &schema.to_be_bytes(), &crc.to_be_bytes(), json.as_bytes()].concat()
    }

    /// An end of a job as version 2 kept it for subscribers, and a word as version 5 does: later programs go on reading them, and one that knows
    /// jobs alone says that it does not know the word.
    #[test]
    fn f29_what_is_to_be_told_stays_readable() {
        let key = 12_u64.to_be_bytes();
        let end = r#"{"id":7,"source":{"folder":"hot","path":"part.stl","dev":1,"ino":2,"size":84,"mtime_ns":3,"profile":"default"},
            "state":{"ended":{"publication":{"ending":"repaired","reason":"","output":"part.stl","output_hash":null,"report_hash":null,
            "original":"part.stl"}}},"attempts":1,"blame":{"charges":0,"deaths":0,"deaths_alone":0,"environment":0,"kills":0},"work":9,
            "submitted":5,"changed":6,"seq":12}"#;
        let Notice::End(job) = decode_notice(&key, &written(Table::Outbox, &key, 2, end)).unwrap() else { panic!("an end") };
        assert_eq!((job.kind(), job.seq, job.publication().unwrap().ending), (Kind::Done, Seq(12), Ending::Repaired));
        let night = r#"{"seq":12,"at":7,"news":{"night":{"since":1,"until":6,"jobs":{"done":3,"needs_review":1}}}}"#;
        let Notice::Word(word) = decode_notice(&key, &written(Table::Outbox, &key, 5, night)).unwrap() else { panic!("a word") };
        let jobs = [(Kind::Done, 3), (Kind::NeedsReview, 1)].into();
        assert_eq!(word, Word { seq: Seq(12), at: Time(7), news: News::Night { since: Time(1), until: Time(6), jobs } });
        let away = r#"{"seq":12,"at":7,"news":{"folder_away":{"folder":"hot","reason":"gone"}}}"#;
        assert_eq!(decode_notice(&key, &written(Table::Outbox, &key, 5, away)).unwrap().seq(), Seq(12));
        let bytes = encode_word(&key, &word).unwrap();
        assert_eq!(decode_notice(&key, &bytes).unwrap(), Notice::Word(word));
        let schema = u16::from_be_bytes([bytes[4], bytes[5]]);
        assert!([PLAIN, APPROVED, HEAD].iter().all(|earlier| schema > *earlier), "an earlier program takes it for no job");
    }

    /// A program that does not know an end or a kind must not call the store damaged for it: it refuses the record by its schema.
    #[test]
    fn f29_carried_files_have_a_schema_of_their_own() {
        let clean = crate::testkit::dropped("a.mtl", 9).unwrap().source;
        let job = |ending| {
            let job = Job::queued(JobId(7), clean.clone(), Time(5));
            Job { state: State::Ended { publication: crate::testkit::result_of(&job, ending) }, ..job }
        };
        let schema = |bytes: Vec<u8>| u16::from_be_bytes([bytes[4], bytes[5]]);
        let key = 7_u64.to_be_bytes();
        for encode in [encode_job, encode_end] {
            let schemas =
                [Ending::Clean, Ending::Skipped, Ending::Carried].map(|ending| schema(encode(&key, &job(ending)).unwrap()));
            assert_eq!(schemas, [PLAIN, NAMELESS, CARRIED]);
        }
        let told = decode_notice(&key, &encode_end(&key, &job(Ending::Carried)).unwrap()).unwrap();
        assert_eq!(told, Notice::End(Box::new(job(Ending::Carried))));
        let night = |kind| Word {
            seq: Seq(7),
            at: Time(7),
            news: News::Night { since: Time(1), until: Time(6), jobs: [(kind, 1)].into() },
        };
        let bytes = encode_word(&key, &night(Kind::Carried)).unwrap();
        assert_eq!(decode_notice(&key, &bytes).unwrap(), Notice::Word(night(Kind::Carried)));
        assert_eq!([schema(bytes), schema(encode_word(&key, &night(Kind::Done)).unwrap())], [WORD_OF_CARRIED, WORD]);
    }

    /// Whatever is to be told has room, so that a folder that goes can always be told of.
    #[test]
    fn the_largest_word_fits() {
        let longest = "\"".repeat(2 * MAX_REASON);
        let folder = "n".repeat(crate::queue::MAX_NAME - 2);
        let jobs = Kind::ALL.map(|kind| (kind, u64::MAX)).into();
        for news in [
            News::FolderAway { folder, reason: one_line(&longest) },
            News::Night { since: Time(u64::MAX), until: Time(u64::MAX), jobs },
        ] {
            encode_word(&u64::MAX.to_be_bytes(), &Word { seq: Seq(u64::MAX), at: Time(u64::MAX), news }).unwrap();
        }
    }

    #[test]
    fn what_is_too_long_is_refused() {
        let text = "x".repeat(MAX);
        assert!(matches!(encode(Table::Meta, b"head", &text), Err(StoreError::TooLong { .. })));
    }
}
