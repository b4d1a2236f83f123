-- Compare and set: $1 id, $2 number of the transition that was read, $16 the token that is needed, if one is.
-- $14: the lease in ms; none: it stays as it is.
UPDATE jobs SET seq = nextval('transitions'), record = $3, kind = $4, kind_claimed = $5, priority = $6, since = $7, not_before = $8,
    alone = $9, cancel = $10, recipe = $11, epoch = $12, token = $13,
    lease_until = CASE WHEN $12::bigint IS NULL THEN NULL WHEN $14::bigint IS NULL THEN lease_until ELSE suture_now() + $14 END,
    fresh_key = CASE WHEN $15 THEN fresh_key END,
    claim_token = NULL, claim_boot = NULL, claim_at = NULL, claim_call = NULL
WHERE id = $1 AND seq = $2 AND ($16::bigint IS NULL OR token = $16)
RETURNING seq
