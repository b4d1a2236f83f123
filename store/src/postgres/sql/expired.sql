-- $1 lease in ms, $2 folders that are shut, $3 folders that are served, $4 epoch of whoever asks. Where the database itself was away, whoever lives has a lease's time to say so.
SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at, t.now, nextval('transitions') AS number
FROM jobs, (SELECT suture_now() AS now) t
WHERE epoch IS NOT NULL AND lease_until <= t.now AND suture_up_since() + $1 <= t.now AND folder <> ALL ($2)
    AND ($3::text[] IS NULL OR folder = ANY ($3)) AND NOT suture_drains($4)
ORDER BY lease_until LIMIT 1
FOR UPDATE OF jobs SKIP LOCKED
