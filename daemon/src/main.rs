//! Suture: unattended, out-of-core repair of triangle meshes for 3D printing. This is the binary: the command line, the hot
//! folders and their daemon, and the worker processes in which the engine runs.

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests may ask whether a file is there"))]

mod again;
mod alike;
mod attempt;
mod bar;
mod batch;
mod beside;
mod bucket;
mod carry;
mod choice;
mod claim;
mod cli;
mod config;
mod confine;
mod control;
mod convert;
mod course;
mod create;
mod curves;
mod deliver;
mod demo;
mod draft;
mod escape;
mod event;
mod event_bus;
mod event_metrics;
mod event_store;
mod exit;
mod farm;
mod fence;
mod fill_curves;
mod folder;
mod folder_error;
mod force;
mod fsx;
mod glance;
mod ground;
mod handed;
mod hints;
mod hosts;
mod html;
mod item;
mod jobs;
mod keeper;
mod left;
mod logging;
mod manager;
mod manual;
mod names;
mod naming;
mod night;
mod orders;
mod own_profile;
mod parts;
mod past;
mod picture;
mod place;
mod profiles;
mod protocol;
mod publish;
mod publish_error;
mod pulse;
mod reach;
mod rebuild;
mod rebuilt;
mod receipt;
mod remove;
mod retention;
mod reuse;
mod rights;
mod sample;
mod say;
mod scan;
mod schedule;
mod sentinel;
mod settings;
mod settle;
mod shaped;
mod shared;
mod shelf;
mod shown;
mod signals;
#[cfg(test)]
mod simulation;
mod single;
mod standstill;
mod status;
mod store;
mod superseded;
mod supervise;
mod table;
mod taking;
mod units;
mod uploads;
mod url;
mod watch;
mod watchdog;
mod web;
mod whole;
mod window;
mod worker;
mod world;
mod writers;
mod yielded;

use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};
use exit::Exit;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let level = match cli.command {
        Command::Watch(_) => "info",
        // It shows results, good or bad, by itself.
        Command::Demo => "error",
        // It says itself what it finds; the store would tell of a copy.
        Command::Store(_) => "off",
        _ => "warn",
    };
    logging::start(level, cli.log_format);
    let exit = match &cli.command {
        Command::Repair(args) => single::repair(args),
        Command::Defeature(args) => single::defeature(args),
        Command::Simplify(args) => single::simplify(args),
        Command::Smooth(args) => single::smooth(args),
        Command::Residue(args) => single::residue(args),
        Command::Inspect(args) => single::inspect(args),
        Command::Convert(args) => convert::run(args),
        Command::Curves(args) => curves::run(args),
        Command::FillCurves(args) => fill_curves::run(args),
        Command::Worker(args) => match worker::serve(args) {
            Ok(()) => Exit::Good,
            Err(error) => {
                say::complain(&error);
                Exit::Cut
            }
        },
        Command::Watch(args) => watch::run(args),
        Command::Config(args) => config::command::run(&args.command),
        Command::Retention(args) => retention::command::run(&args.file, &jobs::all),
        Command::Jobs(args) => jobs::run(args),
        Command::Store(args) => store::run(args),
        Command::Hosts(args) => farm::run(args),
        Command::Status(args) => status::run(args),
        Command::Top(args) => status::top::run(args),
        Command::Completions(args) => manual::completions(args),
        Command::Man(args) => manual::man(args),
        Command::Night(args) => html::night::run(args, &jobs::all),
        Command::Report(args) => html::command::run(args),
        Command::Picture(args) => picture::command::run(args),
        Command::Draw(args) => picture::confined::run(args),
        Command::Demo => demo::run(),
    };
    exit.into()
}
