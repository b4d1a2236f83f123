//! Text for people. Names of files may hold anything, a terminal's commands and line breaks included: whatever leaves for a terminal goes
//! through here, and a test searches the sources for other ways.

use std::fmt::Display;
use std::io::{ErrorKind, Write};

use crate::exit::Exit;

/// One line in which every control character is spelled out, and nothing is done.
pub(crate) fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        // Marks that turn the direction of what follows are as misleading as a terminal's commands.
        let turns = matches!(c, '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
        if c.is_control() || turns { out.extend(c.escape_default()) } else { out.push(c) }
    }
    out
}

/// Says on standard error what stands in the way. A standard error that is closed is no reason to fail.
pub(crate) fn complain(line: &dyn Display) {
    let _ = writeln!(std::io::stderr(), "suture: {}", plain(&line.to_string()));
}

/// Prints what was asked for, whole, and ends with `exit`. A reader that has gone away has seen enough, but a full disk is no reader.
pub(crate) fn print(text: &[u8], exit: Exit) -> Exit {
    let mut out = std::io::stdout().lock();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            complain(&format_args!("standard output cannot be written: {error}; try again"));
            Exit::TryAgain
        }
        _ => exit,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// D9: a name can neither clear a terminal nor pretend to be another line.
    #[test]
    fn control_characters_are_spelled_out() {
        assert_eq!(plain("a\u{1b}[2Jb\nc\td\u{9b}e\u{202e}f"), r"a\u{1b}[2Jb\nc\td\u{9b}e\u{202e}f");
        assert_eq!(plain("Größe 50 % → part.stl"), "Größe 50 % → part.stl");
    }

    #[test]
    fn nothing_else_prints() {
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        for entry in std::fs::read_dir(sources).unwrap().flatten() {
            let text = std::fs::read_to_string(entry.path()).unwrap_or_default();
            let product = text.split("#[cfg(test)]").next().unwrap();
            let name = entry.file_name();
            assert!(name == "say.rs" || !product.contains("println!"), "{name:?} prints by itself");
        }
    }
}
