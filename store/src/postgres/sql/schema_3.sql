-- Version 3: a claim and its steps cost less. Daemons of version 2 that run while it comes go on beside it.

-- A step of a holder leaves all columns as they are that an index looks at, so that it writes no index (a "HOT" update): of a job that is held, `kind` may
-- say 'running' alone, and `stage` its exact kind where that is another one. Leases end seldom; whoever looks for that goes over all that are held.
ALTER TABLE jobs ADD COLUMN stage text;
CREATE FUNCTION suture_kind(exact text) RETURNS text LANGUAGE sql IMMUTABLE
    AS $$ SELECT CASE WHEN exact IN ('concluded', 'publishing', 'published') THEN 'running' ELSE exact END $$;
CREATE FUNCTION suture_stage(exact text) RETURNS text LANGUAGE sql IMMUTABLE
    AS $$ SELECT CASE WHEN exact IN ('concluded', 'publishing', 'published') THEN exact END $$;
UPDATE jobs SET stage = suture_stage(kind), kind = suture_kind(kind) WHERE epoch IS NOT NULL;
DROP INDEX jobs_held;

-- Jobs that are searched apart: those that must run alone, and of each sort what daemons call large unless they are told otherwise (64 MiB).
CREATE FUNCTION suture_class(is_alone boolean, file_size bigint) RETURNS integer LANGUAGE sql IMMUTABLE
    AS $$ SELECT CASE WHEN is_alone THEN 2 ELSE 0 END + CASE WHEN file_size >= 67108864 THEN 1 ELSE 0 END $$;

-- Many jobs wait since the same moment; entries that are packed into one leave the index together only, and until then each claim goes over all of them.
-- `id + 0`: who asks for that order gets this index, whatever the planner takes for a fact; the table's own order leads over all that is at rest.
DROP INDEX jobs_ready_by_age;
DROP INDEX jobs_ready_by_id;
CREATE INDEX jobs_ready_by_age ON jobs (suture_class(alone, size), priority, folder, since)
    WITH (deduplicate_items = off) WHERE kind IN ('queued', 'queued_alone');
CREATE INDEX jobs_ready_by_id ON jobs (folder, suture_class(alone, size), priority, (id + 0)) WHERE kind IN ('queued', 'queued_alone');

-- As in version 2, along these indexes.
CREATE OR REPLACE FUNCTION suture_oldest_of(of_folder text, is_alone boolean, least_size bigint, most_size bigint)
RETURNS TABLE (base smallint, is_large boolean, waits_since bigint) LANGUAGE sql STABLE AS $$
    SELECT p.base, c.is_large, o.since
    FROM (SELECT g::smallint AS base FROM generate_series(0, 9) g) p
    CROSS JOIN (VALUES (false), (true)) c (is_large)
    CROSS JOIN LATERAL (
        SELECT j.since FROM jobs j
        WHERE j.kind IN ('queued', 'queued_alone')
            AND suture_class(j.alone, j.size) = CASE WHEN is_alone THEN 2 ELSE 0 END + CASE WHEN c.is_large THEN 1 ELSE 0 END
            AND j.priority = p.base AND j.folder = of_folder AND j.size BETWEEN least_size AND most_size
        ORDER BY j.since LIMIT 1
    ) o
    WHERE CASE WHEN c.is_large THEN most_size >= 67108864 ELSE least_size < 67108864 END
$$;

-- The names of all folders of which a job may be claimed or waits for the end of its pause, as in version 2, but from the other end: there wait those that came
-- last, while entries of those that were claimed since the last VACUUM are at the beginning.
CREATE OR REPLACE FUNCTION suture_folders() RETURNS TABLE (name text) LANGUAGE sql STABLE AS $$
    WITH RECURSIVE
    ready AS (
        (SELECT folder FROM jobs WHERE kind IN ('queued', 'queued_alone') ORDER BY folder DESC LIMIT 1)
        UNION ALL
        SELECT (SELECT j.folder FROM jobs j WHERE j.kind IN ('queued', 'queued_alone') AND j.folder < r.folder ORDER BY j.folder DESC LIMIT 1)
        FROM ready r WHERE r.folder IS NOT NULL
    )
    SELECT folder FROM ready WHERE folder IS NOT NULL
    UNION
    SELECT folder FROM jobs WHERE kind = 'waiting' AND not_before IS NOT NULL
$$;

-- What may be claimed of the folders in `names`, by pairs of `classes` and `bases` (priorities): how many steps of priority the oldest has risen by its wait (one
-- takes 1,800,000 ms), what it counts as by that, when the folder's turn begins, and the lowest number of those that have risen as far. `named` folders
-- have turns of these lengths, all others the `usual` one.
CREATE FUNCTION suture_heads(
    at bigint, names text[], classes integer[], bases smallint[], least_size bigint, most_size bigint,
    named text[], lengths bigint[], usual bigint
) RETURNS TABLE (name text, class integer, base smallint, steps bigint, rank bigint, turn bigint, first bigint) LANGUAGE sql STABLE AS $$
    SELECT f.name, p.class, p.base, k.steps, p.base + k.steps,
        greatest(
            (SELECT j.turn FROM jobs j WHERE j.folder = f.name AND j.turn IS NOT NULL ORDER BY j.turn DESC LIMIT 1)
                + coalesce(lengths[array_position(named, f.name)], usual),
            (SELECT j.turn FROM jobs j WHERE j.turn IS NOT NULL ORDER BY j.turn DESC LIMIT 1),
            0
        ),
        CASE WHEN k.steps = 0 THEN i.id ELSE (
            SELECT j.id + 0 FROM jobs j
            WHERE j.kind IN ('queued', 'queued_alone') AND j.folder = f.name AND suture_class(j.alone, j.size) = p.class AND j.priority = p.base
                AND j.size BETWEEN least_size AND most_size AND j.since <= at - k.steps * 1800000
            ORDER BY j.id + 0 LIMIT 1
        ) END
    FROM unnest(names) f (name)
    CROSS JOIN unnest(classes, bases) p (class, base)
    CROSS JOIN LATERAL (
        SELECT j.id + 0 AS id FROM jobs j
        WHERE j.kind IN ('queued', 'queued_alone') AND j.folder = f.name AND suture_class(j.alone, j.size) = p.class AND j.priority = p.base
            AND j.size BETWEEN least_size AND most_size
        ORDER BY j.id + 0 LIMIT 1
    ) i
    CROSS JOIN LATERAL (
        -- Most have not waited for so long, and then there is nothing to go over.
        SELECT coalesce((
            SELECT least(9 - p.base, (at - j.since) / 1800000) FROM jobs j
            WHERE j.kind IN ('queued', 'queued_alone') AND suture_class(j.alone, j.size) = p.class AND j.priority = p.base
                AND j.folder = f.name AND j.size BETWEEN least_size AND most_size AND j.since <= at - 1800000
            ORDER BY j.since LIMIT 1
        ), 0) AS steps
    ) k
$$;

-- The same of jobs whose pause is over, each for itself; they have no class.
CREATE FUNCTION suture_rested_heads(
    at bigint, names text[], is_alone boolean, least_size bigint, most_size bigint, named text[], lengths bigint[], usual bigint
) RETURNS TABLE (name text, class integer, base smallint, steps bigint, rank bigint, turn bigint, first bigint) LANGUAGE sql STABLE AS $$
    SELECT j.folder, NULL::integer, r.base, k.steps, r.base + k.steps,
        greatest(
            (SELECT t.turn FROM jobs t WHERE t.folder = j.folder AND t.turn IS NOT NULL ORDER BY t.turn DESC LIMIT 1)
                + coalesce(lengths[array_position(named, j.folder)], usual),
            (SELECT t.turn FROM jobs t WHERE t.turn IS NOT NULL ORDER BY t.turn DESC LIMIT 1),
            0
        ),
        r.job
    FROM suture_rested(at, 'waiting', '{}', names) r
    JOIN jobs j ON j.id = r.job
    CROSS JOIN LATERAL (SELECT least(9 - r.base, greatest(0, at - r.waits_since) / 1800000) AS steps) k
    WHERE r.is_alone = suture_rested_heads.is_alone AND r.file_size BETWEEN least_size AND most_size
$$;

-- Claims for the life `of_epoch`, one for each of `calls` (numbers of the life's own), as if they came one after the other: parked jobs whose pause is over
-- first, then who counts as the most, whose folder's turn begins first, and who came first. Of folders that are not `shut` and are `served` (none: all there
-- are); `named` ones have turns of these lengths and at most so many jobs in work (none: any number). `lease` in ms. Where there are fewer than were asked for,
-- the last row says why: the life is over or drained, or others are about to take what there is.
CREATE FUNCTION suture_claims(
    of_epoch bigint, of_boot bigint, calls bigint[], lease bigint, least_size bigint, most_size bigint, is_alone boolean,
    shut text[], served text[], named text[], lengths bigint[], limits bigint[], usual bigint
) RETURNS TABLE (
    call bigint, job bigint, number bigint, was bytea, at bigint, is_alive boolean, is_draining boolean, is_contended boolean
) LANGUAGE plpgsql AS $$
#variable_conflict use_column
DECLARE
    time_now CONSTANT bigint := suture_now();
    has_limits CONSTANT boolean := array_length(array_remove(limits, NULL), 1) IS NOT NULL;
    has_rested boolean;
    lives_on boolean;
    drains boolean;
    others_take boolean := false;
    known text[];
    open_now text[];
    classes integer[] := '{}';
    bases smallint[] := '{}';
    least_class CONSTANT integer := suture_class(is_alone, least_size);
    class integer := suture_class(is_alone, most_size);
    base smallint := 10;
    given integer := 0;
    this bigint;
    picked bigint;
    turn_of_it bigint;
    transition bigint;
    head record;
BEGIN
    SELECT NOT l.is_over, EXISTS (SELECT 1 FROM drains d WHERE d.name IN (l.daemon, l.host)), EXISTS (SELECT 1 FROM jobs WHERE not_before IS NOT NULL)
    INTO lives_on, drains, has_rested FROM lives l WHERE l.epoch = of_epoch;
    IF lives_on IS NOT TRUE OR drains THEN
        RETURN QUERY SELECT NULL::bigint, NULL::bigint, NULL::bigint, NULL::bytea, time_now, lives_on IS TRUE, drains IS TRUE, false;
        RETURN;
    END IF;
    IF has_rested THEN
        has_rested := EXISTS (SELECT 1 FROM suture_rested(time_now, 'waiting', shut, served))
            OR EXISTS (SELECT 1 FROM suture_rested(time_now, 'parked', shut, served));
    END IF;
    IF served IS NULL THEN
        known := ARRAY (SELECT f.name FROM suture_folders() f WHERE f.name <> ALL (shut));
    ELSIF cardinality(shut) > 0 THEN
        known := ARRAY (SELECT k FROM unnest(served) k WHERE k <> ALL (shut));
    ELSE
        known := served;
    END IF;
    -- All classes and priorities that there are; each time the highest that is left, for the same reason as in `suture_folders`.
    LOOP
        SELECT suture_class(j.alone, j.size), j.priority INTO class, base FROM jobs j
        WHERE j.kind IN ('queued', 'queued_alone') AND suture_class(j.alone, j.size) >= least_class
            AND (suture_class(j.alone, j.size), j.priority) < (class, base)
        ORDER BY suture_class(j.alone, j.size) DESC, j.priority DESC LIMIT 1;
        EXIT WHEN NOT FOUND;
        classes := classes || class;
        bases := bases || base;
    END LOOP;
    FOREACH this IN ARRAY calls LOOP
        picked := NULL;
        open_now := known;
        IF has_limits THEN
            open_now := ARRAY (
                SELECT k FROM unnest(known) k CROSS JOIN LATERAL (SELECT limits[array_position(named, k)] AS most) l
                WHERE l.most IS NULL OR (SELECT count(*) FROM jobs j WHERE j.epoch IS NOT NULL AND j.folder = k) < l.most
            );
        END IF;
        IF has_rested THEN
            SELECT j.id, j.turn INTO picked, turn_of_it FROM suture_rested(time_now, 'parked', shut, served) r JOIN jobs j ON j.id = r.job
            WHERE j.kind = 'parked' ORDER BY r.ended, r.job LIMIT 1 FOR UPDATE OF j SKIP LOCKED;
        END IF;
        FOR tried IN 0 .. 63 LOOP
            EXIT WHEN picked IS NOT NULL;
            IF has_rested THEN
                SELECT * INTO head FROM (
                    SELECT * FROM suture_heads(time_now, open_now, classes, bases, least_size, most_size, named, lengths, usual)
                    UNION ALL
                    SELECT * FROM suture_rested_heads(time_now, open_now, is_alone, least_size, most_size, named, lengths, usual)
                ) h ORDER BY h.rank DESC, h.turn, h.first LIMIT 1 OFFSET tried;
            ELSE
                SELECT * INTO head
                FROM suture_heads(time_now, open_now, classes, bases, least_size, most_size, named, lengths, usual) h
                ORDER BY h.rank DESC, h.turn, h.first LIMIT 1 OFFSET tried;
            END IF;
            EXIT WHEN NOT FOUND;
            IF head.class IS NULL THEN
                SELECT j.id INTO picked FROM jobs j WHERE j.id = head.first AND j.kind = 'waiting' FOR UPDATE SKIP LOCKED;
            ELSE
                SELECT j.id INTO picked FROM jobs j
                WHERE j.kind IN ('queued', 'queued_alone') AND j.folder = head.name AND suture_class(j.alone, j.size) = head.class
                    AND j.priority = head.base AND j.size BETWEEN least_size AND most_size
                    AND (head.steps = 0 OR j.since <= time_now - head.steps * 1800000) AND j.id + 0 >= head.first
                ORDER BY j.id + 0 LIMIT 1 FOR UPDATE SKIP LOCKED;
            END IF;
            turn_of_it := head.turn;
            others_take := others_take OR picked IS NULL;
        END LOOP;
        EXIT WHEN picked IS NULL;
        transition := nextval('transitions');
        RETURN QUERY
        UPDATE jobs j
        SET seq = transition, token = transition, epoch = of_epoch, lease_until = time_now + lease,
            kind = suture_kind(j.kind_claimed), stage = suture_stage(j.kind_claimed), not_before = NULL, turn = turn_of_it,
            claim_token = transition, claim_boot = of_boot, claim_at = time_now, claim_call = this
        WHERE j.id = picked
        RETURNING this, j.id, j.seq, j.record, time_now, true, false, false;
        given := given + 1;
    END LOOP;
    IF given < cardinality(calls) THEN
        RETURN QUERY SELECT NULL::bigint, NULL::bigint, NULL::bigint, NULL::bytea, time_now, true, false, others_take;
    END IF;
END $$;

-- As in version 1, which says what it takes and gives.
CREATE OR REPLACE FUNCTION suture_write(
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
    UPDATE jobs SET seq = nextval('transitions'), record = new_record, kind = suture_kind(new_kind), stage = suture_stage(new_kind),
        kind_claimed = new_kind_claimed, priority = new_priority, since = new_since, not_before = new_not_before, alone = new_alone,
        cancel = new_cancel, recipe = new_recipe, epoch = new_epoch, token = new_token,
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

-- Steps of holders, each for itself, in the order of their jobs: which of them were made, counted from 1, the numbers of their transitions, and the time. `tokens`
-- are those that are needed, `leases` in ms. `counted`: the time that each was made with, where it was not asked of the database just before: then it must be
-- the time that it is, but for a second. `ended` as in `suture_write`.
CREATE FUNCTION suture_steps(
    ids bigint[], seqs bigint[], tokens bigint[], records bytea[], kinds text[], kinds_claimed text[], priorities smallint[], sinces bigint[],
    not_befores bigint[], alones boolean[], cancels boolean[], recipes bigint[], epochs bigint[], new_tokens bigint[], leases bigint[],
    fresh boolean[], ended bytea[], counted bigint[]
) RETURNS TABLE (place bigint, number bigint, at bigint) LANGUAGE plpgsql AS $$
#variable_conflict use_column
BEGIN
    IF array_length(array_remove(suture_steps.ended, NULL), 1) IS NOT NULL THEN
        PERFORM pg_advisory_xact_lock_shared(1400206453, hashtext(current_schema() || '/outbox'));
    END IF;
    RETURN QUERY
    WITH made AS (
        UPDATE jobs j SET seq = nextval('transitions'), record = w.record, kind = suture_kind(w.kind), stage = suture_stage(w.kind),
            kind_claimed = w.kind_claimed, priority = w.priority, since = w.since, not_before = w.not_before, alone = w.alone,
            cancel = w.cancel, recipe = w.recipe, epoch = w.epoch, token = w.token,
            lease_until = CASE WHEN w.epoch IS NOT NULL THEN suture_now() + w.lease END,
            fresh_key = CASE WHEN w.is_fresh THEN j.fresh_key END,
            claim_token = NULL, claim_boot = NULL, claim_at = NULL, claim_call = NULL
        FROM unnest(
            ids, seqs, tokens, records, kinds, kinds_claimed, priorities, sinces, not_befores, alones, cancels, recipes, epochs, new_tokens, leases,
            fresh, suture_steps.ended, suture_steps.counted
        ) WITH ORDINALITY w (
            id, seq, needed, record, kind, kind_claimed, priority, since, not_before, alone, cancel, recipe, epoch, token, lease,
            is_fresh, ended, counted, place
        )
        WHERE j.id = w.id AND j.seq = w.seq AND j.token = w.needed AND (w.counted IS NULL OR abs(suture_now() - w.counted) <= 1000)
        RETURNING w.place, j.seq, j.id, j.folder, w.ended
    ), told AS (
        INSERT INTO outbox (seq, job, folder, record)
        SELECT m.seq, m.id, m.folder, m.ended FROM made m WHERE m.ended IS NOT NULL AND EXISTS (SELECT 1 FROM subscribers)
    )
    SELECT m.place, m.seq, suture_now() FROM made m;
END $$;
