//! What there is one of for each daemon: what was told last of the service itself, and whether earlier stores were read.

use sqlx::postgres::PgConnection;
use sqlx::{Connection, Row};

use super::claim::Life;
use super::database::Failure;
use super::outbox;
use super::row::{int, number};
use crate::id::{Seq, Time};
use crate::news::{News, Word};

/// What a teller knows of itself when it begins for the first time.
pub(super) async fn begin_marks(connection: &mut PgConnection, teller: &str) -> Result<(), Failure> {
    let sql = "INSERT INTO daemons (daemon, unfilled, night) SELECT $1, unfilled, night FROM head ON CONFLICT DO NOTHING";
    sqlx::query(sql).bind(teller).execute(connection).await?;
    Ok(())
}

/// A daemon that begins, and is to tell of ends and news.
pub(super) struct Heir<'a> {
    pub(super) daemon: &'a str,
    pub(super) teller: &'a str,
    pub(super) folders: &'a Option<Vec<String>>,
    /// In ms.
    pub(super) lease: i64,
}

/// What tellers of before have left to be told becomes the heir's, so that it is told, and waits for no one who will not come: those that the daemon was in
/// earlier lives (`before`), and those that told of nothing but folders of this one's, as far as no one that lives is one of them.
pub(super) async fn succeed(connection: &mut PgConnection, heir: &Heir<'_>, before: &[String]) -> Result<(), Failure> {
    let Heir { daemon, teller, folders, lease } = *heir;
    let tells = "UPDATE daemons SET folders = $2 WHERE daemon = $1";
    sqlx::query(tells).bind(teller).bind(folders).execute(&mut *connection).await?;
    let gone = "SELECT d.daemon FROM daemons d WHERE d.daemon <> $1 AND (d.daemon = ANY ($2) OR (cardinality(d.folders) > 0 AND d.folders <@ $3))
        AND NOT EXISTS (SELECT 1 FROM lives l WHERE coalesce(l.teller, l.daemon) = d.daemon AND NOT l.is_over AND l.daemon <> $4
            AND (l.roles IS NULL OR 'control' = ANY (l.roles)) AND greatest(l.seen, suture_up_since()) + $5 > suture_now())";
    let rows = sqlx::query(gone).bind(teller).bind(before).bind(folders).bind(daemon).bind(lease);
    let rows = rows.fetch_all(&mut *connection).await?;
    let gone = rows.iter().map(|row| row.try_get("daemon")).collect::<Result<Vec<String>, _>>()?;
    if gone.is_empty() {
        return Ok(());
    }
    for sql in [
        "INSERT INTO subscribers (daemon, name, heard) SELECT $1, name, min(heard) FROM subscribers WHERE daemon = ANY ($2) GROUP BY name
            ON CONFLICT DO NOTHING",
        "UPDATE daemons SET night = greatest(night, (SELECT max(night) FROM daemons WHERE daemon = ANY ($2))) WHERE daemon = $1",
        "UPDATE outbox SET daemon = $1 WHERE daemon = ANY ($2)",
    ] {
        sqlx::query(sql).bind(teller).bind(&gone).execute(&mut *connection).await?;
    }
    for sql in ["DELETE FROM subscribers WHERE daemon = ANY ($1)", "DELETE FROM daemons WHERE daemon = ANY ($1)"] {
        sqlx::query(sql).bind(&gone).execute(&mut *connection).await?;
    }
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
            sqlx::query(sql).bind(int(until.0)).bind(&life.teller)
        }
    };
    if mark.execute(&mut *transaction).await?.rows_affected() == 0 {
        transaction.rollback().await?;
        return Ok(false);
    }
    let row = sqlx::query("SELECT nextval('transitions') AS seq, suture_now() AS now").fetch_one(&mut *transaction).await?;
    let (seq, at) = (Seq(number(row.try_get("seq")?)), Time(number(row.try_get("now")?)));
    let word = Word { seq, at, news: news.clone() };
    outbox::put(&mut transaction, &life.teller, &word).await?;
    transaction.commit().await?;
    Ok(true)
}

/// As [`crate::JobStore::last_night`].
pub(super) async fn last_night(connection: &mut PgConnection, life: &Life) -> Result<Option<Time>, Failure> {
    let sql = "SELECT coalesce((SELECT night FROM daemons WHERE daemon = $1), (SELECT night FROM head)) AS night";
    let night: Option<i64> = sqlx::query(sql).bind(&life.teller).fetch_one(connection).await?.try_get("night")?;
    Ok(night.map(|night| Time(number(night))))
}

/// As [`crate::JobStore::begin_night`].
pub(super) async fn begin_night(connection: &mut PgConnection, life: &Life, at: Time) -> Result<(), Failure> {
    let sql = "UPDATE daemons SET night = $2 WHERE daemon = $1";
    sqlx::query(sql).bind(&life.teller).bind(int(at.0)).execute(connection).await?;
    Ok(())
}

/// As [`crate::JobStore::is_unfilled`].
pub(super) async fn is_unfilled(connection: &mut PgConnection, life: &Life) -> Result<bool, Failure> {
    let sql = "SELECT coalesce((SELECT unfilled FROM daemons WHERE daemon = $1), (SELECT unfilled FROM head)) AS unfilled";
    Ok(sqlx::query(sql).bind(&life.teller).fetch_one(connection).await?.try_get("unfilled")?)
}

/// As [`crate::JobStore::set_filled`].
pub(super) async fn set_filled(connection: &mut PgConnection, life: &Life) -> Result<(), Failure> {
    sqlx::query("UPDATE daemons SET unfilled = false WHERE daemon = $1 AND unfilled")
        .bind(&life.teller)
        .execute(connection)
        .await?;
    Ok(())
}
