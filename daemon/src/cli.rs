//! The command line: what can be said, with help for each word of it. Meaning is given in the modules named after the commands.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};

use suture_store::job::Kind;
use suture_store::{Address, Priority, Roles};

use crate::units::{parse_duration, parse_listen, parse_size};
use meshes::{ConvertArgs, DefeatureArgs, FillCurvesArgs, InspectArgs, RepairArgs, ResidueArgs, SimplifyArgs, SmoothArgs};
use service::{CompletionsArgs, CurvesArgs, HostsArgs, ManArgs, NightArgs, StatusArgs, StoreArgs, TopArgs};
use spend::Spend;

pub(crate) mod meshes;
pub(crate) mod service;
pub(crate) mod spend;

/// A build for crash tests says so, lest it be installed.
const VERSION: &str = if cfg!(feature = "crash-points") {
    concat!(env!("CARGO_PKG_VERSION"), " with crash points")
} else {
    env!("CARGO_PKG_VERSION")
};

/// Unattended repair of triangle meshes for 3D printing.
///
/// Exit status: 0 good under the profile; 1 done, but a file is not good; 2 unreadable or refused input, or wrong usage;
/// 73 the folder is served by another daemon; 75 the job store cannot be used, try again; 130 interrupted by a signal.
#[derive(Debug, Parser)]
#[command(name = "suture", version = VERSION, max_term_width = 100, disable_help_subcommand = true)]
pub(crate) struct Cli {
    /// How log lines on standard error look; auto: text on a terminal, JSON otherwise
    #[arg(long, value_name = "FORMAT", value_enum, default_value = "auto", global = true, hide_default_value = true)]
    pub log_format: LogFormat,
    #[command(subcommand)]
    pub command: Command,
}

/// How log lines look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    Auto,
    Text,
    Json,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Repair files: write the repaired meshes, and say what was wrong and what was done
    Repair(RepairArgs),
    /// Repair files, and remove small holes, fillets, grooves and bosses
    Defeature(DefeatureArgs),
    /// Repair files, and make their triangles fewer, within a proved distance
    Simplify(SimplifyArgs),
    /// Repair files, and smooth their waves
    Smooth(SmoothArgs),
    /// Repair files, and remove what a milling tool left between its passes
    Residue(ResidueArgs),
    /// Diagnose files and write nothing
    #[command(visible_alias = "check")]
    Inspect(InspectArgs),
    /// Write a mesh in another format, and change nothing of it
    Convert(ConvertArgs),
    /// Say which curves are in IGES, STEP or JSON files, and which closed loops they form
    Curves(CurvesArgs),
    /// Fill the closed loops of curves, or faces that lost their surfaces: a mesh, or surfaces for CAD programs
    FillCurves(FillCurvesArgs),
    /// Serve a hot folder: repair whatever is dropped into DIR/in
    #[command(long_about = WATCH_HELP)]
    Watch(WatchArgs),
    /// Check a configuration file, or show all settings with their values
    Config(ConfigArgs),
    /// Say which files and records a configuration's `[keep]` would let go now, and why; changes nothing
    Retention(RetentionArgs),
    /// List, show, retry, rank or cancel the jobs of a hot folder, with or without a running daemon
    Jobs(JobsArgs),
    /// Check a job store, write its jobs as JSON, move it into a database that many machines share, or out of one
    Store(StoreArgs),
    /// List the daemons that share a store, have one finish what it has and take nothing more, or have it take jobs again
    Hosts(HostsArgs),
    /// Show how a hot folder's daemon stands: its queue, what is in work, what ended last, what keeps it from work
    Status(StatusArgs),
    /// Show that anew each second, until `q`
    Top(TopArgs),
    /// Write what became of the last night's files: a page for a browser, or a table for a spreadsheet
    Night(NightArgs),
    /// Make a page for a browser of a report, with a picture before and after
    Report(ReportArgs),
    /// Draw a mesh, or one before and after its repair side by side, as PNG
    Picture(PictureArgs),
    /// Make a hot folder of small broken meshes, repair them, and show what happened
    Demo,
    /// Print a script that has a shell complete commands
    Completions(CompletionsArgs),
    /// Print a page of the manual
    Man(ManArgs),
    /// Work on requests from standard input (started by the supervisor)
    #[command(hide = true)]
    Worker(WorkerArgs),
    /// Draw a mesh for a page (started by the daemon)
    #[command(hide = true)]
    Draw(DrawArgs),
}

const WATCH_HELP: &str = "\
Serve a hot folder: repair whatever is dropped into DIR/in.

Needs no configuration. These folders are made under DIR:
  in/          drop files here; a sub-folder's name chooses the profile: default, fast, strict,
               cautious, scan, inspect-only, or one of your own
  out/         results, and only printable ones; a clean file appears here too
  done/        originals of what is in out/
  failed/      originals of what could not be made good, each with its report and the best attempt
  quarantine/  files that crash or hang the repair
  .suture/     work in progress and the job store; leave it alone

Nothing is ever overwritten: a second part.stl becomes part~2.stl. Ctrl-C or SIGTERM stops taking files and finishes those in
work; a second one stops at once, and the files are taken up again at the next start. SIGHUP makes a daemon with --config read its file
anew; a file with a mistake in it changes nothing.";

#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// A report, as written by repair or inspect, or by the daemon beside a result
    #[arg(value_name = "REPORT")]
    pub report: PathBuf,
    /// The files to draw, before and after [default: those that the report names, where they are unchanged]
    #[arg(num_args = 0..=2, value_name = "MESH")]
    pub files: Vec<PathBuf>,
    /// The page to write
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Replace OUT if it exists
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub spend: Spend,
}

#[derive(Args, Debug)]
pub(crate) struct PictureArgs {
    /// A mesh file, or two: before and after. Of two, what goes is violet, what is new green. The outside is grey, the inside orange, edges of
    /// only one triangle red
    #[arg(required = true, num_args = 1..=2, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// The PNG to write
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Replace OUT if it exists
    #[arg(long)]
    pub force: bool,
    /// Pixels of each mesh
    #[arg(long, value_name = "WxH", value_parser = parse_pixels, default_value = "800x600")]
    pub size: (usize, usize),
    /// Where the eye is, in degrees: around z from the x axis, and above the horizon [default: where most changes are seen]
    #[arg(long, value_name = "AROUND,ABOVE", value_parser = parse_eye, allow_hyphen_values = true)]
    pub eye: Option<(f64, f64)>,
    #[command(flatten)]
    pub spend: Spend,
}

fn parse_pixels(text: &str) -> Result<(usize, usize), String> {
    let pair = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    pair.filter(|(w, h)| (16..=2048).contains(w) && (16..=2048).contains(h))
        .ok_or_else(|| "width and height, each from 16 to 2048, like 800x600".into())
}

fn parse_eye(text: &str) -> Result<(f64, f64), String> {
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.abs() <= 360.0);
    let pair = text.split_once(',').and_then(|(around, above)| Some((number(around)?, number(above)?)));
    pair.ok_or_else(|| "two angles in degrees, like -60,30".into())
}

#[derive(Args, Debug, Clone)]
pub(crate) struct WatchArgs {
    /// Hot folder to serve; made when missing
    #[arg(value_name = "DIR", required_unless_present = "config", conflicts_with = "config")]
    pub dir: Option<PathBuf>,
    /// Configuration file (TOML) instead of a folder
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Work until everything in in/ is finished, then end: 0 if all is good, 1 if not
    #[arg(long)]
    pub once: bool,
    /// Memory all workers together may hold, e.g. 2GiB [default: 1GiB]
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory: Option<u64>,
    /// Small files worked on at a time [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub workers: Option<u16>,
    /// Threads for one large file [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Leave files larger than this to other daemons, e.g. 2GiB
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub largest: Option<u64>,
    /// How long a file must be at rest before it is taken, e.g. 5s
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub settle: Option<Duration>,
    /// Keep the jobs in this PostgreSQL database, which daemons on other machines may share, e.g. postgres://farm@db/suture; the password comes from
    /// PGPASSWORD or ~/.pgpass
    #[arg(long, value_name = "URL", value_parser = Address::parse)]
    pub store: Option<Address>,
    /// This daemon's part of the work on folders in buckets; other daemons of the same store do the rest: some of intake, worker, control, with
    /// commas [default: all]
    #[arg(long = "role", value_name = "ROLES")]
    pub roles: Option<Roles>,
    /// Serve the HTTP interface here, e.g. 127.0.0.1:7878; beyond this machine only with tokens, which a configuration names
    #[arg(long, value_name = "ADDR", value_parser = parse_listen)]
    pub listen: Option<SocketAddr>,
}

/// What the supervisor tells a worker of itself.
#[derive(Args, Debug)]
pub(crate) struct WorkerArgs {
    /// The process number of the supervisor, without which the worker ends
    #[arg(long)]
    pub parent: u32,
    /// Bytes of memory that the worker may have of the system
    #[arg(long)]
    pub data: u64,
    /// A folder that the worker may read and write; once one is named, it reaches nothing else
    #[arg(long = "within")]
    pub within: Vec<PathBuf>,
}

/// A drawing that the daemon asks for.
#[derive(Args, Debug)]
pub(crate) struct DrawArgs {
    #[command(flatten)]
    pub worker: WorkerArgs,
    #[command(flatten)]
    pub spend: Spend,
    /// One mesh with few triangles, instead of a picture
    #[arg(long)]
    pub coarse: bool,
    /// Seen from the opposite side
    #[arg(long)]
    pub behind: bool,
    /// The file to write
    #[arg(long)]
    pub output: PathBuf,
    /// A mesh, or two: before and after
    #[arg(required = true, num_args = 1..=2)]
    pub inputs: Vec<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct ConfigArgs {
    #[command(subcommand)]
    pub command: ConfigCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// Say whether `suture watch --config FILE` would take it, or which line is wrong
    Check {
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// Print every setting with its value, as a file; without FILE, those of a folder `prints` by default
    Print {
        #[arg(value_name = "FILE")]
        file: Option<PathBuf>,
    },
}

#[derive(Args, Debug)]
pub(crate) struct RetentionArgs {
    /// Configuration file (TOML), as for `suture watch --config`
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct JobsArgs {
    /// The hot folder
    #[arg(long, value_name = "DIR", default_value = ".", global = true)]
    pub dir: PathBuf,
    /// All jobs of this shared store, of whatever folder and machine, without asking a daemon
    #[arg(long, value_name = "URL", value_parser = Address::parse, global = true)]
    pub store: Option<Address>,
    /// Print JSON
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub command: JobsCommand,
}

/// The word for a job's state, with either dash.
fn parse_kind(text: &str) -> Result<Kind, String> {
    let word = text.replace('-', "_");
    let all = || Kind::ALL.map(Kind::name).join(", ").replace('_', "-");
    Kind::ALL.into_iter().find(|kind| kind.name() == word).ok_or_else(|| format!("no job is ever `{text}`; states are {}", all()))
}

fn parse_priority(text: &str) -> Result<Priority, String> {
    let number: i64 = text.parse().map_err(|_| format!("`{text}` is no priority; try a whole number from 0 to 9"))?;
    Priority::try_from(number).map_err(|error| error.to_string())
}

/// Who decides, and what they add.
#[derive(Args, Debug)]
pub(crate) struct Said {
    /// Who decides; receipt and report name them
    #[arg(long = "as", value_name = "NAME", default_value = "local")]
    pub by: String,
    /// Words to go with it
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub note: String,
}

#[derive(Debug, Subcommand)]
pub(crate) enum JobsCommand {
    /// List jobs, the newest last
    List {
        /// Only jobs in this state, e.g. queued, running, failed, needs-review
        #[arg(long, value_name = "STATE", value_parser = parse_kind)]
        state: Option<Kind>,
        /// Only jobs of this hot folder, by name, where a daemon serves several
        #[arg(long, value_name = "NAME")]
        folder: Option<String>,
        /// Only the newest N of them
        #[arg(long, value_name = "N")]
        newest: Option<usize>,
    },
    /// Show one job and its report
    Show {
        #[arg(value_name = "ID")]
        id: u64,
    },
    /// Work on a failed, cancelled or quarantined file once more
    Retry {
        #[arg(value_name = "ID")]
        id: u64,
    },
    /// Give a waiting job up; its file stays where it is
    Cancel {
        #[arg(value_name = "ID")]
        id: u64,
    },
    /// Publish the best attempt of a job that needs review, as it was judged
    Approve {
        #[arg(value_name = "ID")]
        id: u64,
        #[command(flatten)]
        said: Said,
    },
    /// Say that the result of a job that needs review is not to be used; all stays in failed/
    Reject {
        #[arg(value_name = "ID")]
        id: u64,
        #[command(flatten)]
        said: Said,
    },
    /// Have a waiting file taken sooner, or later
    Priority {
        #[arg(value_name = "ID")]
        id: u64,
        /// 0 to 9, the higher the sooner; files have 5 unless the configuration says otherwise
        #[arg(value_name = "N", value_parser = parse_priority, allow_negative_numbers = true)]
        priority: Priority,
    },
    /// Take nothing new, also after a restart, until `resume`; jobs in work are finished
    Pause,
    /// Take files again
    Resume,
    /// Pause, and wait until no job is in work any more: the machine may be switched off then
    Drain,
    /// Keep a damaged job store aside, and begin a new one from the receipts beside the results; no daemon may run
    Rebuild,
}

#[cfg(test)]
mod tests;
