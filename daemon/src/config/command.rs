//! `suture config`: is a configuration file right, and what does it come to?

use std::path::Path;

use super::{Config, read, show};
use crate::cli::ConfigCommand;
use crate::exit::Exit;
use crate::say::{complain, plain, print};

/// The folder that a configuration is shown for where no file is named.
const EXAMPLE: &str = "prints";

/// Does what the command line asks.
pub(crate) fn run(command: &ConfigCommand) -> Exit {
    let text = match command {
        ConfigCommand::Check { file } => read::whole(file).map(|config| plain(&found(file, &config)) + "\n"),
        ConfigCommand::Print { file: Some(file) } => read::whole(file).and_then(|config| show::text(&config)),
        ConfigCommand::Print { file: None } => show::text(&Config::for_folder(Path::new(EXAMPLE))),
    };
    match text {
        Ok(text) => print(text.as_bytes(), Exit::Good),
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

/// What a good configuration has, in one line.
fn found(file: &Path, config: &Config) -> String {
    let folders = config.folders.iter().map(|folder| folder.name.as_str());
    let profiles = config.profiles.keys().map(String::as_str);
    format!("{}: good: {}, {}", file.display(), counted("folder", folders), counted("profile", profiles))
}

/// How many, and which.
fn counted<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    match names.as_slice() {
        [] => format!("no {what} of its own"),
        [one] => format!("1 {what} ({one})"),
        several => format!("{} {what}s ({})", several.len(), several.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_good_file_is_one_line() {
        let mut config = Config::for_folder(Path::new("/srv/prints"));
        let line = |config: &Config| found(Path::new("s.toml"), config);
        assert_eq!(line(&config), "s.toml: good: 1 folder (prints), no profile of its own");
        for name in ["resin", "thin"] {
            config.profiles.insert(name.into(), crate::own_profile::OwnProfile::default());
        }
        assert_eq!(line(&config), "s.toml: good: 1 folder (prints), 2 profiles (resin, thin)");
    }
}
