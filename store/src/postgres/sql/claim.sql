-- $1 epoch, $2 boot, $3 call, $4 lease in ms, $5 least size, $6 most size, $7 alone, $8 folders that are shut, $9 folders that are served.
-- Connections are told to prefer indexes (`open.rs`): in a new database nothing is known of how many rows there are.
-- Each step of priority takes 1,800,000 ms of waiting.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
), ready AS MATERIALIZED (
    -- Of each priority those that have risen the most, the oldest first.
    SELECT r.id, r.kind, o.base + k.steps AS rank, 0::bigint AS turn
    FROM t
    CROSS JOIN suture_oldest($7, $5, $6, $8, $9) o
    CROSS JOIN LATERAL (SELECT least(9 - o.base, greatest(0, t.now - o.waits_since) / 1800000) AS steps) k
    CROSS JOIN LATERAL (
        SELECT id, kind FROM jobs
        WHERE kind IN ('queued', 'queued_alone') AND alone = $7 AND priority = o.base
            AND size BETWEEN $5 AND $6 AND folder <> ALL ($8) AND ($9::text[] IS NULL OR folder = ANY ($9))
            AND (k.steps = 0 OR since <= t.now - k.steps * 1800000)
        ORDER BY id LIMIT 64
    ) r
), rested AS MATERIALIZED (
    SELECT r.job AS id, 'waiting' AS kind, r.base + least(9 - r.base, greatest(0, t.now - r.waits_since) / 1800000) AS rank, 0::bigint AS turn
    FROM t CROSS JOIN LATERAL suture_rested(t.now, 'waiting', $8, $9) r
    WHERE r.is_alone = $7 AND r.file_size BETWEEN $5 AND $6
    ORDER BY rank DESC, id LIMIT 64
), parked AS MATERIALIZED (
    -- Before all others, for whoever asks.
    SELECT r.job AS id, 'parked' AS kind, 10::bigint AS rank, r.ended AS turn
    FROM t CROSS JOIN LATERAL suture_rested(t.now, 'parked', $8, $9) r
    LIMIT 128
), candidates AS MATERIALIZED (
    SELECT * FROM ready UNION ALL SELECT * FROM rested UNION ALL SELECT * FROM parked
), pick AS MATERIALIZED (
    SELECT j.id
    FROM candidates c JOIN jobs j ON j.id = c.id
    WHERE j.kind = c.kind AND EXISTS (SELECT 1 FROM lives WHERE epoch = $1 AND NOT is_over)
    ORDER BY c.rank DESC, c.turn, c.id
    LIMIT 1
    FOR UPDATE OF j SKIP LOCKED
), number AS MATERIALIZED (
    SELECT id, nextval('transitions') AS token FROM pick
), claimed AS (
    UPDATE jobs j
    SET seq = n.token, token = n.token, epoch = $1, lease_until = t.now + $4, kind = j.kind_claimed, not_before = NULL,
        claim_token = n.token, claim_boot = $2, claim_at = t.now, claim_call = $3
    FROM number n, t
    WHERE j.id = n.id
    RETURNING j.id, j.seq, j.record, j.epoch, j.token, j.claim_token, j.claim_boot, j.claim_at
)
SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at,
    (SELECT count(*) FROM candidates) AS candidates,
    EXISTS (SELECT 1 FROM lives WHERE lives.epoch = $1 AND NOT is_over) AS is_alive
FROM t LEFT JOIN claimed ON true
