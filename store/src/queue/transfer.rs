//! All that the tables hold, out and in: see [`crate::transfer`].

use super::{Head, Queue, UNFILLED, all_jobs, head_put, marks, outbox};
use crate::job::Job;
use crate::news::Notice;
use crate::record;
use crate::store::StoreError;
use crate::tables::{Put, Table, Tables};
use crate::transfer::{Holdings, Marks, last_number, not_empty, orphaned};

/// Jobs written by one transaction of the tables.
const CHUNK: usize = 1000;

impl<T: Tables> Queue<T> {
    /// As [`crate::Transfer::holdings`].
    pub(crate) fn holdings(&self) -> Result<Holdings, StoreError> {
        let inner = self.lock();
        let marks = Marks {
            last_job: inner.head.last_job,
            seq: inner.head.seq,
            unfilled: self.lacks_past()?,
            night: self.night_mark()?,
            away: marks::away_folders(&self.tables)?,
            subscribers: inner.subscribers.clone(),
        };
        let mut notices = Vec::new();
        self.tables.scan(Table::Outbox, &[], &[], &mut |key, value| {
            notices.push(record::decode_notice(key, value)?);
            Ok(true)
        })?;
        Ok(Holdings { marks, jobs: all_jobs(&self.tables)?, notices })
    }

    /// As [`crate::Transfer::take_over`].
    pub(crate) fn take_over(&self, holdings: &Holdings) -> Result<(), StoreError> {
        self.tables.sound()?;
        let here = self.holdings()?;
        if !here.jobs.is_empty() || !here.notices.is_empty() {
            return Err(not_empty());
        }
        let Marks { last_job, .. } = holdings.marks;
        let seq = self.lock().head.seq.max(last_number(holdings));
        let head = |head: Head| Head { seq, last_job: head.last_job.max(last_job), ..head };
        for chunk in holdings.jobs.chunks(CHUNK) {
            let jobs: Vec<Job> = chunk.iter().map(orphaned).collect();
            let changes: Vec<_> = jobs.iter().map(|job| (None, job)).collect();
            let inner = self.lock();
            let head = head(inner.head);
            self.commit(inner, head, &changes)?;
        }
        let mut inner = self.lock();
        let head = head(inner.head);
        let mut puts = self.mark_puts(&holdings.marks)?;
        for notice in &holdings.notices {
            let key = outbox::key(notice.seq());
            let value = match notice {
                Notice::End(job) => record::encode_end(&key, job)?,
                Notice::Word(word) => record::encode_word(&key, word)?,
            };
            puts.push(Put { table: Table::Outbox, key: key.to_vec(), value: Some(value) });
        }
        puts.push(head_put(&head)?);
        self.tables.write(puts, head.seq)?;
        (inner.head, inner.subscribers) = (head, holdings.marks.subscribers.clone());
        drop(inner);
        self.settle(head)
    }

    fn mark_puts(&self, marks: &Marks) -> Result<Vec<Put>, StoreError> {
        let meta = |key: &[u8], value: Option<Vec<u8>>| Put { table: Table::Meta, key: key.to_vec(), value };
        let subscribers = record::encode(Table::Meta, outbox::SUBSCRIBERS, &marks.subscribers)?;
        let mut puts = vec![meta(outbox::SUBSCRIBERS, Some(subscribers))];
        let unfilled = marks.unfilled.then(|| record::encode(Table::Meta, UNFILLED, &true)).transpose()?;
        puts.push(meta(UNFILLED, unfilled));
        let times = marks.away.iter().map(|(folder, since)| (marks::away(folder), *since));
        for (key, time) in times.chain(marks.night.map(|night| (marks::NIGHT.to_vec(), night))) {
            puts.push(meta(&key, Some(record::encode(Table::Meta, &key, &time)?)));
        }
        Ok(puts)
    }
}
