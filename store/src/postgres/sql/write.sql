-- Rows in their order, each for itself: see `suture_write`. $18: the time that each was made with, where it was not asked of the database just before:
-- then it must be the time that it is, but for a second.
SELECT CASE WHEN w.counted IS NULL OR abs(suture_now() - w.counted) <= 1000 THEN suture_write(
        w.id, w.seq, w.needed, w.record, w.kind, w.kind_claimed, w.priority, w.since, w.not_before, w.alone, w.cancel, w.recipe,
        w.epoch, w.token, w.lease, w.is_fresh, w.ended) END AS seq,
    suture_now() AS now
FROM unnest($1::bigint[], $2::bigint[], $3::bigint[], $4::bytea[], $5::text[], $6::text[], $7::smallint[], $8::bigint[], $9::bigint[],
    $10::boolean[], $11::boolean[], $12::bigint[], $13::bigint[], $14::bigint[], $15::bigint[], $16::boolean[], $17::bytea[], $18::bigint[])
    AS w (id, seq, needed, record, kind, kind_claimed, priority, since, not_before, alone, cancel, recipe, epoch, token, lease, is_fresh, ended, counted)
