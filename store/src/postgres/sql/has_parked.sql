-- $1 folders that are shut, $2 folders that are served, $3 lease in ms, $4 epoch of whoever asks. See claim.sql and expired.sql.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
)
SELECT EXISTS (SELECT 1 FROM t CROSS JOIN LATERAL suture_rested(t.now, 'parked', $1, $2))
    OR EXISTS (
        SELECT 1 FROM t JOIN jobs ON epoch IS NOT NULL AND lease_until <= t.now
        WHERE suture_up_since() + $3 <= t.now AND folder <> ALL ($1) AND ($2::text[] IS NULL OR folder = ANY ($2))
            AND NOT suture_drains($4)
    ) AS has
