//! The command line of what runs beside the daemon: how it stands, and what a packager needs.

use std::path::PathBuf;

use clap::Args;

#[derive(Args, Debug)]
pub(crate) struct StatusArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub dir: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// End with 1 unless a daemon runs that takes files: for whoever looks after it
    #[arg(long)]
    pub ready: bool,
}

#[derive(Args, Debug)]
pub(crate) struct TopArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub dir: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct CompletionsArgs {
    /// The shell that is to complete commands
    #[arg(value_name = "SHELL", value_enum)]
    pub shell: clap_complete::Shell,
}

#[derive(Args, Debug)]
pub(crate) struct ManArgs {
    /// A command, such as `watch` or `jobs retry`; without it, the page of all of them
    #[arg(value_name = "COMMAND")]
    pub command: Vec<String>,
}
