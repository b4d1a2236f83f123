-- $1 to $18 as `suture_steps` takes them.
SELECT place, number AS seq, at AS now
FROM suture_steps($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18)
