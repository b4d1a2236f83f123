//! What there is one of: what was told last of the service itself, and whether earlier stores were read.

use sqlx::postgres::PgConnection;
use sqlx::{Connection, Row};

use super::database::Failure;
use super::outbox;
use super::row::{int, number};
use crate::id::{Seq, Time};
use crate::news::{News, Word};
use crate::record;

/// As [`crate::JobStore::tell`]. A mark and the word of it are one transaction.
pub(super) async fn tell(connection: &mut PgConnection, news: &News) -> Result<bool, Failure> {
    let mut transaction = connection.begin().await?;
    outbox::share(&mut transaction).await?;
    let mark = match news {
        News::FolderAway { folder, .. } => {
            sqlx::query("INSERT INTO away (folder, since) VALUES ($1, suture_now()) ON CONFLICT DO NOTHING").bind(folder)
        }
        News::FolderBack { folder } => sqlx::query("DELETE FROM away WHERE folder = $1").bind(folder),
        News::Night { until, .. } => {
            sqlx::query("UPDATE head SET night = $1 WHERE night IS NULL OR night < $1").bind(int(until.0))
        }
    };
    if mark.execute(&mut *transaction).await?.rows_affected() == 0 {
        transaction.rollback().await?;
        return Ok(false);
    }
    let row = sqlx::query("SELECT nextval('transitions') AS seq, suture_now() AS now").fetch_one(&mut *transaction).await?;
    let (seq, at) = (Seq(number(row.try_get("seq")?)), Time(number(row.try_get("now")?)));
    let word = Word { seq, at, news: news.clone() };
    outbox::put(&mut transaction, seq, None, record::encode_word(&outbox::key(None), &word)?).await?;
    transaction.commit().await?;
    Ok(true)
}

/// As [`crate::JobStore::last_night`].
pub(super) async fn last_night(connection: &mut PgConnection) -> Result<Option<Time>, Failure> {
    let night: Option<i64> = sqlx::query("SELECT night FROM head").fetch_one(connection).await?.try_get("night")?;
    Ok(night.map(|night| Time(number(night))))
}

/// As [`crate::JobStore::begin_night`].
pub(super) async fn begin_night(connection: &mut PgConnection, at: Time) -> Result<(), Failure> {
    sqlx::query("UPDATE head SET night = $1").bind(int(at.0)).execute(connection).await?;
    Ok(())
}

/// As [`crate::JobStore::is_unfilled`].
pub(super) async fn is_unfilled(connection: &mut PgConnection) -> Result<bool, Failure> {
    Ok(sqlx::query("SELECT unfilled FROM head").fetch_one(connection).await?.try_get("unfilled")?)
}

/// As [`crate::JobStore::set_filled`].
pub(super) async fn set_filled(connection: &mut PgConnection) -> Result<(), Failure> {
    sqlx::query("UPDATE head SET unfilled = false WHERE unfilled").execute(connection).await?;
    Ok(())
}
