//! `suture hosts`: the daemons that share a store, and which of them are to claim nothing.

use suture_store::{Host, JobStore};

use crate::cli::service::{HostsArgs, HostsCommand};
use crate::exit::Exit;
use crate::hosts::line;
use crate::reach::Failure;
use crate::say::{complain, plain, print};
use crate::shared::visit;

/// Does what the command line asks.
pub(crate) fn run(args: &HostsArgs) -> Exit {
    let Some(address) = &args.store else {
        complain(
            &"name the database that they share with --store; `suture status` and `suture jobs drain` are for a daemon alone",
        );
        return Exit::Refused;
    };
    match visit(address, "").map_err(Failure::from).and_then(|store| done(&*store, &args.command)) {
        Ok(hosts) => print(text(&hosts, args.json).as_bytes(), Exit::Good),
        Err(Failure { line, exit }) => {
            complain(&line);
            exit
        }
    }
}

/// Drains or resumes a host, if that is wished; all of them afterwards.
fn done(store: &(impl JobStore + ?Sized), command: &HostsCommand) -> Result<Vec<Host>, Failure> {
    let wish = match command {
        HostsCommand::List => None,
        HostsCommand::Drain { name } => Some((name, true)),
        HostsCommand::Resume { name } => Some((name, false)),
    };
    if let Some((name, drains)) = wish
        && !store.drain(name, drains)?
    {
        let line = format!("no host and no daemon of this store is called {}; `suture hosts list` names them", plain(name));
        return Err(Failure { line, exit: Exit::Refused });
    }
    Ok(store.hosts()?)
}

fn text(hosts: &[Host], json: bool) -> String {
    if json {
        return hosts.iter().filter_map(|host| serde_json::to_string(host).ok()).map(|line| line + "\n").collect();
    }
    if hosts.is_empty() {
        return "no daemon shares this store\n".into();
    }
    hosts.iter().map(|host| line(host) + "\n").collect()
}
