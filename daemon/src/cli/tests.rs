use super::meshes::PROFILE_HELP;
use super::*;
use clap::CommandFactory;

#[test]
fn the_command_line_is_well_formed() {
    Cli::command().debug_assert();
}

/// Whoever adds a profile tells of it wherever the others are told of.
#[test]
fn every_profile_is_told_of() {
    let readme = include_str!("../../../README.md");
    for name in suture_core::Profile::BUILT_IN {
        let starts = |text: &str, with: &str| text.lines().any(|line| line.starts_with(with));
        assert!(starts(PROFILE_HELP, &format!("{name} ")), "{name}");
        assert!(starts(readme, &format!("| `{name}` |")), "{name}");
        let command = Cli::command();
        let profile = |command: &clap::Command| {
            let argument = command.get_arguments().find(|argument| argument.get_id() == "profile");
            argument.and_then(|argument| argument.get_help()).map(ToString::to_string)
        };
        for short in ["repair", "inspect"].map(|name| command.find_subcommand(name).and_then(profile)) {
            assert!(short.is_some_and(|help| help.contains(&format!(" {name},"))), "{name}");
        }
        let watch = command.find_subcommand("watch").and_then(clap::Command::get_long_about).map(ToString::to_string);
        assert!(watch.is_some_and(|text| text.contains(&format!(" {name},"))), "{name}");
    }
}

#[test]
fn a_state_that_is_none_is_refused() {
    assert!(Cli::try_parse_from(["suture", "jobs", "list", "--state", "needs-review"]).is_ok());
    let error = Cli::try_parse_from(["suture", "jobs", "list", "--state", "bogus"]).unwrap_err().to_string();
    assert!(error.contains("no job is ever `bogus`") && error.contains("needs-review"), "{error}");
}

#[test]
fn watch_takes_a_folder_or_a_configuration_but_one_of_them() {
    assert!(Cli::try_parse_from(["suture", "watch"]).is_err());
    assert!(Cli::try_parse_from(["suture", "watch", "d", "--config", "c"]).is_err());
    assert!(Cli::try_parse_from(["suture", "watch", "--config", "c", "--once"]).is_ok());
}
