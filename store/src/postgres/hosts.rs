//! Who shares the store: each daemon's life tells what it is with its signs of life; and which of them are to claim nothing.

use std::sync::PoisonError;

use sqlx::postgres::{PgConnection, PgRow};
use sqlx::{Connection, Row};

use super::claim::Life;
use super::database::Failure;
use super::row::{int, number};
use crate::host::{Host, Station};
use crate::id::Time;
use crate::role::{Role, Roles};

/// A daemon that gave no sign for so long is not shown any more, in ms.
const FORGOTTEN_AFTER: i64 = 24 * 3600 * 1000;

const HOSTS: &str = "SELECT l.daemon, coalesce(l.host, split_part(l.daemon, ':', 1)) AS host, l.pid, l.version, l.roles, l.workers, l.memory, l.largest,
        coalesce(l.folders, '{}') AS folders, coalesce(l.keeps, l.folders, '{}') AS keeps, l.began, l.seen, greatest(l.seen, suture_up_since()) + $1 > suture_now() AS is_alive,
        suture_drains(l.epoch) AS is_draining, (SELECT count(*) FROM jobs j WHERE j.epoch = l.epoch) AS running
    FROM lives l WHERE NOT l.is_over AND l.seen + $2 > suture_now() ORDER BY 2, 1";

/// As [`crate::JobStore::hosts`].
pub(super) async fn hosts(connection: &mut PgConnection, life: &Life) -> Result<Vec<Host>, Failure> {
    let rows = sqlx::query(HOSTS).bind(life.lease).bind(FORGOTTEN_AFTER).fetch_all(connection).await?;
    rows.iter().map(host).collect()
}

fn host(row: &PgRow) -> Result<Host, Failure> {
    // A daemon of an earlier version tells nothing of itself, and does everything.
    let count = |name: &str| Ok::<_, Failure>(row.try_get::<Option<i64>, _>(name)?.map(number));
    let roles: Option<Vec<String>> = row.try_get("roles")?;
    let roles = roles.and_then(|words| Roles::of(words.iter().filter_map(|word| word.parse::<Role>().ok())));
    Ok(Host {
        daemon: row.try_get("daemon")?,
        station: Station {
            host: row.try_get("host")?,
            pid: count("pid")?.and_then(|pid| u32::try_from(pid).ok()).unwrap_or_default(),
            version: row.try_get::<Option<String>, _>("version")?.unwrap_or_default(),
            roles: roles.unwrap_or_default(),
            workers: count("workers")?.and_then(|workers| u32::try_from(workers).ok()).unwrap_or_default(),
            memory: count("memory")?.unwrap_or_default(),
            largest: count("largest")?,
            keeps: row.try_get("keeps")?,
        },
        folders: row.try_get("folders")?,
        began: Time(number(row.try_get("began")?)),
        seen: Time(number(row.try_get("seen")?)),
        is_alive: row.try_get("is_alive")?,
        is_draining: row.try_get("is_draining")?,
        running: number(row.try_get("running")?),
    })
}

/// The daemon lives, and is this.
pub(super) async fn see(connection: &mut PgConnection, life: &Life) -> Result<(), Failure> {
    let station = life.station.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let seen = "UPDATE lives SET seen = suture_now(), host = $2, pid = $3, version = $4, roles = $5, workers = $6, memory = $7, largest = $8, keeps = $9
        WHERE epoch = $1 AND NOT is_over";
    sqlx::query(seen)
        .bind(int(life.epoch.0))
        .bind(&station.host)
        .bind(i64::from(station.pid))
        .bind(&station.version)
        .bind(station.roles.each().map(Role::name).collect::<Vec<_>>())
        .bind(i64::from(station.workers))
        .bind(int(station.memory))
        .bind(station.largest.map(int))
        .bind(&station.keeps)
        .execute(connection)
        .await?;
    Ok(())
}

/// As [`crate::JobStore::drain`].
pub(super) async fn drain(connection: &mut PgConnection, name: &str, drains: bool) -> Result<bool, Failure> {
    let mut transaction = connection.begin().await?;
    let known = "SELECT EXISTS (SELECT 1 FROM lives WHERE $1 IN (daemon, coalesce(host, split_part(daemon, ':', 1))))
        OR EXISTS (SELECT 1 FROM drains WHERE name = $1) AS known";
    if !sqlx::query(known).bind(name).fetch_one(&mut *transaction).await?.try_get("known")? {
        return Ok(false);
    }
    let wish = if drains {
        sqlx::query("INSERT INTO drains (name, since) VALUES ($1, suture_now()) ON CONFLICT DO NOTHING")
    } else {
        // Of a host, those daemons too that were named one by one.
        sqlx::query("DELETE FROM drains WHERE name = $1 OR name IN (SELECT daemon FROM lives WHERE host = $1)")
    };
    wish.bind(name).execute(&mut *transaction).await?;
    sqlx::query("SELECT suture_news()").execute(&mut *transaction).await?;
    transaction.commit().await?;
    Ok(true)
}

/// As [`crate::JobStore::is_draining`].
pub(super) async fn is_draining(connection: &mut PgConnection, life: &Life) -> Result<bool, Failure> {
    let sql = "SELECT suture_drains($1) AS drains";
    Ok(sqlx::query(sql).bind(int(life.epoch.0)).fetch_one(connection).await?.try_get("drains")?)
}
