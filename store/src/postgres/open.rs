//! Where the shared store is, and how a life of a daemon begins on it.

use std::collections::HashMap;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgConnection};
use sqlx::{Connection, Row};
use tokio::runtime::{Builder, Runtime};

use super::claim::Life;
use super::database::{Again, Database, Failure, wait};
use super::leases::{Claims, keep_leases};
use super::migrate::{is_plain, migrate};
use super::row::number;
use crate::id::{Clock, Epoch, SystemClock};
use crate::store::StoreError;

/// A database that many daemons share, and who this one is.
#[derive(Clone, Debug)]
pub struct Shared {
    /// `postgres://user@host/database`, with what its address may say of TLS (`sslmode=verify-full`, `sslrootcert=…`). The database itself, or a
    /// pooler that gives whole sessions: statements are prepared.
    pub url: String,
    /// The store's own schema: small letters, digits and `_`, at most 48 of them.
    pub schema: String,
    /// The name of this daemon, of which there is one at a time: a life that begins under it ends those before.
    pub daemon: String,
    /// Connections at most.
    pub connections: u32,
    /// A daemon that gives no sign for so long has lost its jobs.
    pub lease: Duration,
    /// A call waits for a database that is away for so long.
    pub patience: Duration,
}

impl Shared {
    /// With what is right for most: schema `suture`, 8 connections, leases of a minute, patience of five.
    pub fn new(url: &str, daemon: &str) -> Self {
        Self {
            url: url.to_owned(),
            schema: "suture".to_owned(),
            daemon: daemon.to_owned(),
            connections: 8,
            lease: Duration::from_secs(60),
            patience: Duration::from_secs(300),
        }
    }

    fn unusable(&self, reason: &str, advice: &str) -> StoreError {
        let path = PathBuf::from(format!("schema {} of the database", self.schema));
        StoreError::Unusable { path, reason: reason.to_owned(), advice: advice.to_owned() }
    }

    fn options(&self) -> Result<PgConnectOptions, StoreError> {
        let options = PgConnectOptions::from_str(&self.url).map_err(|error| StoreError::Backend(Box::new(error)))?;
        Ok(options.application_name("suture").options([
            ("search_path", self.schema.as_str()),
            // A daemon that is stopped in the middle of a transaction must not keep others from their rows.
            ("idle_in_transaction_session_timeout", "30s"),
            ("lock_timeout", "30s"),
            // How many rows there are is not known at first, and changes by the hour; each statement has an index that it can go along.
            ("enable_seqscan", "off"),
            ("enable_bitmapscan", "off"),
            ("enable_sort", "off"),
            ("plan_cache_mode", "force_generic_plan"),
            ("jit", "off"),
        ]))
    }
}

/// Statements with which the owner of the schema lets the role of that name use the store, and nothing else: it makes, changes and drops no table.
pub fn role(schema: &str, role: &str) -> String {
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    include_str!("sql/role.sql").replace(":schema", &quoted(schema)).replace(":role", &quoted(role))
}

/// What a store is made of.
pub(super) struct Begun {
    pub(super) runtime: Arc<Runtime>,
    pub(super) end: Sender<Arc<Runtime>>,
    pub(super) database: Arc<Database>,
    pub(super) life: Life,
    pub(super) claims: Arc<Claims>,
}

/// Begins a life; with a clock, that one sets the time of all that is done in the schema.
pub(super) fn begin(shared: &Shared, clock: Option<Arc<dyn Clock>>) -> Result<Begun, StoreError> {
    if !is_plain(&shared.schema) {
        return Err(
            shared.unusable("that is no name for a schema", "use small letters, digits and `_`, at most 48, a letter first")
        );
    }
    let machine = clock.clone().unwrap_or_else(|| Arc::new(SystemClock));
    let database = Arc::new(Database::new(shared.options()?, shared.connections, shared.patience, clock.clone()));
    let runtime = Builder::new_multi_thread().worker_threads(1).thread_name("job-database").enable_all().build();
    let runtime = Arc::new(runtime.map_err(failed)?);
    let epoch = wait(&runtime, async || {
        // Half-made is not made: each part sees for itself what is left to do.
        database.call(Again::Yes, async |connection| begin_life(connection, shared, clock.is_some()).await).await
    })?;
    let lease = i64::try_from(shared.lease.as_millis()).unwrap_or(i64::MAX / 4);
    let life = Life { epoch, daemon: shared.daemon.clone(), machine, lease };
    let claims = Arc::new(Claims::default());
    let (end, ended) = channel();
    let keeper = (Arc::clone(&runtime), Arc::clone(&database), life.clone(), Arc::clone(&claims));
    let keep = move || keep_leases(&keeper.0, &keeper.1, &keeper.2, &keeper.3, &ended);
    std::thread::Builder::new().name("job-leases".into()).spawn(keep).map_err(failed)?;
    Ok(Begun { runtime, end, database, life, claims })
}

fn failed(source: std::io::Error) -> StoreError {
    StoreError::Io { path: "thread".into(), action: "starting one", source }
}

/// Brings the schema up to date, and begins a life.
async fn begin_life(connection: &mut PgConnection, shared: &Shared, is_test: bool) -> Result<Epoch, Failure> {
    let settings = "SELECT name, setting FROM pg_settings WHERE name IN ('fsync', 'synchronous_commit')";
    let rows = sqlx::query(settings).fetch_all(&mut *connection).await?;
    let settings: Result<HashMap<String, String>, sqlx::Error> =
        rows.iter().map(|row| Ok((row.try_get("name")?, row.try_get("setting")?))).collect();
    if let Some((name, _)) = settings?.into_iter().find(|(_, setting)| setting == "off") {
        let reason = format!("the database runs with {name} = off, and may lose what it has acknowledged");
        return Err(shared.unusable(&reason, "switch it on, or for this role alone with ALTER ROLE … SET").into());
    }
    migrate(connection, &shared.schema).await?;
    if is_test {
        let clock = "CREATE OR REPLACE FUNCTION suture_now() RETURNS bigint LANGUAGE sql VOLATILE
                AS $$ SELECT current_setting('suture.now')::bigint $$;
            CREATE OR REPLACE FUNCTION suture_up_since() RETURNS bigint LANGUAGE sql STABLE AS $$ SELECT 0::bigint $$";
        sqlx::raw_sql(clock).execute(&mut *connection).await?;
    }
    let mut transaction = connection.begin().await?;
    let lease = i64::try_from(shared.lease.as_millis()).unwrap_or(i64::MAX / 4);
    super::submit::head(&mut transaction).await?;
    sqlx::query("UPDATE lives SET is_over = true WHERE daemon = $1").bind(&shared.daemon).execute(&mut *transaction).await?;
    // What they held is void at once; whoever does not come to recover it leaves it to others.
    let void = "UPDATE jobs SET token = NULL, lease_until = suture_now() + $2 WHERE epoch IN (SELECT epoch FROM lives WHERE daemon = $1)";
    sqlx::query(void).bind(&shared.daemon).bind(lease).execute(&mut *transaction).await?;
    let old = "DELETE FROM lives l WHERE is_over AND NOT EXISTS (SELECT 1 FROM jobs j WHERE j.epoch = l.epoch)";
    sqlx::query(old).execute(&mut *transaction).await?;
    let new = "INSERT INTO lives (daemon, began) VALUES ($1, suture_now()) RETURNING epoch";
    let epoch: i64 = sqlx::query(new).bind(&shared.daemon).fetch_one(&mut *transaction).await?.try_get("epoch")?;
    transaction.commit().await?;
    Ok(Epoch(number(epoch)))
}
