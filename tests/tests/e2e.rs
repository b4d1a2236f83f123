//! The built binary, end to end. Outputs are judged by `suture_bench::judge`, never by the engine that wrote them.

#[cfg(test)]
mod e2e {
    mod api;
    mod away;
    mod blind;
    mod buckets;
    mod burst;
    mod cases;
    mod companions;
    mod config;
    mod curves;
    mod farm;
    mod features;
    mod files;
    mod fill_curves;
    mod formats;
    mod heard;
    mod hostile;
    mod interrupted;
    mod json;
    mod lost_state;
    mod malformed;
    mod many;
    mod memory;
    mod morning;
    mod news;
    mod night;
    mod odd_names;
    mod orders;
    mod package;
    mod pages;
    mod pictures;
    mod profiles;
    mod queue;
    mod rebuild;
    mod residue;
    mod retention;
    mod reuse;
    mod review;
    mod roles;
    mod rude;
    mod same_bytes;
    mod service;
    mod shaping;
    mod shares;
    mod soups;
    mod specials;
    mod steer;
    mod taken;
    mod terminal;
    mod told;
    mod twice;
    mod watch;
    mod web;
}
