-- $1 least size, $2 most size, $3 alone, $4 folders that are shut, $5 folders that are served. See claim.sql.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
), waits AS (
    SELECT base, waits_since FROM suture_oldest($3, $1, $2, $4, $5)
    UNION ALL
    SELECT r.base, r.waits_since FROM t CROSS JOIN LATERAL suture_rested(t.now, 'waiting', $4, $5) r
    WHERE r.is_alone = $3 AND r.file_size BETWEEN $1 AND $2
)
SELECT max(base)::bigint AS highest, max(base + least(9 - base, greatest(0, t.now - waits_since) / 1800000))::bigint AS aged
FROM t CROSS JOIN waits
