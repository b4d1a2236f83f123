-- $1 epoch, $2 boot, $3 numbers of calls, $4 lease in ms, $5 least size, $6 most size, $7 alone, $8 folders that are shut, $9 folders that are served, $10 to $13
-- what is said of their turns. See `suture_claims`.
SELECT call, job AS id, number AS seq, was AS record, $1 AS epoch, number AS token, number AS claim_token, $2 AS claim_boot, at AS claim_at, at AS now,
    is_alive, is_draining, is_contended
FROM suture_claims($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13)
