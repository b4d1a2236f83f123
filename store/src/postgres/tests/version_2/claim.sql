-- $1 epoch, $2 boot, $3 call, $4 lease in ms, $5 least size, $6 most size, $7 alone, $8 folders that are shut, $9 folders that are served,
-- $10 to $13 what is said of their turns (`suture_turns`).
-- Connections are told to prefer indexes (`open.rs`): in a new database nothing is known of how many rows there are.
-- Each step of priority takes 1,800,000 ms of waiting.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now, l.is_alive, d.is_draining
    FROM (SELECT EXISTS (SELECT 1 FROM lives WHERE epoch = $1 AND NOT is_over) AS is_alive) l
    CROSS JOIN (SELECT EXISTS (SELECT 1 FROM lives l JOIN drains d ON d.name IN (l.daemon, l.host) WHERE l.epoch = $1) AS is_draining) d
), folders AS MATERIALIZED (
    SELECT name, turn FROM suture_turns($8, $9, $10, $11, $12, $13)
), heads AS MATERIALIZED (
    -- Of each folder and priority those that have risen the most.
    SELECT f.name, f.turn, o.base, o.is_large, k.steps, o.base + k.steps AS rank
    FROM t
    CROSS JOIN folders f
    CROSS JOIN LATERAL suture_oldest_of(f.name, $7, $5, $6) o
    CROSS JOIN LATERAL (SELECT least(9 - o.base, greatest(0, t.now - o.waits_since) / 1800000) AS steps) k
), best AS MATERIALIZED (
    -- Of those that are wanted the soonest, in the order of their folders' turns; more than one, since others may claim all of the first just now.
    SELECT h.name, h.turn, h.base, h.is_large, h.steps, h.rank
    FROM t
    CROSS JOIN (SELECT max(rank) AS rank FROM heads) m
    JOIN heads h ON h.rank = m.rank
    CROSS JOIN LATERAL (
        SELECT id FROM jobs
        WHERE kind IN ('queued', 'queued_alone') AND folder = h.name AND alone = $7 AND (size >= 67108864) = h.is_large AND priority = h.base
            AND size BETWEEN $5 AND $6 AND (h.steps = 0 OR since <= t.now - h.steps * 1800000)
        ORDER BY id LIMIT 1
    ) f
    ORDER BY h.turn, f.id LIMIT 3
), ready AS MATERIALIZED (
    -- The oldest first.
    SELECT r.id, r.kind, b.rank, b.turn
    FROM t
    CROSS JOIN best b
    CROSS JOIN LATERAL (
        SELECT id, kind FROM jobs
        WHERE kind IN ('queued', 'queued_alone') AND folder = b.name AND alone = $7 AND (size >= 67108864) = b.is_large AND priority = b.base
            AND size BETWEEN $5 AND $6 AND (b.steps = 0 OR since <= t.now - b.steps * 1800000)
        ORDER BY id LIMIT 64
    ) r
), rested AS MATERIALIZED (
    SELECT r.job AS id, 'waiting' AS kind, r.base + least(9 - r.base, greatest(0, t.now - r.waits_since) / 1800000) AS rank, f.turn
    FROM t
    CROSS JOIN LATERAL suture_rested(t.now, 'waiting', $8, $9) r
    JOIN jobs j ON j.id = r.job
    JOIN folders f ON f.name = j.folder
    WHERE r.is_alone = $7 AND r.file_size BETWEEN $5 AND $6
    ORDER BY rank DESC, f.turn, id LIMIT 64
), parked AS MATERIALIZED (
    -- Before all others, for whoever asks.
    SELECT r.job AS id, 'parked' AS kind, 10::bigint AS rank, r.ended AS turn
    FROM t CROSS JOIN LATERAL suture_rested(t.now, 'parked', $8, $9) r
    LIMIT 128
), candidates AS MATERIALIZED (
    SELECT * FROM ready UNION ALL SELECT * FROM rested UNION ALL SELECT * FROM parked
), pick AS MATERIALIZED (
    -- In their order already, so that no more rows are looked at than others hold, and one.
    SELECT j.id, CASE WHEN c.kind = 'parked' THEN j.turn ELSE c.turn END AS turn
    FROM (SELECT * FROM candidates ORDER BY rank DESC, turn, id) c JOIN jobs j ON j.id = c.id
    WHERE j.kind = c.kind AND (SELECT is_alive AND NOT is_draining FROM t)
    ORDER BY c.rank DESC, c.turn, c.id
    LIMIT 1
    FOR UPDATE OF j SKIP LOCKED
), number AS MATERIALIZED (
    SELECT id, turn, nextval('transitions') AS token FROM pick
), claimed AS (
    UPDATE jobs j
    SET seq = n.token, token = n.token, epoch = $1, lease_until = t.now + $4, kind = j.kind_claimed, not_before = NULL, turn = n.turn,
        claim_token = n.token, claim_boot = $2, claim_at = t.now, claim_call = $3
    FROM number n, t
    WHERE j.id = n.id
    RETURNING j.id, j.seq, j.record, j.epoch, j.token, j.claim_token, j.claim_boot, j.claim_at
)
SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at,
    (SELECT count(*) FROM candidates) AS candidates, t.is_draining, t.is_alive, t.now
FROM t LEFT JOIN claimed ON true
