//! Suture: unattended, out-of-core repair of triangle meshes for 3D printing. This is the binary: the command line, the hot
//! folders and their daemon, and the worker processes in which the engine runs.

mod cli;
mod exit;
mod fsx;
mod logging;
mod profiles;
mod protocol;
mod signals;
mod single;
mod supervise;
mod table;
mod units;
mod worker;

use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};
use exit::Exit;

fn main() -> ExitCode {
    let cli = Cli::parse();
    logging::start("warn");
    let exit = match &cli.command {
        Command::Repair(args) => single::repair(args),
        Command::Inspect(args) => single::inspect(args),
        Command::Worker => match worker::serve() {
            Ok(()) => Exit::Good,
            Err(error) => {
                eprintln!("worker: {error}");
                Exit::Refused
            }
        },
    };
    exit.into()
}
