-- $1 folders that are shut, $2 folders that are served. See claim.sql.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
)
SELECT EXISTS (SELECT 1 FROM t CROSS JOIN LATERAL suture_rested(t.now, 'parked', $1, $2)) AS has
