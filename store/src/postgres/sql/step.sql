-- A step of a holder that does not end the job, as `suture_steps` makes several: $1 job, $2 transition that was read, $3 token that is needed, then the row as it is
-- to be, $15 lease in ms, $16 has it neither rested nor moved yet, $17 the time that it was made with.
UPDATE jobs SET seq = nextval('transitions'), record = $4, kind = suture_kind($5), stage = suture_stage($5), kind_claimed = $6, priority = $7, since = $8,
    not_before = $9, alone = $10, cancel = $11, recipe = $12, epoch = $13, token = $14,
    lease_until = CASE WHEN $13 IS NOT NULL THEN suture_now() + $15 END,
    fresh_key = CASE WHEN $16 THEN fresh_key END,
    claim_token = NULL, claim_boot = NULL, claim_at = NULL, claim_call = NULL
WHERE id = $1 AND seq = $2 AND token = $3 AND ($17::bigint IS NULL OR abs(suture_now() - $17) <= 1000)
RETURNING seq, suture_now() AS now
