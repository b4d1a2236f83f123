-- $1 least size, $2 most size, $3 alone, $4 folders that are shut, $5 folders that are served, $6 to $9 what is said of their turns. See claim.sql.
WITH t AS MATERIALIZED (
    SELECT suture_now() AS now
), folders AS MATERIALIZED (
    SELECT name FROM suture_turns($4, $5, $6, $7, $8, $9)
), waits AS (
    SELECT o.base, o.waits_since FROM folders f CROSS JOIN LATERAL suture_oldest_of(f.name, $3, $1, $2) o
    UNION ALL
    SELECT r.base, r.waits_since FROM t CROSS JOIN LATERAL suture_rested(t.now, 'waiting', $4, $5) r
    JOIN jobs j ON j.id = r.job JOIN folders f ON f.name = j.folder
    WHERE r.is_alone = $3 AND r.file_size BETWEEN $1 AND $2
)
SELECT max(base)::bigint AS highest, max(base + least(9 - base, greatest(0, t.now - waits_since) / 1800000))::bigint AS aged
FROM t CROSS JOIN waits
