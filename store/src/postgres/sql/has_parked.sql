-- $1 folders that are shut. See claim.sql.
SELECT EXISTS (
    SELECT 1 FROM jobs, (SELECT suture_now() AS now) t
    WHERE kind = 'parked' AND folder <> ALL ($1)
        AND not_before IS NOT NULL AND (not_before <= t.now OR not_before > t.now + 1800000)
) AS has
