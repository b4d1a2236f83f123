//! Where the shared store is, and how a life of a daemon begins on it.

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use sha2::{Digest, Sha256};
use sqlx::postgres::{PgConnectOptions, PgConnection};
use sqlx::{Connection, Row};
use tokio::runtime::{Builder, Runtime};

use super::claim::Life;
use super::database::{Again, Database, Failure, wait};
use super::hosts::see;
use super::leases::{Claims, keep_leases};
use super::marks::{Heir, begin_marks, succeed};
use super::migrate::{is_current, is_plain, migrate};
use super::row::number;
use crate::address::Address;
use crate::host::Station;
use crate::id::{Clock, Epoch, SystemClock};
use crate::patience::is_brief;
use crate::role::Role;
use crate::store::StoreError;

/// A database that many daemons share, and who this one is.
#[derive(Clone)]
pub struct Shared {
    /// `postgres://user@host/database`, with what its address may say of TLS (`sslmode=verify-full`, `sslrootcert=…`). The database itself, or a
    /// pooler that gives whole sessions: statements are prepared.
    pub url: String,
    /// The store's own schema: small letters, digits and `_`, at most 48 of them.
    pub schema: String,
    /// The name of this daemon, of which there is one at a time: a life that begins under it ends those before.
    pub daemon: String,
    /// The hot folders that it serves, by name, of which no other daemon serves one; the store then knows jobs of these alone, but for one that is
    /// asked for by its number. `None`: jobs of all folders.
    pub folders: Option<Vec<String>>,
    /// Those of `folders` that other daemons may serve as well.
    pub joint: BTreeSet<String>,
    /// What it tells of itself.
    pub station: Station,
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
            folders: None,
            joint: BTreeSet::new(),
            station: Station::default(),
            connections: 8,
            lease: Duration::from_secs(60),
            patience: Duration::from_secs(300),
        }
    }

    /// Where it is, for people, without a password.
    pub(super) fn place(&self) -> String {
        Address::parse(&self.url).map_or_else(|_| "the database".to_owned(), |address| address.to_string())
    }

    /// The hot folders that no one else may serve.
    fn alone(&self) -> Vec<&String> {
        self.folders.iter().flatten().filter(|folder| !self.joint.contains(*folder)).collect()
    }

    /// Who tells of its ends and news: it alone, or whoever has the same part in the same folders.
    pub(super) fn teller(&self) -> String {
        let tells = self.station.roles.has(Role::Control);
        let Some(folders) = self.folders.as_ref().filter(|folders| tells && !folders.is_empty() && self.alone().is_empty())
        else {
            return self.daemon.clone();
        };
        let mut digest = Sha256::new();
        for folder in folders.iter().collect::<BTreeSet<_>>() {
            digest.update((folder.len() as u64).to_be_bytes());
            digest.update(folder);
        }
        let name: String = digest.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
        format!("joint:{name}")
    }

    /// In ms.
    fn lease(&self) -> i64 {
        i64::try_from(self.lease.as_millis()).unwrap_or(i64::MAX / 4)
    }

    fn unusable(&self, reason: &str, advice: &str) -> StoreError {
        let path = PathBuf::from(format!("schema {} of the database", self.schema));
        StoreError::Unusable { path, reason: reason.to_owned(), advice: advice.to_owned() }
    }

    fn options(&self) -> Result<PgConnectOptions, StoreError> {
        let wrong = |error: sqlx::Error| {
            self.unusable(&format!("its address is wrong: {error}"), "write it as postgres://user@host/database")
        };
        let options = PgConnectOptions::from_str(&self.url).map_err(wrong)?;
        Ok(options.application_name("suture").options([
            ("search_path", self.schema.as_str()),
            // A daemon that is stopped in the middle of a transaction must not keep others from their rows.
            ("idle_in_transaction_session_timeout", "30s"),
            ("lock_timeout", "30s"),
            // How many rows there are is not known at first, and changes by the hour; each statement has an index that it can go along.
            ("enable_seqscan", "off"),
            ("enable_bitmapscan", "off"),
            ("enable_sort", "off"),
            ("enable_hashjoin", "off"),
            ("enable_mergejoin", "off"),
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
    pub(super) channel: String,
}

/// Who opens the store.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum As {
    /// Whoever is going to claim jobs.
    Daemon,
    /// Whoever makes the schema, and nothing else.
    Owner,
    /// Whoever looks, or says what is to become of jobs: nothing is made, and no life begins or ends.
    Visitor,
}

/// Opens the store, for a daemon with a life that begins; with a clock, that one sets the time of all that is done in the schema.
pub(super) fn begin(shared: &Shared, as_what: As, clock: Option<Arc<dyn Clock>>) -> Result<Begun, StoreError> {
    if !is_plain(&shared.schema) {
        return Err(
            shared.unusable("that is no name for a schema", "use small letters, digits and `_`, at most 48, a letter first")
        );
    }
    let machine = clock.clone().unwrap_or_else(|| Arc::new(SystemClock));
    let database = Arc::new(Database::new(shared.options()?, shared.place(), shared.connections, shared.patience, clock.clone()));
    let runtime = Builder::new_multi_thread().worker_threads(1).thread_name("job-database").enable_all().build();
    let runtime = Arc::new(runtime.map_err(failed)?);
    let epoch = wait(&runtime, async || {
        // Half-made is not made: each part sees for itself what is left to do.
        let begin = async |connection: &mut PgConnection| match as_what {
            As::Daemon => begin_life(connection, shared, clock.is_some()).await,
            As::Owner => migrate(connection, &shared.schema).await.map(|()| Epoch(0)),
            As::Visitor => must_be_there(connection, shared).await.map(|()| Epoch(0)),
        };
        database.call(Again::Yes, is_brief(), begin).await
    })?;
    let (daemon, folders, station) =
        (shared.daemon.clone(), shared.folders.clone(), Arc::new(Mutex::new(shared.station.clone())));
    // A visitor takes over what one daemon is to tell.
    let teller = if as_what == As::Daemon { shared.teller() } else { daemon.clone() };
    let life = Life { epoch, daemon, teller, station, folders, machine, lease: shared.lease() };
    if as_what == As::Daemon {
        // Whoever looks at once sees all of it.
        wait(&runtime, async || {
            database.call(Again::Yes, is_brief(), async |connection: &mut PgConnection| see(connection, &life).await).await
        })?;
    }
    let claims = Arc::new(Claims::default());
    let (end, ended) = channel();
    let keeper = (Arc::clone(&runtime), Arc::clone(&database), life.clone(), Arc::clone(&claims));
    let keep = move || keep_leases(&keeper.0, &keeper.1, &keeper.2, &keeper.3, &ended);
    std::thread::Builder::new().name("job-leases".into()).spawn(keep).map_err(failed)?;
    Ok(Begun { runtime, end, database, life, claims, channel: format!("{}_news", shared.schema) })
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
    let lease = shared.lease();
    // Whoever begins at the same time waits here, and sees this life.
    super::submit::head(&mut transaction).await?;
    must_be_alone(&mut transaction, shared).await?;
    let teller = shared.teller();
    begin_marks(&mut transaction, &teller).await?;
    if shared.station.roles.has(Role::Control) {
        let before = tellers_before(&mut transaction, shared).await?;
        let heir = Heir { daemon: &shared.daemon, teller: &teller, folders: &shared.folders, lease };
        succeed(&mut transaction, &heir, &before).await?;
    }
    sqlx::query("UPDATE lives SET is_over = true WHERE daemon = $1").bind(&shared.daemon).execute(&mut *transaction).await?;
    // What they held is void at once; whoever does not come to recover it leaves it to others.
    let void = "UPDATE jobs SET token = NULL, lease_until = suture_now() + $2 WHERE epoch IN (SELECT epoch FROM lives WHERE daemon = $1)";
    sqlx::query(void).bind(&shared.daemon).bind(lease).execute(&mut *transaction).await?;
    // One that gave no sign for a day is gone, whether it said so or not.
    let old = "DELETE FROM lives l WHERE (is_over OR greatest(seen, suture_up_since()) + 86400000 < suture_now())
        AND NOT EXISTS (SELECT 1 FROM jobs j WHERE j.epoch = l.epoch)";
    sqlx::query(old).execute(&mut *transaction).await?;
    let new = "INSERT INTO lives (daemon, folders, alone, teller, roles, began, seen) VALUES ($1, $2, $3, $4, $5, suture_now(), suture_now())
        RETURNING epoch";
    let roles: Vec<_> = shared.station.roles.each().map(Role::name).collect();
    let new = sqlx::query(new).bind(&shared.daemon).bind(&shared.folders).bind(shared.alone()).bind(&teller).bind(roles);
    let epoch: i64 = new.fetch_one(&mut *transaction).await?.try_get("epoch")?;
    transaction.commit().await?;
    Ok(Epoch(number(epoch)))
}

/// What this daemon was told by in the lives that are known, and as one that is alone.
async fn tellers_before(connection: &mut PgConnection, shared: &Shared) -> Result<Vec<String>, Failure> {
    let rows = sqlx::query("SELECT DISTINCT teller FROM lives WHERE daemon = $1 AND teller IS NOT NULL").bind(&shared.daemon);
    let rows = rows.fetch_all(connection).await?;
    let tellers = rows.iter().map(|row| Ok(row.try_get("teller")?)).chain([Ok(shared.daemon.clone())]);
    tellers.collect()
}

/// Refuses where a daemon that lives serves a folder of that name, unless both may serve it together; and where both would tell of it, but not of
/// the same folders. Who gave no sign while the database was away is not dead.
async fn must_be_alone(connection: &mut PgConnection, shared: &Shared) -> Result<(), Failure> {
    let sql = "SELECT l.daemon, f.folder, s.is_alone FROM lives l CROSS JOIN LATERAL unnest(l.folders) f (folder)
        CROSS JOIN LATERAL (SELECT l.alone IS NULL OR f.folder = ANY (l.alone) OR f.folder = ANY ($4) AS is_alone) s
        WHERE NOT l.is_over AND l.daemon <> $1 AND f.folder = ANY ($2) AND greatest(l.seen, suture_up_since()) + $3 > suture_now()
            AND (s.is_alone OR ($6 AND 'control' = ANY (l.roles) AND l.teller <> $5))
        ORDER BY s.is_alone DESC, l.epoch, f.folder LIMIT 1";
    let other = sqlx::query(sql)
        .bind(&shared.daemon)
        .bind(&shared.folders)
        .bind(shared.lease())
        .bind(shared.alone())
        .bind(shared.teller())
        .bind(shared.station.roles.has(Role::Control));
    let Some(row) = other.fetch_optional(connection).await? else { return Ok(()) };
    let (folder, by) = (row.try_get("folder")?, row.try_get("daemon")?);
    let is_alone: bool = row.try_get("is_alone")?;
    Err(if is_alone { StoreError::Served { folder, by } } else { StoreError::Told { folder, by } }.into())
}

/// Refuses where no store was made yet.
async fn must_be_there(connection: &mut PgConnection, shared: &Shared) -> Result<(), Failure> {
    if is_current(connection, &shared.schema).await? {
        return Ok(());
    }
    let advice = "the first `suture watch --store` makes it, if its user may; else the owner of the database does, see `suture store role`";
    Err(shared.unusable("there is no job store of this version", advice).into())
}
