//! All that the shared store holds, out and in: see [`crate::transfer`]; and a look at every row.

use std::collections::BTreeMap;

use sqlx::postgres::{PgConnection, PgRow, PgTransaction};
use sqlx::{Connection, Row};

use super::claim::Life;
use super::database::Failure;
use super::look::list;
use super::marks::begin_marks;
use super::notices::entry;
use super::outbox;
use super::row::{Columns, Stored, int, number};
use super::submit::{head, insert};
use crate::id::{Seq, Time};
use crate::job::Job;
use crate::news::Notice;
use crate::record;
use crate::store::{Query, StoreError};
use crate::transfer::{Holdings, Marks, last_number, not_empty, orphaned};

/// Jobs written by one statement.
const CHUNK: usize = 1000;

/// All rows of two columns, a name and a number.
async fn pairs(transaction: &mut PgTransaction<'_>, sql: &'static str) -> Result<BTreeMap<String, u64>, Failure> {
    let rows = sqlx::query(sql).fetch_all(&mut **transaction).await?;
    rows.iter().map(|row| Ok((row.try_get(0)?, number(row.try_get(1)?)))).collect()
}

/// As [`crate::Transfer::holdings`].
pub(super) async fn holdings(connection: &mut PgConnection) -> Result<Holdings, Failure> {
    let mut transaction = connection.begin().await?;
    sqlx::query("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ READ ONLY").execute(&mut *transaction).await?;
    let sql = "SELECT last_job, coalesce((SELECT bool_or(unfilled) FROM daemons), unfilled) AS unfilled,
        coalesce((SELECT max(night) FROM daemons), night) AS night, (SELECT CASE WHEN is_called THEN last_value ELSE 0 END FROM transitions) AS seq FROM head";
    let row = sqlx::query(sql).fetch_one(&mut *transaction).await?;
    let night: Option<i64> = row.try_get("night")?;
    let away = pairs(&mut transaction, "SELECT folder, since FROM away").await?;
    let subscribers = pairs(&mut transaction, "SELECT name, min(heard) FROM subscribers GROUP BY name").await?;
    let marks = Marks {
        last_job: crate::id::JobId(number(row.try_get("last_job")?)),
        seq: Seq(number(row.try_get("seq")?)),
        unfilled: row.try_get("unfilled")?,
        night: night.map(|night| Time(number(night))),
        away: away.into_iter().map(|(folder, since)| (folder, Time(since))).collect(),
        subscribers: subscribers.into_iter().map(|(name, heard)| (name, Seq(heard))).collect(),
    };
    let jobs = list(&mut transaction, None, &Query::default()).await?;
    let rows = sqlx::query("SELECT seq, job, record FROM outbox ORDER BY seq").fetch_all(&mut *transaction).await?;
    let notices = rows.iter().map(entry).collect::<Result<_, _>>()?;
    transaction.rollback().await?;
    Ok(Holdings { marks, jobs, notices })
}

/// As [`crate::Transfer::take_over`], all of it or nothing.
pub(super) async fn take_over(connection: &mut PgConnection, life: &Life, holdings: &Holdings) -> Result<(), Failure> {
    let mut transaction = connection.begin().await?;
    head(&mut transaction).await?;
    let sql = "SELECT EXISTS (SELECT 1 FROM jobs) OR EXISTS (SELECT 1 FROM outbox) AS is_used";
    if sqlx::query(sql).fetch_one(&mut *transaction).await?.try_get("is_used")? {
        return Err(not_empty().into());
    }
    let marks = &holdings.marks;
    let last = int(last_number(holdings).0).max(1);
    sqlx::query("SELECT setval('transitions', greatest(last_value, $1)) FROM transitions")
        .bind(last)
        .execute(&mut *transaction)
        .await?;
    let jobs: Vec<Job> = holdings.jobs.iter().map(orphaned).collect();
    if jobs.iter().any(|job| job.hold().is_some()) {
        let sql = "INSERT INTO lives (epoch, daemon, began, seen, is_over) OVERRIDING SYSTEM VALUE VALUES (0, $1, suture_now(), 0, true)
            ON CONFLICT DO NOTHING";
        sqlx::query(sql).bind(&life.daemon).execute(&mut *transaction).await?;
    }
    for chunk in jobs.chunks(CHUNK) {
        insert(&mut transaction, chunk, false, marks.last_job).await?;
        let held = "UPDATE jobs j SET seq = n.seq, epoch = CASE WHEN n.held THEN 0 END, lease_until = CASE WHEN n.held THEN suture_now() + $4 END,
            cancel = n.cancel FROM unnest($1::bigint[], $2::bigint[], $3::boolean[], $5::boolean[]) AS n (id, seq, held, cancel) WHERE j.id = n.id";
        let cancels = chunk.iter().map(|job| Columns::of(job).map(|columns| columns.cancel)).collect::<Result<Vec<_>, _>>()?;
        sqlx::query(held)
            .bind(chunk.iter().map(|job| int(job.id.0)).collect::<Vec<_>>())
            .bind(chunk.iter().map(|job| int(job.seq.0)).collect::<Vec<_>>())
            .bind(chunk.iter().map(|job| job.hold().is_some()).collect::<Vec<_>>())
            .bind(life.lease)
            .bind(cancels)
            .execute(&mut *transaction)
            .await?;
    }
    put_marks(&mut transaction, life, marks).await?;
    put_notices(&mut transaction, life, &holdings.notices).await?;
    Ok(transaction.commit().await?)
}

/// The marks become those of the daemon that takes over, and what daemons to come begin with.
async fn put_marks(transaction: &mut PgTransaction<'_>, life: &Life, marks: &Marks) -> Result<(), Failure> {
    sqlx::query("UPDATE head SET last_job = greatest(last_job, $1), unfilled = $2, night = $3")
        .bind(int(marks.last_job.0))
        .bind(marks.unfilled)
        .bind(marks.night.map(|night| int(night.0)))
        .execute(&mut **transaction)
        .await?;
    sqlx::query("DELETE FROM daemons").execute(&mut **transaction).await?;
    begin_marks(transaction, &life.teller).await?;
    sqlx::query("DELETE FROM subscribers").execute(&mut **transaction).await?;
    sqlx::query("DELETE FROM away").execute(&mut **transaction).await?;
    for (name, heard) in &marks.subscribers {
        let sql = "INSERT INTO subscribers (daemon, name, heard) VALUES ($1, $2, $3)";
        sqlx::query(sql).bind(&life.teller).bind(name).bind(int(heard.0)).execute(&mut **transaction).await?;
    }
    for (folder, since) in &marks.away {
        let sql = "INSERT INTO away (folder, since) VALUES ($1, $2)";
        sqlx::query(sql).bind(folder).bind(int(since.0)).execute(&mut **transaction).await?;
    }
    Ok(())
}

async fn put_notices(transaction: &mut PgTransaction<'_>, life: &Life, notices: &[Notice]) -> Result<(), Failure> {
    for notice in notices {
        let job = match notice {
            Notice::Word(word) => {
                outbox::put(transaction, &life.teller, word).await?;
                continue;
            }
            Notice::End(job) => job,
        };
        let record = record::encode_end(&outbox::key(Some(job.id)), job)?;
        let sql = "INSERT INTO outbox (seq, job, folder, record) VALUES ($1, $2, $3, $4)";
        let put = sqlx::query(sql).bind(int(notice.seq().0)).bind(int(job.id.0)).bind(&job.source.folder).bind(record);
        put.execute(&mut **transaction).await?;
    }
    Ok(())
}

/// A line for each row that is damaged, or whose columns say something else than its record.
pub(super) async fn verify(connection: &mut PgConnection) -> Result<Vec<String>, Failure> {
    let sql = "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at, coalesce(stage, kind) AS kind, folder, size, priority, since, not_before, alone,
        cancel, file_key, recipe, id > (SELECT last_job FROM head) OR seq > (SELECT last_value FROM transitions) AS is_ahead
        FROM jobs ORDER BY id";
    let mut wrong = Vec::new();
    for row in sqlx::query(sql).fetch_all(&mut *connection).await? {
        match Stored::read(&row).and_then(|stored| says(&row, &stored)) {
            Ok(line) => wrong.extend(line),
            Err(Failure::Store(StoreError::Corrupt { what, reason })) => wrong.push(format!("{what}: {reason}")),
            Err(failure) => return Err(failure),
        }
    }
    for row in sqlx::query("SELECT seq, job, record FROM outbox ORDER BY seq").fetch_all(connection).await? {
        match entry(&row) {
            Ok(_) => {}
            Err(Failure::Store(StoreError::Corrupt { what, reason })) => wrong.push(format!("{what}: {reason}")),
            Err(failure) => return Err(failure),
        }
    }
    Ok(wrong)
}

/// What the columns of a row say otherwise than its job.
fn says(row: &PgRow, stored: &Stored) -> Result<Option<String>, Failure> {
    let job = &stored.job;
    let expected = Columns::of(job)?;
    let texts: [(&str, &str); 2] = [("kind", expected.kind), ("folder", &expected.folder)];
    let numbers = [
        ("size", Some(expected.size)),
        ("since", Some(expected.since)),
        ("not_before", expected.not_before),
        ("recipe", expected.recipe),
        ("epoch", job.hold().map(|hold| int(hold.epoch.0))),
    ];
    let flags = [("alone", expected.alone), ("cancel", expected.cancel)];
    let mut wrong = Vec::new();
    for (name, text) in texts {
        wrong.extend((row.try_get::<String, _>(name)? != text).then_some(name));
    }
    for (name, number) in numbers {
        wrong.extend((row.try_get::<Option<i64>, _>(name)? != number).then_some(name));
    }
    for (name, flag) in flags {
        wrong.extend((row.try_get::<bool, _>(name)? != flag).then_some(name));
    }
    wrong.extend((row.try_get::<i16, _>("priority")? != expected.priority).then_some("priority"));
    wrong.extend((row.try_get::<Option<Vec<u8>>, _>("file_key")? != expected.file_key).then_some("file_key"));
    wrong.extend((stored.token.is_some() && stored.token != job.hold().map(|hold| hold.token)).then_some("token"));
    let id = job.id;
    let line = (!wrong.is_empty()).then(|| format!("job {id}: the columns {} say otherwise than its record", wrong.join(", ")));
    let ahead =
        row.try_get::<bool, _>("is_ahead")?.then(|| format!("job {id}: it is ahead of the head, which says what came last"));
    Ok(line.or(ahead))
}
