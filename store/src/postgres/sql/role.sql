-- What a daemon needs of a store that is there: rows of its tables, and numbers. It makes, changes and drops no table.
GRANT USAGE ON SCHEMA :schema TO :role;
GRANT SELECT ON :schema.migrations TO :role;
GRANT SELECT, UPDATE ON :schema.head TO :role;
GRANT SELECT, INSERT, UPDATE, DELETE ON :schema.jobs, :schema.lives, :schema.daemons, :schema.subscribers, :schema.outbox, :schema.away,
    :schema.drains TO :role;
GRANT SELECT, USAGE, UPDATE ON SEQUENCE :schema.transitions TO :role;
GRANT EXECUTE ON FUNCTION :schema.suture_now, :schema.suture_up_since, :schema.suture_write, :schema.suture_news, :schema.suture_oldest,
    :schema.suture_rested, :schema.suture_drains, :schema.suture_tells, :schema.suture_folders,
    :schema.suture_turns, :schema.suture_oldest_of, :schema.suture_kind, :schema.suture_stage, :schema.suture_class, :schema.suture_heads,
    :schema.suture_rested_heads, :schema.suture_claims, :schema.suture_steps TO :role;
