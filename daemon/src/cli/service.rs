//! The command line of what runs beside the daemon and beside repairs: how it stands, what curves are in a file, and what a packager needs.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};

use suture_store::Address;

use crate::units::parse_duration;

#[derive(Args, Debug)]
pub(crate) struct StatusArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub dir: PathBuf,
    /// Ask this shared store, of whatever folder and machine, instead of a daemon
    #[arg(long, value_name = "URL", value_parser = Address::parse)]
    pub store: Option<Address>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// End with 1 unless a daemon runs that takes files: for whoever looks after it
    #[arg(long)]
    pub ready: bool,
}

#[derive(Args, Debug)]
pub(crate) struct HostsArgs {
    /// The store that they share
    #[arg(long, value_name = "URL", value_parser = Address::parse, global = true)]
    pub store: Option<Address>,
    /// Print JSON
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub command: HostsCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum HostsCommand {
    /// List them
    List,
    /// Have the daemons of a host, or one daemon, finish the jobs that they have and take nothing more, also after a restart
    Drain {
        /// A host, or a daemon by its full name
        #[arg(value_name = "NAME")]
        name: String,
    },
    /// Have them take jobs again
    Resume {
        /// A host, or a daemon by its full name
        #[arg(value_name = "NAME")]
        name: String,
    },
}

#[derive(Args, Debug)]
pub(crate) struct CurvesArgs {
    /// Files of curves: IGES, STEP, or JSON of knots and control points
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Ends no farther apart are the same point, in the unit of the file [default: derived from the file]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// Close open ends by straight curves, the nearest two first, none longer than this, in the unit of the file
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, allow_negative_numbers = true)]
    pub close_gaps: Option<f64>,
    /// Print JSON, a line for each file
    #[arg(long)]
    pub json: bool,
}

fn parse_length(text: &str) -> Result<f64, String> {
    let length = text.parse::<f64>().ok().filter(|length| length.is_finite() && *length >= 0.0);
    length.ok_or_else(|| "a number from 0 on, as 0.01".into())
}

#[derive(Args, Debug)]
pub(crate) struct TopArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub dir: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct NightArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub dir: PathBuf,
    /// The file to write: .html is a page for a browser, .csv a table for a spreadsheet
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Jobs that ended in so long a time until now; those that need a person are there whatever their age
    #[arg(long, value_name = "TIME", default_value = "24h", value_parser = parse_duration)]
    pub since: Duration,
    /// Replace OUT if it exists
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
pub(crate) struct StoreArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".", global = true)]
    pub dir: PathBuf,
    /// The store that daemons on many machines share, e.g. postgres://farm@db/suture, instead of the one of DIR
    #[arg(long, value_name = "URL", value_parser = Address::parse, global = true)]
    pub store: Option<Address>,
    #[command(subcommand)]
    pub command: StoreCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum StoreCommand {
    /// Look at every record: say what is wrong and what to do, end with 1 if anything is, and change nothing; no daemon may have the store of DIR
    Verify {
        /// Say as well what the store holds otherwise than this file says, which `export --complete` wrote
        #[arg(long, value_name = "FILE")]
        against: Option<PathBuf>,
    },
    /// Write all jobs as JSON, one a line, as `jobs list --json` prints them; with or without a running daemon
    Export {
        /// Write all that the store holds, for `import`; no daemon may have the store of DIR, and none should work on a shared one
        #[arg(long)]
        complete: bool,
        /// The file to write, whole or not at all [default: standard output]
        #[arg(short, long, value_name = "OUT")]
        output: Option<PathBuf>,
        /// Replace OUT if it exists
        #[arg(long, requires = "output")]
        force: bool,
    },
    /// Take over what `export --complete` wrote, into an empty store: of the database with --store, else of DIR, whose daemon may not run
    Import {
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// Make the store in the database of --store, or bring it up to date, as the user who owns it; a daemon whose user may do that needs no such step
    Create,
    /// Print the SQL that makes a role with no more rights than a daemon needs, for the owner of the database
    Role {
        #[arg(value_name = "NAME")]
        name: String,
    },
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
