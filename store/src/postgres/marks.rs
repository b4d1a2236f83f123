//! What there is one of for each daemon: what was told last of the service itself, and whether earlier stores were read.

use sqlx::postgres::PgConnection;
use sqlx::{Connection, Row};

use super::claim::Life;
use super::database::Failure;
use super::outbox;
use super::row::{int, number};
use crate::id::{Seq, Time};
use crate::news::{News, Word};

/// What a daemon knows of itself when it begins for the first time.
pub(super) async fn begin_marks(connection: &mut PgConnection, daemon: &str) -> Result<(), Failure> {
    let sql = "INSERT INTO daemons (daemon, unfilled, night) SELECT $1, unfilled, night FROM head ON CONFLICT DO NOTHING";
    sqlx::query(sql).bind(daemon).execute(connection).await?;
    Ok(())
}

/// As [`crate::JobStore::tell`]. A mark and the word of it are one transaction.
pub(super) async fn tell(connection: &mut PgConnection, life: &Life, news: &News) -> Result<bool, Failure> {
    let mut transaction = connection.begin().await?;
    outbox::share(&mut transaction).await?;
    let mark = match news {
        News::FolderAway { folder, .. } => {
            sqlx::query("INSERT INTO away (folder, since) VALUES ($1, suture_now()) ON CONFLICT DO NOTHING").bind(folder)
        }
        News::FolderBack { folder } => sqlx::query("DELETE FROM away WHERE folder = $1").bind(folder),
        News::Night { until, .. } => {
            let sql = "UPDATE daemons SET night = $1 WHERE daemon = $2 AND (night IS NULL OR night < $1)";
            sqlx::query(sql).bind(int(until.0)).bind(&life.daemon)
        }
    };
    if mark.execute(&mut *transaction).await?.rows_affected() == 0 {
        transaction.rollback().await?;
        return Ok(false);
    }
    let row = sqlx::query("SELECT nextval('transitions') AS seq, suture_now() AS now").fetch_one(&mut *transaction).await?;
    let (seq, at) = (Seq(number(row.try_get("seq")?)), Time(number(row.try_get("now")?)));
    let word = Word { seq, at, news: news.clone() };
    outbox::put(&mut transaction, &life.daemon, &word).await?;
    transaction.commit().await?;
    Ok(true)
}

/// As [`crate::JobStore::last_night`].
pub(super) async fn last_night(connection: &mut PgConnection, life: &Life) -> Result<Option<Time>, Failure> {
    let sql = "SELECT coalesce((SELECT night FROM daemons WHERE daemon = $1), (SELECT night FROM head)) AS night";
    let night: Option<i64> = sqlx::query(sql).bind(&life.daemon).fetch_one(connection).await?.try_get("night")?;
    Ok(night.map(|night| Time(number(night))))
}

/// As [`crate::JobStore::begin_night`].
pub(super) async fn begin_night(connection: &mut PgConnection, life: &Life, at: Time) -> Result<(), Failure> {
    let sql = "UPDATE daemons SET night = $2 WHERE daemon = $1";
    sqlx::query(sql).bind(&life.daemon).bind(int(at.0)).execute(connection).await?;
    Ok(())
}

/// As [`crate::JobStore::is_unfilled`].
pub(super) async fn is_unfilled(connection: &mut PgConnection, life: &Life) -> Result<bool, Failure> {
    let sql = "SELECT coalesce((SELECT unfilled FROM daemons WHERE daemon = $1), (SELECT unfilled FROM head)) AS unfilled";
    Ok(sqlx::query(sql).bind(&life.daemon).fetch_one(connection).await?.try_get("unfilled")?)
}

/// As [`crate::JobStore::set_filled`].
pub(super) async fn set_filled(connection: &mut PgConnection, life: &Life) -> Result<(), Failure> {
    sqlx::query("UPDATE daemons SET unfilled = false WHERE daemon = $1 AND unfilled")
        .bind(&life.daemon)
        .execute(connection)
        .await?;
    Ok(())
}
