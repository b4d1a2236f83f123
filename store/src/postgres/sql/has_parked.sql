-- $1 folders that are shut. See claim.sql.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
)
SELECT EXISTS (SELECT 1 FROM t CROSS JOIN LATERAL (
    SELECT 1 FROM jobs WHERE kind = 'parked' AND not_before IS NOT NULL AND not_before <= t.now AND folder <> ALL ($1)
    UNION ALL
    SELECT 1 FROM jobs WHERE kind = 'parked' AND not_before IS NOT NULL AND not_before > t.now + 1800000 AND folder <> ALL ($1)
) r) AS has
