//! `suture status`: how a hot folder's daemon stands, on one screen; [`top`] shows it anew each second.

use std::path::Path;

use suture_store::{Address, Kind, Time};

use crate::cli::service::StatusArgs;
use crate::exit::Exit;
use crate::glance::{Glance, Work};
use crate::hosts;
use crate::jobs::Folders;
use crate::reach;
use crate::say::{complain, plain, print};
use crate::units::{show_count, show_size, show_when};

pub(crate) mod top;

/// Shows it once.
pub(crate) fn run(args: &StatusArgs) -> Exit {
    let glance = match reach::glance(&args.dir, args.store.as_ref()) {
        Ok(glance) => glance,
        Err(failure) => {
            complain(&failure.line);
            return failure.exit;
        }
    };
    let text = match args.json {
        true => serde_json::to_string(&glance).unwrap_or_default() + "\n",
        false => screen(&args.dir, args.store.as_ref(), &glance),
    };
    print(text.as_bytes(), if args.ready && !glance.ready { Exit::NotGood } else { Exit::Good })
}

/// All of it, in lines.
fn screen(dir: &Path, shared: Option<&Address>, glance: &Glance) -> String {
    let dir = plain(&dir.display().to_string());
    let mut text = match (&glance.since, &glance.reason) {
        (None, _) if shared.is_some() => {
            shared.map(|address| format!("{address}: this is what the shared job store says\n")).unwrap_or_default()
        }
        (None, _) => format!("{dir}: no daemon runs; this is what its job store says\n"),
        (Some(since), reason) => {
            let how = reason.as_ref().map_or_else(|| "ready".into(), |why| format!("not ready: {}", plain(why)));
            let roles = if glance.roles.are_all() { String::new() } else { format!(" as {}", glance.roles) };
            format!("{dir}: suture {} runs{roles} since {}, {how}\n", plain(&glance.version), show_when(since.0))
        }
    };
    let counts = |of: fn(Kind) -> bool| {
        let some = glance.jobs.iter().filter(|(kind, count)| of(**kind) && **count > 0);
        let all: Vec<String> = some.map(|(kind, count)| format!("{} {kind}", show_count(*count))).collect();
        if all.is_empty() { "none".into() } else { all.join(", ") }
    };
    text += &format!("  waiting   {}\n", counts(|kind| !kind.is_held() && !kind.is_at_rest()));
    text += &format!("  in work   {}\n", counts(Kind::is_held));
    text.extend(glance.work.iter().map(|work| at_work(work, glance.folders.len() > 1)));
    text += &format!("  ended     {}\n", counts(Kind::is_at_rest));
    let held = glance.standing.held.iter().map(|why| ("nothing new is taken", why));
    let away = glance.standing.away.iter().map(|why| ("out of reach", why));
    let full = glance.standing.full.iter().map(|why| ("disk full", why));
    let untold = glance.standing.untold.iter().map(|who| ("not told yet", who));
    let stranded = glance.standing.stranded.iter().map(|what| ("no host for it", what));
    text.extend(
        held.chain(away).chain(full).chain(untold).chain(stranded).map(|(what, why)| format!("  {what}: {}\n", plain(why))),
    );
    for folder in &glance.folders {
        let room = match folder.free_bytes {
            _ if !folder.reachable => "out of reach".to_owned(),
            Some(free) => format!("{} free", show_size(free)),
            None => "in reach".to_owned(),
        };
        let path = plain(&folder.path.display().to_string());
        text += &format!("  folder    {}: {room}  {path}\n", plain(&folder.name));
    }
    text.extend(glance.hosts.iter().map(|host| format!("  host      {}\n", hosts::line(host))));
    if shared.is_none() {
        text += &format!("  job store {}\n", show_size(glance.store_bytes));
    }
    let folders = Folders::of(glance.last.iter().chain(&glance.review));
    for (head, jobs) in [("ended last", &glance.last), ("to be looked at", &glance.review)] {
        if !jobs.is_empty() {
            text += &format!("\n{head}\n");
            text.extend(jobs.iter().map(|job| folders.line(job, None)));
        }
    }
    text
}

fn at_work(work: &Work, of_several: bool) -> String {
    let folder = if of_several { format!("{}: ", plain(&work.folder)) } else { String::new() };
    let file = folder + &plain(&work.file);
    format!("{:>6}    {file:<32} {:>9}  {}\n", work.job.0, show_size(work.size), work.words())
}

/// Nothing is known: for whoever shows it again and again.
fn unknown(dir: &Path, why: &str) -> String {
    format!("{}: {}\n  at {}\n", plain(&dir.display().to_string()), plain(why), show_when(now().0))
}

fn now() -> Time {
    use crate::world::World;
    crate::world::Machine.wall()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::glance::Served;
    use crate::schedule::Standing;
    use suture_store::{Host, Job, JobId, RelPath, Source, Station};

    fn job(name: &[u8]) -> Job {
        let (folder, profile) = ("hot".to_owned(), "default".to_owned());
        let source = Source { folder, path: RelPath::new(name).unwrap(), dev: 1, ino: 2, size: 84, mtime_ns: 4, profile };
        Job::queued(JobId(7), source, Time(1_700_000_000_123))
    }

    fn glance() -> Glance {
        let work = Work {
            job: JobId(9),
            folder: "hot".into(),
            file: "big.stl".into(),
            kind: Kind::Running,
            size: 84_000_000,
            seconds: 7,
            stage: Some("topology".into()),
            doing: Some("looking for defects".into()),
            percent: Some(45),
            seconds_left: Some(12),
        };
        Glance {
            version: "1".into(),
            since: Some(Time(1_700_000_000_123)),
            ready: true,
            standing: Standing {
                running: 1,
                held: vec!["an operator".into()],
                away: vec!["a \u{1b}[2J mount".into()],
                full: vec!["the disk of b".into()],
                untold: vec!["`farm` has not heard of 3".into()],
                stranded: vec!["job 9 waits for a host".into()],
            },
            jobs: [(Kind::Queued, 3), (Kind::Running, 1), (Kind::Done, 5), (Kind::Failed, 0)].into(),
            work: vec![work],
            last: vec![job(b"last.stl")],
            review: vec![job(b"odd\x1b.stl")],
            folders: vec![Served { name: "hot".into(), path: "/srv/hot".into(), reachable: true, free_bytes: Some(1 << 30) }],
            store_bytes: 4096,
            roles: "intake,control".parse().unwrap(),
            hosts: vec![Host {
                daemon: "b:/state".into(),
                station: Station { roles: "worker".parse().unwrap(), ..Station::default() },
                folders: vec!["hot".into()],
                began: Time(1),
                seen: Time(2),
                is_alive: true,
                is_draining: false,
                running: 2,
            }],
            ..Glance::default()
        }
    }

    #[test]
    fn all_of_it_is_on_one_screen() {
        let text = screen(Path::new("hot"), None, &glance());
        for words in [
            "hot: suture 1 runs as intake,control since 20",
            ", ready\n",
            "waiting   3 queued\n",
            "in work   1 running\n",
            "9    big.stl",
            "looking for defects, 45 %, for 7 s, about 12 s left\n",
            "ended     5 done\n",
            "nothing new is taken: an operator\n",
            "out of reach: a ",
            "disk full: the disk of b\n",
            "not told yet: `farm` has not heard of 3\n",
            "no host for it: job 9 waits for a host\n",
            "  host      b:/state: alive, worker, 2 in work; ",
            "folder    hot: 1.1 GB free  /srv/hot\n",
            "ended last\n",
            "last.stl",
            "to be looked at\n",
            "odd%1B.stl",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        assert!(!text.contains('\u{1b}'), "no name steers a terminal");
    }

    /// Through the socket it comes as it went.
    #[test]
    fn it_is_read_back() {
        let text = serde_json::to_string(&glance()).unwrap();
        assert_eq!(serde_json::from_str::<Glance>(&text).unwrap(), glance());
    }
}
