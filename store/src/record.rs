//! Records: how a value lies in a table.
//!
//! `SUTR` · schema (u16) · CRC-32 (u32) · JSON. Numbers are big-endian. The checksum is over the table, the key, the schema and
//! the JSON, so that a value under a wrong key is found, too. A record has at most [`MAX`] bytes.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::queue::Table;
use crate::store::StoreError;

/// Version of what the JSON means. Raised when an older program would misread it.
pub(crate) const SCHEMA: u16 = 1;
/// Largest record in bytes. The database would put values from a quarter of its segment on into files of their own.
pub(crate) const MAX: usize = 4096;

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

/// `value` as a record under `key` of `table`.
pub(crate) fn encode<T: Serialize>(table: Table, key: &[u8], value: &T) -> Result<Vec<u8>, StoreError> {
    let too_long = || StoreError::TooLong { what: name(table, key) };
    let mut bytes = Vec::with_capacity(1024);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&SCHEMA.to_be_bytes());
    bytes.extend_from_slice(&[0; 4]);
    serde_json::to_writer(&mut bytes, value).map_err(|_| too_long())?;
    if bytes.len() > MAX {
        return Err(too_long());
    }
    let (header, json) = bytes.split_at_mut(HEADER);
    header.split_at_mut(6).1.copy_from_slice(&checksum(table, key, SCHEMA, json).to_be_bytes());
    Ok(bytes)
}

/// The value of the record `bytes` under `key` of `table`.
pub(crate) fn decode<T: DeserializeOwned>(table: Table, key: &[u8], bytes: &[u8]) -> Result<T, StoreError> {
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
    serde_json::from_slice(json).map_err(|error| fail(&error.to_string()))
}

fn name(table: Table, key: &[u8]) -> String {
    match table {
        Table::Meta => format!("meta/{}", String::from_utf8_lossy(key)),
        Table::Jobs => match key.try_into() {
            Ok(id) => format!("job {}", u64::from_be_bytes(id)),
            Err(_) => "a job under a key that is no number".to_owned(),
        },
        Table::ByState => "by_state".to_owned(),
        Table::ByKey => "by_key".to_owned(),
    }
}
