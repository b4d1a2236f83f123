//! What is asked of jobs, and changes nothing.

use sqlx::Row;
use sqlx::postgres::{PgConnection, PgRow};

use super::database::Failure;
use super::row::{Stored, file_key, int, number};
use crate::id::{JobId, Recipe};
use crate::job::{Job, Kind, Source};
use crate::store::{Look, MOST_RESULTS, PAGE_READS, Page, Query};

fn jobs(rows: &[PgRow]) -> Result<Vec<Job>, Failure> {
    rows.iter().map(|row| Stored::read(row).map(|stored| stored.job)).collect()
}

/// None are all.
fn names(kinds: &[Kind]) -> Vec<&'static str> {
    let kinds = if kinds.is_empty() { &Kind::ALL } else { kinds };
    kinds.iter().map(|kind| kind.name()).collect()
}

/// The words that the column `kind` may have for them; `stage` says more of those that are held.
fn kept(kinds: &[Kind]) -> Vec<&'static str> {
    let mut names = names(kinds);
    if kinds.iter().any(|kind| kind.is_held()) {
        names.push(Kind::Running.name());
    }
    names
}

fn limit(most: usize) -> i64 {
    i64::try_from(most).unwrap_or(i64::MAX)
}

/// As [`crate::JobStore::get`].
pub(super) async fn get(connection: &mut PgConnection, id: JobId) -> Result<Option<Job>, Failure> {
    let sql = "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at FROM jobs WHERE id = $1";
    let row = sqlx::query(sql).bind(int(id.0)).fetch_optional(connection).await?;
    row.map(|row| Stored::read(&row).map(|stored| stored.job)).transpose()
}

/// Hot folders whose jobs are asked for; `None`: of all.
type Served<'a> = Option<&'a [String]>;

/// As [`crate::JobStore::list`].
pub(super) async fn list(connection: &mut PgConnection, served: Served<'_>, query: &Query) -> Result<Vec<Job>, Failure> {
    let most = if query.limit == 0 { usize::MAX } else { query.limit };
    let sql = "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at FROM jobs
        WHERE id > $1 AND kind = ANY ($2) AND coalesce(stage, kind) = ANY ($5) AND ($4::text[] IS NULL OR folder = ANY ($4))
        ORDER BY id LIMIT $3";
    let rows = sqlx::query(sql)
        .bind(int(query.after.0))
        .bind(kept(&query.kinds))
        .bind(limit(most))
        .bind(served)
        .bind(names(&query.kinds));
    jobs(&rows.fetch_all(connection).await?)
}

/// As [`crate::JobStore::page`]. Of jobs of other folders only the numbers are read.
pub(super) async fn page(connection: &mut PgConnection, served: Served<'_>, look: &Look) -> Result<Page, Failure> {
    let mut page = Page::default();
    if look.limit == 0 {
        return Ok(page);
    }
    let most = if look.folder.is_some() || served.is_some() { PAGE_READS } else { look.limit.min(PAGE_READS) };
    let sql = "WITH seen AS MATERIALIZED (
            SELECT id, ($3::text IS NULL OR folder = $3) AND ($6::text[] IS NULL OR folder = ANY ($6)) AS fits
            FROM jobs WHERE id < $1 AND kind = ANY ($2) AND coalesce(stage, kind) = ANY ($7) ORDER BY id DESC LIMIT $4
        ), wanted AS MATERIALIZED (SELECT id FROM seen WHERE fits ORDER BY id DESC LIMIT $5)
        SELECT s.id AS number, j.id, j.seq, j.record, j.epoch, j.token, j.claim_token, j.claim_boot, j.claim_at
        FROM seen s LEFT JOIN wanted w ON w.id = s.id LEFT JOIN jobs j ON j.id = w.id ORDER BY s.id DESC";
    let rows = sqlx::query(sql)
        .bind(look.before.map_or(i64::MAX, |before| int(before.0)))
        .bind(kept(&look.kinds))
        .bind(&look.folder)
        .bind(limit(most))
        .bind(limit(look.limit))
        .bind(served)
        .bind(names(&look.kinds))
        .fetch_all(connection)
        .await?;
    for (read, row) in rows.iter().enumerate() {
        let id = JobId(number(row.try_get("number")?));
        if row.try_get::<Option<i64>, _>("id")?.is_some() {
            page.jobs.push(Stored::read(row)?.job);
        }
        // As far as was looked; there may be more before.
        page.next = (rows.len() == most).then_some(id);
        if page.jobs.len() == look.limit || read + 1 == PAGE_READS {
            page.next = Some(id);
            break;
        }
    }
    Ok(page)
}

/// As [`crate::JobStore::find`].
pub(super) async fn find(connection: &mut PgConnection, source: &Source) -> Result<Option<JobId>, Failure> {
    let Some(key) = file_key(source) else { return Ok(None) };
    let sql = "SELECT id FROM jobs WHERE file_key = $1 ORDER BY id DESC LIMIT 1";
    let row = sqlx::query(sql).bind(&key[..]).fetch_optional(connection).await?;
    Ok(row.map(|row| row.try_get("id")).transpose()?.map(|id: i64| JobId(number(id))))
}

/// As [`crate::JobStore::results`].
pub(super) async fn results(
    connection: &mut PgConnection,
    served: Served<'_>,
    size: u64,
    recipe: Option<Recipe>,
) -> Result<Vec<Job>, Failure> {
    let sql = "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at FROM jobs
        WHERE size = $1 AND recipe IS NOT NULL AND ($2::bigint IS NULL OR recipe = $2) AND ($4::text[] IS NULL OR folder = ANY ($4)) ORDER BY id DESC LIMIT $3";
    let most = if recipe.is_some() { MOST_RESULTS } else { 1 };
    let recipe = recipe.map(|recipe| recipe.0.cast_signed());
    jobs(&sqlx::query(sql).bind(int(size)).bind(recipe).bind(limit(most)).bind(served).fetch_all(connection).await?)
}

/// As [`crate::JobStore::counts`].
pub(super) async fn counts(connection: &mut PgConnection, served: Served<'_>) -> Result<Vec<(Kind, u64)>, Failure> {
    let sql = "SELECT coalesce(stage, kind) AS kind, count(*) AS count FROM jobs WHERE $1::text[] IS NULL OR folder = ANY ($1) GROUP BY 1";
    let rows = sqlx::query(sql).bind(served).fetch_all(connection).await?;
    let mut counts = Kind::ALL.map(|kind| (kind, 0)).to_vec();
    for row in rows {
        let name: String = row.try_get("kind")?;
        let count = number(row.try_get("count")?);
        counts.iter_mut().filter(|(kind, _)| kind.name() == name).for_each(|(_, total)| *total = count);
    }
    Ok(counts)
}
