//! The built binary, end to end. Outputs are judged by `suture_bench::judge`, never by the engine that wrote them.

#[cfg(test)]
mod e2e {
    mod away;
    mod cases;
    mod config;
    mod files;
    mod interrupted;
    mod malformed;
    mod many;
    mod memory;
    mod orders;
    mod profiles;
    mod queue;
    mod retention;
    mod reuse;
    mod same_bytes;
    mod soups;
    mod steer;
    mod terminal;
    mod watch;
}
