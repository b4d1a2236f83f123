-- $1 least size, $2 most size, $3 alone, $4 folders that are shut. See claim.sql.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
), best AS (
    SELECT p.priority::bigint AS base, p.priority + least(9 - p.priority, greatest(0, t.now - o.since) / 1800000) AS aged
    FROM t
    CROSS JOIN (SELECT g::smallint AS priority FROM generate_series(0, 9) g) p
    CROSS JOIN LATERAL (
        SELECT since FROM jobs
        WHERE kind IN ('queued', 'queued_alone') AND alone = $3 AND priority = p.priority
            AND size BETWEEN $1 AND $2 AND folder <> ALL ($4)
        ORDER BY since LIMIT 1
    ) o
    UNION ALL
    SELECT r.priority, r.priority + least(9 - r.priority, greatest(0, t.now - r.since) / 1800000)
    FROM t CROSS JOIN LATERAL (
        SELECT priority, since FROM jobs
        WHERE kind = 'waiting' AND not_before IS NOT NULL AND not_before <= t.now
            AND alone = $3 AND size BETWEEN $1 AND $2 AND folder <> ALL ($4)
        UNION ALL
        SELECT priority, since FROM jobs
        WHERE kind = 'waiting' AND not_before IS NOT NULL AND not_before > t.now + 1800000
            AND alone = $3 AND size BETWEEN $1 AND $2 AND folder <> ALL ($4)
    ) r
)
SELECT max(base)::bigint AS highest, max(aged)::bigint AS aged FROM best
