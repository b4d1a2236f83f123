-- Version 1 of the shared store. Every name is looked up in the schema of the store alone (search_path).

-- The only clock of the store: milliseconds since 1970, as the database's machine counts them. Tests put another body here.
CREATE FUNCTION suture_now() RETURNS bigint LANGUAGE sql VOLATILE
    AS $$ SELECT (extract(epoch FROM clock_timestamp()) * 1000)::bigint $$;

-- Numbers of transitions; a claim's token is the number of its transition.
CREATE SEQUENCE transitions;

-- What there is one of. Its row orders submissions, so that job numbers have no gaps. `unfilled` and `night` are what a new daemon begins with.
CREATE TABLE head (
    one boolean PRIMARY KEY DEFAULT true CHECK (one),
    last_job bigint NOT NULL,
    unfilled boolean NOT NULL,
    night bigint
);
INSERT INTO head (last_job, unfilled) VALUES (0, true);

-- Lives of daemons. A daemon of the same name that begins ends the lives before.
CREATE TABLE lives (
    epoch bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    daemon text NOT NULL,
    -- The hot folders that it serves, by name; none: all there are.
    folders text[],
    began bigint NOT NULL,
    -- Its last sign of life.
    seen bigint NOT NULL,
    is_over boolean NOT NULL DEFAULT false
);

-- What each daemon knows of itself: whether it has yet to read what earlier stores left in its folders, and the end of the last night it told of.
CREATE TABLE daemons (
    daemon text PRIMARY KEY,
    unfilled boolean NOT NULL,
    night bigint
);

CREATE TABLE jobs (
    id bigint PRIMARY KEY,
    -- Number of the last transition.
    seq bigint NOT NULL,
    -- The job as it was written last; a claim since then stands in the claim_ columns alone.
    record bytea NOT NULL,
    kind text NOT NULL,
    -- The kind that a claim makes of it.
    kind_claimed text,
    folder text NOT NULL,
    size bigint NOT NULL,
    priority smallint NOT NULL,
    -- Since when it waits, for ageing.
    since bigint NOT NULL,
    -- End of the pause of a job that waits or is parked.
    not_before bigint,
    alone boolean NOT NULL,
    cancel boolean NOT NULL,
    -- Digest of what makes the file that file.
    file_key bytea,
    -- The same, from submission until it rests or moves for the first time.
    fresh_key bytea,
    recipe bigint,
    -- The claim that holds it: the life, the token that fences it (none once that life is over), and the end of its lease.
    epoch bigint,
    token bigint,
    lease_until bigint,
    -- A claim that the record does not know yet, and the call that made it.
    claim_token bigint,
    claim_boot bigint,
    claim_at bigint,
    claim_call bigint
) WITH (fillfactor = 80, autovacuum_vacuum_scale_factor = 0.02, autovacuum_analyze_scale_factor = 0.05);

CREATE UNIQUE INDEX jobs_fresh ON jobs (fresh_key) WHERE fresh_key IS NOT NULL;
CREATE INDEX jobs_file ON jobs (file_key, id) WHERE file_key IS NOT NULL;
CREATE INDEX jobs_kind ON jobs (kind, id);
CREATE INDEX jobs_ready_by_age ON jobs (alone, priority, since) WHERE kind IN ('queued', 'queued_alone');
CREATE INDEX jobs_ready_by_id ON jobs (alone, priority, id) WHERE kind IN ('queued', 'queued_alone');
CREATE INDEX jobs_paused ON jobs (kind, not_before, id) WHERE not_before IS NOT NULL;
CREATE INDEX jobs_held ON jobs (lease_until) WHERE epoch IS NOT NULL;
CREATE INDEX jobs_holder ON jobs (epoch) WHERE epoch IS NOT NULL;
CREATE INDEX jobs_results ON jobs (size, recipe, id) WHERE recipe IS NOT NULL;

-- Whom each daemon tells of ends and news, and the last transition that each of these has heard of.
CREATE TABLE subscribers (
    daemon text NOT NULL,
    name text NOT NULL,
    heard bigint NOT NULL,
    PRIMARY KEY (daemon, name)
);

CREATE TABLE outbox (
    seq bigint PRIMARY KEY,
    -- The job that ended; none: news of the service.
    job bigint,
    -- The hot folder that it is about, or the daemon; where neither is known, everyone tells of it.
    folder text,
    daemon text,
    record bytea NOT NULL
);

-- Folders that are out of reach, and since when that is told.
CREATE TABLE away (
    folder text PRIMARY KEY,
    since bigint NOT NULL
);

-- Since when the database runs: leases that ended while it did not run are given one more lease.
CREATE FUNCTION suture_up_since() RETURNS bigint LANGUAGE sql STABLE
    AS $$ SELECT (extract(epoch FROM pg_postmaster_start_time()) * 1000)::bigint $$;

-- Wakes daemons that have nothing to do, once this transaction is durable.
CREATE FUNCTION suture_news() RETURNS void LANGUAGE sql VOLATILE AS $$ SELECT pg_notify(current_schema() || '_news', '') $$;

-- What may be claimed, for claims and for questions of what waits, of folders that are not `shut` and are `served` (none: all there are). Each is
-- one query that the planner puts into the statement that asks. First the oldest of each priority, since when it waits.
CREATE FUNCTION suture_oldest(is_alone boolean, least_size bigint, most_size bigint, shut text[], served text[])
RETURNS TABLE (base smallint, waits_since bigint) LANGUAGE sql STABLE AS $$
    SELECT p.base, o.since
    FROM (SELECT g::smallint AS base FROM generate_series(0, 9) g) p
    CROSS JOIN LATERAL (
        SELECT j.since FROM jobs j
        WHERE j.kind IN ('queued', 'queued_alone') AND j.alone = is_alone AND j.priority = p.base
            AND j.size BETWEEN least_size AND most_size AND j.folder <> ALL (shut) AND (served IS NULL OR j.folder = ANY (served))
        ORDER BY j.since LIMIT 1
    ) o
$$;

-- Jobs whose pause is over, as their kind is. A pause that ends later than 1,800,000 ms from now was set by a clock that jumped.
CREATE FUNCTION suture_rested(at bigint, of_kind text, shut text[], served text[])
RETURNS TABLE (job bigint, base smallint, waits_since bigint, ended bigint, file_size bigint, is_alone boolean) LANGUAGE sql STABLE AS $$
    (SELECT j.id, j.priority, j.since, j.not_before, j.size, j.alone FROM jobs j
    WHERE j.kind = of_kind AND j.not_before IS NOT NULL AND j.not_before <= at
        AND j.folder <> ALL (shut) AND (served IS NULL OR j.folder = ANY (served))
    ORDER BY j.not_before, j.id)
    UNION ALL
    (SELECT j.id, j.priority, j.since, j.not_before, j.size, j.alone FROM jobs j
    WHERE j.kind = of_kind AND j.not_before IS NOT NULL AND j.not_before > at + 1800000
        AND j.folder <> ALL (shut) AND (served IS NULL OR j.folder = ANY (served))
    ORDER BY j.not_before, j.id)
$$;

-- Compare and set, all in one call; the number of the new transition, or none. `seq_read` is the transition that was read, `needed` the
-- token that is needed, if one is, `lease` in ms; none: it stays as it is. `ended`: the entry for subscribers of a job that ends by this.
CREATE FUNCTION suture_write(
    job_id bigint, seq_read bigint, needed bigint, new_record bytea, new_kind text, new_kind_claimed text, new_priority smallint,
    new_since bigint, new_not_before bigint, new_alone boolean, new_cancel boolean, new_recipe bigint, new_epoch bigint,
    new_token bigint, lease bigint, is_fresh boolean, ended bytea
) RETURNS bigint LANGUAGE plpgsql AS $$
DECLARE
    number bigint;
    about text;
BEGIN
    -- Numbers appear in the outbox in another order than they are given; see `outbox.rs`.
    IF ended IS NOT NULL THEN
        PERFORM pg_advisory_xact_lock_shared(1400206453, hashtext(current_schema() || '/outbox'));
    END IF;
    UPDATE jobs SET seq = nextval('transitions'), record = new_record, kind = new_kind, kind_claimed = new_kind_claimed,
        priority = new_priority, since = new_since, not_before = new_not_before, alone = new_alone, cancel = new_cancel,
        recipe = new_recipe, epoch = new_epoch, token = new_token,
        lease_until = CASE WHEN new_epoch IS NULL THEN NULL WHEN lease IS NULL THEN lease_until ELSE suture_now() + lease END,
        fresh_key = CASE WHEN is_fresh THEN fresh_key END,
        claim_token = NULL, claim_boot = NULL, claim_at = NULL, claim_call = NULL
    WHERE id = job_id AND seq = seq_read AND (needed IS NULL OR token = needed)
    RETURNING seq, folder INTO number, about;
    IF number IS NOT NULL AND ended IS NOT NULL THEN
        INSERT INTO outbox (seq, job, folder, record) SELECT number, job_id, about, ended WHERE EXISTS (SELECT 1 FROM subscribers);
    END IF;
    -- Whoever has no claim may have made work for another daemon. Steps of holders wake no one: each would wait for all others at its end.
    IF number IS NOT NULL AND needed IS NULL AND new_kind_claimed IS NOT NULL THEN
        PERFORM suture_news();
    END IF;
    RETURN number;
END $$;
