-- Version 2: hosts, and what each does; turns of folders. Daemons of version 1 that run while it comes go on beside it.

-- As each tells of itself. `alone`: hot folders that no other daemon may serve; none: all that it serves. `teller`: whoever tells of ends and news in
-- its place; daemons with the same one take turns.
ALTER TABLE lives
    ADD COLUMN alone text[],
    ADD COLUMN teller text,
    ADD COLUMN host text,
    ADD COLUMN pid bigint,
    ADD COLUMN version text,
    ADD COLUMN roles text[],
    ADD COLUMN workers bigint,
    ADD COLUMN memory bigint,
    ADD COLUMN largest bigint;

-- The hot folders that a teller tells of, so that whoever tells of them next knows what is left.
ALTER TABLE daemons ADD COLUMN folders text[];
UPDATE daemons d SET folders = (SELECT l.folders FROM lives l WHERE l.daemon = d.daemon ORDER BY l.epoch DESC LIMIT 1);

-- Hosts and daemons, by name, that are to claim nothing.
CREATE TABLE drains (
    name text PRIMARY KEY,
    since bigint NOT NULL
);

-- Whoever may use the tables of before may use this one, so that an update needs the owner once.
DO $$
DECLARE
    role text;
BEGIN
    FOR role IN
        SELECT DISTINCT grantee FROM information_schema.role_table_grants
        WHERE table_schema = current_schema() AND table_name = 'lives' AND privilege_type = 'UPDATE' AND grantee NOT IN (current_user, 'PUBLIC')
    LOOP
        EXECUTE format('GRANT SELECT, INSERT, UPDATE, DELETE ON drains TO %I', role);
    END LOOP;
END $$;

-- Is the daemon of that life to claim nothing?
CREATE FUNCTION suture_drains(of_epoch bigint) RETURNS boolean LANGUAGE sql STABLE
    AS $$ SELECT EXISTS (SELECT 1 FROM lives l JOIN drains d ON d.name IN (l.daemon, l.host) WHERE l.epoch = of_epoch) $$;

-- Does that life tell of ends and news? Of those with the same teller that are alive, the one that began first does. `lease` in ms.
CREATE FUNCTION suture_tells(of_epoch bigint, lease bigint) RETURNS boolean LANGUAGE sql STABLE AS $$
    SELECT NOT EXISTS (
        SELECT 1 FROM lives me JOIN lives l ON l.teller = me.teller AND l.epoch < me.epoch
        WHERE me.epoch = of_epoch AND NOT l.is_over AND greatest(l.seen, suture_up_since()) + lease > suture_now()
    )
$$;

-- When the turn of its folder began in which it was claimed last.
ALTER TABLE jobs ADD COLUMN turn bigint;
CREATE INDEX jobs_turns ON jobs (turn) WHERE turn IS NOT NULL;
CREATE INDEX jobs_turns_of_folder ON jobs (folder, turn) WHERE turn IS NOT NULL;

-- Each folder is searched by itself, and what daemons call large unless they are told otherwise (64 MiB) apart from the rest: a look for large files
-- does not go over all small ones.
DROP INDEX jobs_ready_by_age;
DROP INDEX jobs_ready_by_id;
CREATE INDEX jobs_ready_by_age ON jobs (folder, alone, (size >= 67108864), priority, since) WHERE kind IN ('queued', 'queued_alone');
CREATE INDEX jobs_ready_by_id ON jobs (folder, alone, (size >= 67108864), priority, id) WHERE kind IN ('queued', 'queued_alone');

-- The names of all folders of which a job may be claimed or waits for the end of its pause: one look at the index for each.
CREATE FUNCTION suture_folders() RETURNS TABLE (name text) LANGUAGE sql STABLE AS $$
    WITH RECURSIVE
    ready AS (
        (SELECT folder FROM jobs WHERE kind IN ('queued', 'queued_alone') ORDER BY folder LIMIT 1)
        UNION ALL
        SELECT (SELECT j.folder FROM jobs j WHERE j.kind IN ('queued', 'queued_alone') AND j.folder > r.folder ORDER BY j.folder LIMIT 1)
        FROM ready r WHERE r.folder IS NOT NULL
    )
    SELECT folder FROM ready WHERE folder IS NOT NULL
    UNION
    SELECT folder FROM jobs WHERE kind = 'waiting' AND not_before IS NOT NULL
$$;

-- Folders of which a job may be claimed, of those that are not `shut` and are `served` (none: all there are), and when the next turn of each begins.
-- `named` have turns of these lengths and at most so many jobs in work (none: any number); all others have the `usual` length.
CREATE FUNCTION suture_turns(shut text[], served text[], named text[], lengths bigint[], limits bigint[], usual bigint)
RETURNS TABLE (name text, turn bigint) LANGUAGE sql STABLE AS $$
    SELECT f.name, greatest(coalesce(b.began + coalesce(s.length, usual), 0), coalesce(l.latest, 0))
    FROM (
        SELECT DISTINCT u.name FROM unnest(served) u (name) WHERE served IS NOT NULL
        UNION ALL
        SELECT a.name FROM suture_folders() a WHERE served IS NULL
    ) f
    LEFT JOIN unnest(named, lengths, limits) s (name, length, most) ON s.name = f.name
    CROSS JOIN (SELECT (SELECT j.turn FROM jobs j WHERE j.turn IS NOT NULL ORDER BY j.turn DESC LIMIT 1) AS latest) l
    CROSS JOIN LATERAL (
        SELECT (SELECT j.turn FROM jobs j WHERE j.folder = f.name AND j.turn IS NOT NULL ORDER BY j.turn DESC LIMIT 1) AS began
    ) b
    WHERE f.name <> ALL (shut)
        AND (s.most IS NULL OR (SELECT count(*) FROM jobs j WHERE j.epoch IS NOT NULL AND j.folder = f.name) < s.most)
$$;

-- Of one folder the oldest of each priority, of the large ones and of the others, since when it waits.
CREATE FUNCTION suture_oldest_of(of_folder text, is_alone boolean, least_size bigint, most_size bigint)
RETURNS TABLE (base smallint, is_large boolean, waits_since bigint) LANGUAGE sql STABLE AS $$
    SELECT p.base, c.is_large, o.since
    FROM (SELECT g::smallint AS base FROM generate_series(0, 9) g) p
    CROSS JOIN (VALUES (false), (true)) c (is_large)
    CROSS JOIN LATERAL (
        SELECT j.since FROM jobs j
        WHERE j.kind IN ('queued', 'queued_alone') AND j.folder = of_folder AND j.alone = is_alone AND (j.size >= 67108864) = c.is_large
            AND j.priority = p.base AND j.size BETWEEN least_size AND most_size
        ORDER BY j.since LIMIT 1
    ) o
    WHERE CASE WHEN c.is_large THEN most_size >= 67108864 ELSE least_size < 67108864 END
$$;
