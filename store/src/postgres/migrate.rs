//! The schema, and how it comes to its present version: forward only, one program at a time, all in one transaction.

use std::path::PathBuf;

use sha2::{Digest, Sha256};
use sqlx::postgres::PgConnection;
use sqlx::{AssertSqlSafe, Connection, Executor, Row};

use super::database::Failure;
use super::outbox::LOCKS;
use crate::store::StoreError;

/// Each with its number, from 1 on. What is written here never changes: a database remembers the digest.
const MIGRATIONS: [&str; 4] = [
    include_str!("sql/schema_1.sql"),
    include_str!("sql/schema_2.sql"),
    include_str!("sql/schema_3.sql"),
    include_str!("sql/schema_4.sql"),
];

pub(super) fn digest(migration: &str) -> Vec<u8> {
    Sha256::digest(migration).to_vec()
}

/// May it be the name of a schema, so that it needs no quotes?
pub(super) fn is_plain(schema: &str) -> bool {
    let first = schema.bytes().next().is_some_and(|byte| byte.is_ascii_lowercase());
    first && schema.len() <= 48 && schema.bytes().all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_'))
}

/// Brings the schema to the version that this program knows. Whoever may not make tables can only find it there.
pub(super) async fn migrate(connection: &mut PgConnection, schema: &str) -> Result<(), Failure> {
    // Who is not to wait for a lock, and may not make a schema, need not.
    if is_current(connection, schema).await? {
        return Ok(());
    }
    let mut transaction = connection.begin().await?;
    let lock = sqlx::query("SELECT pg_advisory_xact_lock($1, hashtext($2 || '/migrations'))").bind(LOCKS).bind(schema);
    transaction.execute(lock).await?;
    if !is_there(&mut transaction, schema).await? {
        let make = format!(
            "CREATE SCHEMA IF NOT EXISTS {schema};
             CREATE TABLE migrations (version integer PRIMARY KEY, digest bytea NOT NULL, at timestamptz NOT NULL DEFAULT now())"
        );
        sqlx::raw_sql(AssertSqlSafe(make)).execute(&mut *transaction).await?;
    }
    let done = steps(&mut transaction, schema).await?;
    for (version, migration) in (1_i32..).zip(MIGRATIONS).skip(done) {
        sqlx::raw_sql(migration).execute(&mut *transaction).await?;
        let note = sqlx::query("INSERT INTO migrations (version, digest) VALUES ($1, $2)").bind(version).bind(digest(migration));
        transaction.execute(note).await?;
    }
    Ok(transaction.commit().await?)
}

/// Is the schema there, in the version that this program knows?
pub(super) async fn is_current(connection: &mut PgConnection, schema: &str) -> Result<bool, Failure> {
    Ok(is_there(connection, schema).await? && steps(connection, schema).await? == MIGRATIONS.len())
}

async fn is_there(connection: &mut PgConnection, schema: &str) -> Result<bool, Failure> {
    // A look at the catalogue's rows: what names stand for may be remembered from before another made them.
    let sql = "SELECT EXISTS (SELECT 1 FROM pg_tables WHERE schemaname = $1 AND tablename = 'migrations') AS there";
    let there = sqlx::query(sql).bind(schema);
    Ok(there.fetch_one(connection).await?.try_get("there")?)
}

/// How many of the migrations were made; fails where others were.
async fn steps(connection: &mut PgConnection, schema: &str) -> Result<usize, Failure> {
    let rows = sqlx::query("SELECT version, digest FROM migrations ORDER BY version").fetch_all(connection).await?;
    for (at, row) in rows.iter().enumerate() {
        let (version, found): (i32, Vec<u8>) = (row.try_get("version")?, row.try_get("digest")?);
        let Some(known) = MIGRATIONS.get(at) else {
            let newest = rows.last().map(|row| row.try_get("version")).transpose()?.unwrap_or(version);
            let version = |number: i32| u16::try_from(number).unwrap_or(u16::MAX);
            let known = u16::try_from(MIGRATIONS.len()).unwrap_or(u16::MAX);
            return Err(StoreError::Newer { found: version(newest), known }.into());
        };
        if usize::try_from(version).ok() != Some(at + 1) || found != digest(known) {
            return Err(StoreError::Unusable {
                path: PathBuf::from(format!("schema {schema} of the database")),
                reason: format!("its version {version} was not made by a release of this program"),
                advice: "start the program that made it, or name an empty schema".into(),
            }
            .into());
        }
    }
    Ok(rows.len())
}
