//! Notices that subscribers have not heard yet: each job as it stood when it came to its end, under the number of that transition, and news of the service
//! itself, under the number of theirs ([`super::marks`]). An entry is written in the transaction in which the job ends, so that neither is there without
//! the other, and it goes when all subscribers have it. Where no one subscribes, nothing is kept.
//!
//! News lie among the ends, since all are told in one order and under one mark of each subscriber. They have a schema of their own: a program that
//! knows jobs alone refuses them by name, instead of calling the store damaged.
//!
//! [`super::notices`] reads it. The entry `subscribers` of the table `meta` says who has heard of what.

use std::collections::BTreeMap;

use crate::id::Seq;
use crate::job::{Job, State};
use crate::news::Word;
use crate::record;
use crate::store::StoreError;
use crate::tables::{Put, Table, Tables};

pub(super) const SUBSCRIBERS: &[u8] = b"subscribers";

/// Who subscribes, and the last transition that each has heard of.
pub(super) type Subscribers = BTreeMap<String, Seq>;

/// Those of earlier lives.
pub(super) fn subscribers(tables: &dyn Tables) -> Result<Subscribers, StoreError> {
    let bytes = tables.get(Table::Meta, SUBSCRIBERS)?;
    bytes.map_or_else(|| Ok(Subscribers::new()), |bytes| record::decode(Table::Meta, SUBSCRIBERS, &bytes))
}

/// The key of the entry of a transition.
pub(super) fn key(seq: Seq) -> [u8; 8] {
    seq.0.to_be_bytes()
}

/// The entry of this change, if it is a job's end and someone is to hear of it. A job that comes back from an earlier store ended long ago.
pub(super) fn entry(subscribers: &Subscribers, from: Option<&Job>, to: &Job) -> Result<Option<Put>, StoreError> {
    let ends = matches!(to.state, State::Ended { .. }) && from.is_some_and(|from| from.state != to.state);
    if subscribers.is_empty() || !ends {
        return Ok(None);
    }
    let key = key(to.seq);
    let value = record::encode_end(&key, to)?;
    Ok(Some(Put { table: Table::Outbox, key: key.to_vec(), value: Some(value) }))
}

/// The entry of these news, if someone is to hear of them.
pub(super) fn word(subscribers: &Subscribers, word: &Word) -> Result<Option<Put>, StoreError> {
    if subscribers.is_empty() {
        return Ok(None);
    }
    let key = key(word.seq);
    let value = record::encode_word(&key, word)?;
    Ok(Some(Put { table: Table::Outbox, key: key.to_vec(), value: Some(value) }))
}
