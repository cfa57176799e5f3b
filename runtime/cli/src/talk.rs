//! What people see: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use qcbus_messages::{Exit, shown};

use crate::args::ColorArg;

/// Whether something that was to be printed did not get out.
static LOST: AtomicBool = AtomicBool::new(false);

/// Prints to stdout, as it is: names and reasons of others have been escaped before. A reader that has
/// left (a closed pipe) is no error of ours; a disk that is full is, see [`exit`].
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) else {
        return;
    };
    if error.kind() != io::ErrorKind::BrokenPipe && !LOST.swap(true, Ordering::Relaxed) {
        fail(&format!("cannot write to stdout: {error}"));
    }
}

/// The exit code: what was to be printed and is lost is no success, whatever the verdict.
pub fn exit(exit: Exit) -> Exit {
    if LOST.load(Ordering::Relaxed) {
        Exit::Internal
    } else {
        exit
    }
}

/// Says one line on stderr, whatever is in the text.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", shown::line(text));
}

/// Says several lines on stderr. What others have named must be on one line already.
pub fn say_lines(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", shown::lines(text));
}

/// Says what failed on stderr, in one line.
pub fn fail(text: &str) {
    say(&format!("error: {text}"));
}

/// What somebody wants of colours: nothing, all, none.
static COLOR: AtomicU8 = AtomicU8::new(ColorArg::Auto as u8);

/// Takes what somebody wants of colours.
pub fn set_color(wanted: ColorArg) {
    COLOR.store(wanted as u8, Ordering::Relaxed);
}

/// Whether stdout may be coloured.
pub fn color() -> bool {
    let wanted = COLOR.load(Ordering::Relaxed);
    let plain = || std::env::var_os("NO_COLOR").is_some_and(|it| !it.is_empty());
    if wanted == ColorArg::Auto as u8 {
        io::stdout().is_terminal() && !plain()
    } else {
        wanted == ColorArg::Always as u8
    }
}

/// Columns of the terminal, or the reporters' default.
pub fn width() -> usize {
    let columns = rustix::termios::tcgetwinsize(io::stdout()).map(|size| usize::from(size.ws_col));
    columns
        .ok()
        .filter(|columns| *columns >= 40)
        .unwrap_or(qcbus_report_text::DEFAULT_WIDTH)
}

/// A line on stderr that is written over and over while something goes on, on terminals only.
#[derive(Debug)]
pub struct Progress {
    shown: bool,
    enabled: bool,
}

impl Progress {
    /// Shows nothing unless stderr is a terminal.
    pub fn new(enabled: bool) -> Progress {
        Progress {
            shown: false,
            enabled: enabled && io::stderr().is_terminal(),
        }
    }

    /// Shows how far things are.
    pub fn show(&mut self, text: &str) {
        if self.enabled {
            let _ = write!(io::stderr().lock(), "\r\x1b[2K{text}");
            self.shown = true;
        }
    }

    /// Removes the line, so that something else can be said.
    pub fn clear(&mut self) {
        if self.shown {
            let _ = write!(io::stderr().lock(), "\r\x1b[2K");
            self.shown = false;
        }
    }
}

/// Stderr for events: each is one line, whatever names and reasons of others are in it.
struct LogLines;

impl Write for LogLines {
    /// Takes one event as the formatter has written it, with its line end.
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let text = text.trim_end_matches('\n');
        let line = if io::stderr().is_terminal() {
            coloured_line(text)
        } else {
            shown::line(text).into_owned()
        };
        writeln!(io::stderr().lock(), "{line}")?;
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// The text on one line, with its colours: the formatter's own, for it lets none of an event through.
fn coloured_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for (number, part) in text.split('\u{1b}').enumerate() {
        let parameters = |c: char| c.is_ascii_digit() || c == ';' || c == '[';
        let is_colour =
            part.starts_with('[') && part.trim_start_matches(parameters).starts_with('m');
        match number {
            0 => {}
            _ if is_colour => line.push('\u{1b}'),
            _ => line.push_str("\\u{1b}"),
        }
        line.push_str(&shown::line(part));
    }
    line
}

/// Sends log events to stderr. `QCBUS_LOG` sets what is logged (`info`, `qcbus_bus=debug`, …) and
/// `QCBUS_LOG_FORMAT=json` how.
pub fn log(default: &str) {
    use tracing_subscriber::EnvFilter;
    let filter = EnvFilter::try_from_env("QCBUS_LOG").unwrap_or_else(|_| EnvFilter::new(default));
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        // Where nobody reads the log any more, there is nobody to tell, and no reason to end.
        .log_internal_errors(false)
        .with_writer(|| LogLines);
    let json = std::env::var("QCBUS_LOG_FORMAT").is_ok_and(|it| it == "json");
    // A second subscriber cannot be set; the first stays then.
    let _ = if json {
        tracing::subscriber::set_global_default(builder.json().finish())
    } else {
        tracing::subscriber::set_global_default(
            builder.with_ansi(io::stderr().is_terminal()).finish(),
        )
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_line_keeps_its_colours_and_nothing_else_that_steers() {
        for (text, line) in [
            ("plain", "plain"),
            ("\u{1b}[2mdim\u{1b}[0m", "\u{1b}[2mdim\u{1b}[0m"),
            ("\u{1b}[1;32mgreen", "\u{1b}[1;32mgreen"),
            ("\u{1b}[2Kgone\u{1b}", "\\u{1b}[2Kgone\\u{1b}"),
            ("a\nb\u{202e}c", "a\\nb\\u{202e}c"),
            ("\\u{1b}[2K", "\\u{1b}[2K"),
        ] {
            assert_eq!(coloured_line(text), line);
        }
    }
}
