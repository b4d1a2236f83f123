//! `suture top`: the status anew each second, on a terminal, until `q` or Ctrl-C. The screen is as it was before, afterwards.

use std::io::{self, IsTerminal, Read, Write};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcgetwinsize, tcsetattr};

use super::{screen, unknown};
use crate::cli::service::TopArgs;
use crate::exit::Exit;
use crate::reach;
use crate::say::complain;
use crate::signals::Stop;

const EVERY: Duration = Duration::from_secs(1);
/// How often a wait looks for a signal.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Another screen, without a cursor; and back.
const BEGIN: &str = "\x1b[?1049h\x1b[?25l";
const END: &str = "\x1b[?25h\x1b[?1049l";
/// A terminal that does not say how large it is.
const USUAL: (u16, u16) = (24, 80);

/// Shows it until someone has seen enough.
pub(crate) fn run(args: &TopArgs) -> Exit {
    if !io::stdout().is_terminal() || !io::stdin().is_terminal() {
        complain(&"this needs a terminal; `suture status` says the same once");
        return Exit::Refused;
    }
    let shown = Stop::listen().and_then(|stop| {
        let _raw = Raw::begin()?;
        show(args, &stop)
    });
    match shown {
        Ok(()) => Exit::Good,
        Err(error) => {
            complain(&format_args!("the terminal cannot be written to: {error}"));
            Exit::Cut
        }
    }
}

fn show(args: &TopArgs, stop: &Stop) -> io::Result<()> {
    loop {
        let text = match reach::glance(&args.dir, None) {
            Ok(glance) => screen(&args.dir, None, &glance),
            Err(failure) => unknown(&args.dir, &failure.line),
        };
        let (rows, columns) = size();
        let mut out = io::stdout().lock();
        out.write_all(page(&text, rows, columns).as_bytes())?;
        out.flush()?;
        let mut waited = Duration::ZERO;
        while waited < EVERY {
            if stop.asked() || asked_to_end() {
                return Ok(());
            }
            waited += LOOK_EVERY;
        }
    }
}

/// Rows and columns.
fn size() -> (usize, usize) {
    let said = tcgetwinsize(io::stdout()).map(|size| (size.ws_row, size.ws_col)).unwrap_or(USUAL);
    let (rows, columns) = if said.0 == 0 || said.1 == 0 { USUAL } else { said };
    (rows.into(), columns.into())
}

/// The text from the upper left corner on, over whatever stood there: lines that are longer than the terminal is wide go on in the next row, and
/// what does not fit below is left out.
fn page(text: &str, rows: usize, columns: usize) -> String {
    let wrapped = text.lines().flat_map(|line| {
        let line: Vec<char> = line.chars().collect();
        let pieces = line.chunks(columns.max(1)).map(|piece| piece.iter().collect()).collect::<Vec<String>>();
        if pieces.is_empty() { vec![String::new()] } else { pieces }
    });
    // Behind a full row, the cursor stands on its last letter: nothing is wiped from there on.
    let end = |row: &str| if row.chars().count() < columns { "\x1b[K" } else { "" };
    let shown: Vec<String> = wrapped.take(rows).map(|row| format!("{row}{}", end(&row))).collect();
    let below = match shown.len() {
        0 => "\x1b[J",
        fewer if fewer < rows => "\n\x1b[J",
        _ => "",
    };
    format!("\x1b[H{}{below}", shown.join("\n"))
}

/// Waits a while for a key. Is it one that ends this, or is there no one any more?
fn asked_to_end() -> bool {
    let stdin = io::stdin();
    let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(LOOK_EVERY.subsec_nanos()) };
    let pressed = poll(&mut [PollFd::new(&stdin, PollFlags::IN)], Some(&wait));
    if !pressed.is_ok_and(|ready| ready > 0) {
        return false;
    }
    let mut keys = [0; 64];
    let read = stdin.lock().read(&mut keys).unwrap_or(0);
    read == 0 || keys.iter().take(read).any(|key| matches!(key, b'q' | b'Q' | 3))
}

/// A terminal that passes keys on as they are pressed, and shows none.
struct Raw(Termios);

impl Raw {
    fn begin() -> io::Result<Self> {
        let before = tcgetattr(io::stdin())?;
        let mut raw = before.clone();
        // Ctrl-C stays a signal.
        raw.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        tcsetattr(io::stdin(), OptionalActions::Now, &raw)?;
        let begun = Self(before);
        io::stdout().write_all(BEGIN.as_bytes())?;
        Ok(begun)
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        let _ = io::stdout().write_all(END.as_bytes());
        let _ = io::stdout().flush();
        let _ = tcsetattr(io::stdin(), OptionalActions::Now, &self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_fits_its_terminal() {
        assert_eq!(page("one\nzwölf\nthree\n", 2, 4), "\x1b[Hone\x1b[K\nzwöl");
        assert_eq!(page("zwölf\n\nx", 9, 4), "\x1b[Hzwöl\nf\x1b[K\n\x1b[K\nx\x1b[K\n\x1b[J");
        assert_eq!(page("", 2, 4), "\x1b[H\x1b[J");
    }
}
