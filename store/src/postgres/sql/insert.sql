INSERT INTO jobs (id, seq, record, kind, kind_claimed, folder, size, priority, since, not_before, alone, cancel, file_key, fresh_key, recipe)
SELECT id, nextval('transitions'), record, kind, kind_claimed, folder, size, priority, since, not_before, alone, false, file_key, fresh_key, recipe
FROM unnest($1::bigint[], $2::bytea[], $3::text[], $4::text[], $5::text[], $6::bigint[], $7::smallint[], $8::bigint[], $9::bigint[],
    $10::boolean[], $11::bytea[], $12::bytea[], $13::bigint[])
    AS new (id, record, kind, kind_claimed, folder, size, priority, since, not_before, alone, file_key, fresh_key, recipe)
