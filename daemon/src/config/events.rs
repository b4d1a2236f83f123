//! Who hears of the ends of jobs, and of the service itself: `[[webhook]]` and `[on_done]` in the configuration, as they are written and as they count.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Deserializer, Serialize, de};
use suture_store::{Job, Kind, News};
use toml::Spanned;

use crate::profiles::{place_of, with_line};
use crate::units::parse_duration;
use crate::url::Url;

/// A command has so long unless the configuration says otherwise.
const TIME_LIMIT: Duration = Duration::from_secs(10 * 60);
/// Webhooks of a configuration, at most.
const MOST: usize = 16;
/// Longest name of a webhook, in bytes.
const LONGEST_NAME: usize = 48;

/// How a job ended, or what happened to the service, as far as others may want to hear of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Occasion {
    /// Its result is good.
    Finished,
    NeedsReview,
    Failed,
    Quarantined,
    /// No mesh: a file that one names was copied to where its result is.
    Carried,
    /// A night is over.
    Night,
    FolderAway,
    FolderBack,
}

impl Occasion {
    /// The ends of jobs: a webhook hears of these unless it says what of. Others have no job in their message, which a receiver of earlier versions
    /// may rely on.
    pub(crate) const ENDS: [Self; 4] = [Self::Finished, Self::NeedsReview, Self::Failed, Self::Quarantined];

    /// Of a job as it stood at its end; `None` for any other.
    pub(crate) fn of(job: &Job) -> Option<Self> {
        match job.kind() {
            Kind::Done => Some(Self::Finished),
            Kind::Carried => Some(Self::Carried),
            Kind::NeedsReview => Some(Self::NeedsReview),
            Kind::Failed => Some(Self::Failed),
            Kind::Quarantined => Some(Self::Quarantined),
            _ => None,
        }
    }

    /// Of news.
    pub(crate) fn of_news(news: &News) -> Self {
        match news {
            News::Night { .. } => Self::Night,
            News::FolderAway { .. } => Self::FolderAway,
            News::FolderBack { .. } => Self::FolderBack,
        }
    }

    /// The word for it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::NeedsReview => "needs_review",
            Self::Failed => "failed",
            Self::Quarantined => "quarantined",
            Self::Carried => "carried",
            Self::Night => "night",
            Self::FolderAway => "folder_away",
            Self::FolderBack => "folder_back",
        }
    }
}

/// A receiver of events over HTTP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Webhook {
    /// The store remembers by it what was delivered.
    pub name: String,
    pub url: Url,
    /// Holds the secret that messages are signed with; `None`: they are not signed.
    pub secret_file: Option<PathBuf>,
    /// The events that it is told of.
    pub events: Vec<Occasion>,
}

/// When a command is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum When {
    /// For results that are good, and whose certificate holds.
    Certified,
    /// For every end of a job.
    Always,
}

impl When {
    /// The word for it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Certified => "certified",
            Self::Always => "always",
        }
    }
}

/// A command that is run when a job has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OnDone {
    /// The program and its arguments, with placeholders.
    pub command: Vec<String>,
    pub when: When,
    pub time_limit: Duration,
}

/// Who hears of the ends of jobs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Events {
    pub webhooks: Vec<Webhook>,
    pub on_done: Option<OnDone>,
}

impl Events {
    /// Names of all who hear.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        let command = self.on_done.as_ref().map(|_| OnDone::NAME);
        self.webhooks.iter().map(|webhook| webhook.name.as_str()).chain(command)
    }
}

/// A webhook as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WebhookFile {
    url: Spanned<String>,
    name: Option<String>,
    secret_file: Option<PathBuf>,
    events: Option<Vec<Occasion>>,
}

/// A command as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OnDoneFile {
    command: Spanned<Vec<String>>,
    when: Option<When>,
    #[serde(default, deserialize_with = "time")]
    time_limit: Option<Duration>,
}

fn time<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Duration>, D::Error> {
    parse_duration(&String::deserialize(d)?).map(Some).map_err(de::Error::custom)
}

/// What `text` says of all this.
///
/// # Errors
/// A line for people, with the number of the line at fault.
pub(crate) fn read(text: &str, webhooks: Vec<Spanned<WebhookFile>>, on_done: Option<OnDoneFile>) -> Result<Events, String> {
    let mut all: Vec<Webhook> = Vec::new();
    for of_file in webhooks {
        let (from, of_file) = (of_file.span().start, of_file.into_inner());
        let wrong = |setting: &str, what: &str| with_line(text, place_of(text, from, setting), what);
        let url = Url::parse(of_file.url.get_ref()).map_err(|what| with_line(text, of_file.url.span().start, &what))?;
        let is_given = of_file.name.is_some();
        let name = of_file.name.unwrap_or_else(|| url.authority());
        let setting = if is_given { "name" } else { "url" };
        if name.is_empty() || name.len() > LONGEST_NAME || name.chars().any(char::is_control) || name == OnDone::NAME {
            let what = format!("`{name}` is no name for a webhook; give it a `name` of at most {LONGEST_NAME} characters");
            return Err(wrong(setting, &what));
        }
        if all.iter().any(|other| other.name == name) {
            return Err(wrong(setting, &format!("two webhooks are called `{name}`; give each a `name` of its own")));
        }
        if all.len() == MOST {
            return Err(wrong("url", &format!("there are more than {MOST} webhooks; let one receiver pass messages on")));
        }
        let events = of_file.events.unwrap_or_else(|| Occasion::ENDS.to_vec());
        if events.is_empty() {
            return Err(wrong("events", "it names no event; leave it out for all ends of jobs"));
        }
        all.push(Webhook { name, url, secret_file: of_file.secret_file, events });
    }
    Ok(Events { webhooks: all, on_done: on_done.map(|of_file| command(text, of_file)).transpose()? })
}

fn command(text: &str, of_file: OnDoneFile) -> Result<OnDone, String> {
    let at = of_file.command.span().start;
    let command = of_file.command.into_inner();
    if command.first().is_none_or(String::is_empty) {
        return Err(with_line(text, at, "it names no program; write it as a list, such as [\"/usr/bin/program\", \"{output}\"]"));
    }
    if let Some(unknown) = command.iter().flat_map(|word| placeholders(word)).find(|name| !OnDone::PLACEHOLDERS.contains(name)) {
        let known = OnDone::PLACEHOLDERS.map(|name| format!("{{{name}}}")).join(", ");
        return Err(with_line(text, at, &format!("nothing is known for `{{{unknown}}}`; there are {known}")));
    }
    if command.iter().any(|word| word.contains('\0')) {
        return Err(with_line(text, at, "an argument cannot hold a zero byte"));
    }
    let (when, time_limit) = (of_file.when.unwrap_or(When::Certified), of_file.time_limit.unwrap_or(TIME_LIMIT));
    Ok(OnDone { command, when, time_limit })
}

impl OnDone {
    /// Its name beside those of webhooks.
    pub(crate) const NAME: &'static str = "on_done";

    /// What is filled in.
    pub(crate) const PLACEHOLDERS: [&'static str; 8] =
        ["output", "report", "original", "folder", "file", "job", "event", "ending"];
}

/// Names in braces, such as `output` in `{output}.gcode`. Other braces are what they are.
pub(crate) fn placeholders(word: &str) -> impl Iterator<Item = &str> {
    let is_name = |name: &&str| !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_');
    word.split('{').skip(1).filter_map(|rest| Some(rest.split_once('}')?.0)).filter(is_name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::read::from_file;

    fn read_from(lines: &str) -> Result<Events, String> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("s.toml");
        std::fs::write(&file, format!("[[folders]]\npath = \"/a\"\n{lines}")).unwrap();
        let short = |line: String| line.split_once("s.toml: ").unwrap().1.to_owned();
        from_file(&file).map(|config| config.events).map_err(short)
    }

    #[test]
    fn little_has_to_be_said() {
        let events = read_from("[[webhook]]\nurl = \"http://farm:9000/x\"\n[on_done]\ncommand = [\"/bin/true\"]\n").unwrap();
        let [hook] = events.webhooks.as_slice() else { panic!("{events:?}") };
        assert_eq!((hook.name.as_str(), hook.events.as_slice()), ("farm:9000", Occasion::ENDS.as_slice()));
        let on_done = events.on_done.clone().unwrap();
        assert_eq!((on_done.when, on_done.time_limit), (When::Certified, Duration::from_secs(600)));
        assert_eq!(events.names().collect::<Vec<_>>(), ["farm:9000", "on_done"]);
        assert_eq!(read_from(""), Ok(Events::default()));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let hook = "[[webhook]]\nurl = \"http://farm/\"\n";
        for (lines, words) in [
            ("[[webhook]]\nname = \"a\"".to_owned(), "line 3, `[[webhook]]`: missing field `url`"),
            (
                "[[webhook]]\nurl = \"https://farm/\"".into(),
                "line 4, `url = \"https://farm/\"`: `https://farm/` wants encryption",
            ),
            ("[[webhook]]\nurl = \"farm\"".into(), "line 4, `url = \"farm\"`: `farm` is no address of a receiver"),
            (
                format!("{hook}events = [\"done\"]"),
                "line 5, `events = [\"done\"]`: unknown variant `done`, expected one of `finished`",
            ),
            (format!("{hook}events = []"), "line 5, `events = []`: it names no event"),
            (format!("{hook}name = \"on_done\""), "line 5, `name = \"on_done\"`: `on_done` is no name for a webhook"),
            (format!("{hook}{hook}"), "line 6, `url = \"http://farm/\"`: two webhooks are called `farm`; give each a `name`"),
            (hook.replace("farm", &"f".repeat(50)), "line 4, `url = \"http://fff"),
            ("[on_done]\ncommand = []".into(), "line 4, `command = []`: it names no program"),
            (
                "[on_done]\ncommand = [\"x\", \"{outptu}\"]".into(),
                "line 4, `command = [\"x\", \"{outptu}\"]`: nothing is known for `{outptu}`",
            ),
            (
                "[on_done]\ncommand = [\"x\"]\ntime_limit = \"soon\"".into(),
                "line 5, `time_limit = \"soon\"`: `soon` is not a duration",
            ),
        ] {
            let error = read_from(&lines).unwrap_err();
            assert!(error.starts_with(words), "{words}: {error}");
        }
        let many: String = (0..17).map(|n| format!("[[webhook]]\nurl = \"http://farm:{}/\"\n", 9000 + n)).collect();
        assert!(read_from(&many).unwrap_err().contains("more than 16 webhooks"));
    }

    #[test]
    fn other_braces_are_what_they_are() {
        let of = |word| placeholders(word).collect::<Vec<_>>();
        assert_eq!(of("{output}.gcode {job}"), ["output", "job"]);
        assert_eq!(of("{\"a\": {}} {A} } {"), Vec::<&str>::new());
    }
}
