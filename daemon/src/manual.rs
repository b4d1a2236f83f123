//! `suture completions` and `suture man`: both made of the command line itself, so that they say what it takes.

use clap::{Command, CommandFactory};

use crate::cli::Cli;
use crate::cli::service::{CompletionsArgs, ManArgs};
use crate::exit::Exit;
use crate::say::{complain, print};

/// Words for a shell that completes commands.
pub(crate) fn completions(args: &CompletionsArgs) -> Exit {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "suture", &mut text);
    print(&text, Exit::Good)
}

/// A page of the manual.
pub(crate) fn man(args: &ManArgs) -> Exit {
    match page(&args.command) {
        Ok(text) => print(&text, Exit::Good),
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

fn page(words: &[String]) -> Result<Vec<u8>, String> {
    let mut command = Cli::command();
    command.build();
    let (mut name, mut found) = (String::from("suture"), command);
    for word in words {
        let next = found.find_subcommand(word).filter(|below| !below.is_hide_set()).cloned();
        found = next.ok_or_else(|| format!("there is no command `{name} {word}`; `suture --help` names all"))?;
        name += &format!("-{}", found.get_name());
    }
    let mut text = Vec::new();
    clap_mangen::Man::new(with_aliases(found).mut_subcommands(with_aliases))
        .render(&mut text)
        .map_err(|error| format!("the page cannot be made: {error}"))?;
    Ok(text)
}

/// Names a command's other names where it is told of, since pages leave them out.
fn with_aliases(command: Command) -> Command {
    let aliases: Vec<_> = command.get_visible_aliases().map(|alias| format!("`{alias}`")).collect();
    match command.get_about() {
        Some(about) if !aliases.is_empty() => {
            let about = format!("{about} (also called {})", aliases.join(", "));
            command.about(about)
        }
        _ => command,
    }
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;
    use clap_complete::Shell;

    use super::*;

    /// Names of commands that people see, as words behind `suture`.
    fn commands() -> Vec<Vec<String>> {
        fn below(command: &Command, before: &[String], all: &mut Vec<Vec<String>>) {
            for next in command.get_subcommands().filter(|next| !next.is_hide_set()) {
                let words = [before, &[next.get_name().to_owned()]].concat();
                all.push(words.clone());
                below(next, &words, all);
            }
        }
        let mut all = Vec::new();
        below(&Cli::command(), &[], &mut all);
        assert!(all.len() > 20 && all.contains(&vec!["jobs".into(), "retry".into()]), "{all:?}");
        all
    }

    #[test]
    fn every_command_has_a_page_and_is_named_above_it() {
        let plain = |words: &[String]| String::from_utf8(page(words).unwrap()).unwrap().replace("\\-", "-");
        for words in commands() {
            let (last, above) = words.split_last().unwrap();
            let own = plain(&words);
            assert!(own.contains(&format!("suture-{}", words.join("-"))), "{words:?}: {own}");
            assert!(plain(above).contains(last.as_str()), "{above:?} does not name {last}");
        }
        assert!(page(&["worker".into()]).is_err(), "it is nobody's");
        assert!(page(&["jobs".into(), "bogus".into()]).unwrap_err().contains("`suture-jobs bogus`"));
    }

    /// `check` is the name that people look for.
    #[test]
    fn another_name_of_a_command_leads_to_its_page() {
        assert_eq!(page(&["check".into()]), page(&["inspect".into()]));
        for words in [vec![], vec!["inspect".into()]] {
            assert!(String::from_utf8(page(&words).unwrap()).unwrap().contains("(also called `check`)"), "{words:?}");
        }
        for shell in Shell::value_variants() {
            let mut text = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "suture", &mut text);
            let text = String::from_utf8(text).unwrap();
            assert!(text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "check"), "{shell}");
        }
    }

    #[test]
    fn every_shell_knows_every_command() {
        for shell in Shell::value_variants() {
            let mut text = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "suture", &mut text);
            let text = String::from_utf8(text).unwrap();
            for words in commands() {
                assert!(words.iter().all(|word| text.contains(word.as_str())), "{shell}: {words:?}");
            }
        }
    }
}
