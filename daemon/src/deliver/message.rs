//! Messages: each is of the end of a job, or of news of the service itself.

use std::path::{Path, PathBuf};

use serde::Serialize;
use suture_store::{Job, JobId, News, Notice, Word};

use super::end::{End, id, lossy};
use crate::config::events::Occasion;
use crate::night::Numbers;
use crate::shown::when;

/// A message, of whatever way it goes.
pub(super) enum Message<'a> {
    End(End<'a>),
    Word(Told<'a>),
}

/// News, with the folder that they are of, if that is still served.
pub(super) struct Told<'a> {
    word: &'a Word,
    root: Option<PathBuf>,
}

/// News as they are sent.
#[derive(Serialize)]
struct Body<'a> {
    id: String,
    event: Occasion,
    time: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    folder: Option<FolderShown<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    night: Option<NightShown>,
}

#[derive(Serialize)]
struct FolderShown<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "lossy")]
    path: Option<PathBuf>,
    /// Why it is away.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
}

#[derive(Serialize)]
struct NightShown {
    since: String,
    until: String,
    #[serde(flatten)]
    numbers: Numbers,
}

impl<'a> Message<'a> {
    /// Of what a target has not heard; `None` where there is nothing to tell. `root`: where a hot folder of that name is, if it is served.
    pub(super) fn of(notice: &'a Notice, root: &dyn Fn(&str) -> Option<&'a Path>) -> Option<Self> {
        match notice {
            Notice::End(job) => End::of(job, root(&job.source.folder)).map(Self::End),
            Notice::Word(word) => {
                let folder = match &word.news {
                    News::FolderAway { folder, .. } | News::FolderBack { folder } => root(folder),
                    News::Night { .. } => None,
                };
                Some(Self::Word(Told { word, root: folder.map(Path::to_owned) }))
            }
        }
    }

    /// The same at each try, and of no other message.
    pub(super) fn id(&self) -> String {
        match self {
            Self::End(end) => end.id.clone(),
            Self::Word(Told { word, .. }) => id(word.at, word.seq),
        }
    }

    pub(super) fn event(&self) -> Occasion {
        match self {
            Self::End(end) => end.event,
            Self::Word(Told { word, .. }) => Occasion::of_news(&word.news),
        }
    }

    /// The job that it is of.
    pub(super) fn job(&self) -> Option<JobId> {
        match self {
            Self::End(End { job: Job { id, .. }, .. }) => Some(*id),
            Self::Word(_) => None,
        }
    }

    /// As JSON.
    pub(super) fn body(&self) -> Vec<u8> {
        match self {
            Self::End(end) => end.body(),
            // Names, numbers and words can always be written.
            Self::Word(told) => serde_json::to_vec(&self.shown(told)).unwrap_or_default(),
        }
    }

    fn shown<'b>(&self, told: &'b Told<'_>) -> Body<'b> {
        let path = || told.root.clone();
        let (folder, night) = match &told.word.news {
            News::FolderAway { folder, reason } => (Some(FolderShown { name: folder, path: path(), reason: Some(reason) }), None),
            News::FolderBack { folder } => (Some(FolderShown { name: folder, path: path(), reason: None }), None),
            News::Night { since, until, jobs } => {
                (None, Some(NightShown { since: when(*since), until: when(*until), numbers: Numbers::of(jobs) }))
            }
        };
        Body { id: self.id(), event: self.event(), time: when(told.word.at), folder, night }
    }
}

#[cfg(test)]
mod tests {
    use suture_store::{Kind, Seq, Time};

    use super::*;

    fn body(news: News) -> serde_json::Value {
        let notice = Notice::Word(Word { seq: Seq(9), at: Time(1_700_000_000_123), news });
        let message = Message::of(&notice, &|name| (name == "hot").then_some(Path::new("/srv/hot"))).unwrap();
        assert_eq!((message.id(), message.job()), ("18bcfe5687b-9".into(), None));
        serde_json::from_slice(&message.body()).unwrap()
    }

    #[test]
    fn news_say_what_what_of_and_when() {
        let (id, time) = ("18bcfe5687b-9", "2023-11-14T22:13:20.123Z");
        let away = body(News::FolderAway { folder: "hot".into(), reason: "it is gone".into() });
        let folder = serde_json::json!({"name": "hot", "path": "/srv/hot", "reason": "it is gone"});
        assert_eq!(away, serde_json::json!({"id": id, "event": "folder_away", "time": time, "folder": folder}));
        let back = body(News::FolderBack { folder: "old".into() });
        assert_eq!(back, serde_json::json!({"id": id, "event": "folder_back", "time": time, "folder": {"name": "old"}}));
        let jobs = [(Kind::Done, 5), (Kind::Failed, 2), (Kind::Noticed, 1), (Kind::Queued, 7)].into();
        let night = body(News::Night { since: Time(0), until: Time(1_700_000_000_000), jobs });
        assert_eq!((&night["event"], &night["id"], &night["time"]), (&"night".into(), &id.into(), &time.into()));
        let night = &night["night"];
        assert_eq!((&night["since"], &night["until"]), (&"1970-01-01T00:00:00Z".into(), &"2023-11-14T22:13:20Z".into()));
        assert_eq!((&night["need_someone"], &night["waiting"], &night["in_work"]), (&3.into(), &7.into(), &0.into()));
        assert_eq!((&night["jobs"]["done"], &night["jobs"]["rejected"]), (&5.into(), &0.into()));
    }
}
