//! Output for people: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use qcbus_messages::{Exit, shown};

use crate::args::ColorArg;

/// Whether output to stdout was lost.
static LOST: AtomicBool = AtomicBool::new(false);

/// Prints to stdout without changes; names and reasons from others must already be escaped. A
/// closed pipe is not an error, but a full disk is, see [`exit`].
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) else {
        return;
    };
    if error.kind() != io::ErrorKind::BrokenPipe && !LOST.swap(true, Ordering::Relaxed) {
        fail(&format!("cannot write to stdout: {error}"));
    }
}

/// Returns the exit code. Lost output is an error, whatever the verdict.
pub fn exit(exit: Exit) -> Exit {
    if LOST.load(Ordering::Relaxed) {
        Exit::Internal
    } else {
        exit
    }
}

/// Prints one line on stderr, whatever the text contains.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", shown::line(text));
}

/// Prints several lines on stderr. Names from others must already be on one line.
pub fn say_lines(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", shown::lines(text));
}

/// Prints an error on stderr, in one line.
pub fn fail(text: &str) {
    say(&format!("error: {text}"));
}

/// Requested use of colours: automatic, always or never.
static COLOR: AtomicU8 = AtomicU8::new(ColorArg::Auto as u8);

/// Sets the requested use of colours.
pub fn set_color(wanted: ColorArg) {
    COLOR.store(wanted as u8, Ordering::Relaxed);
}

/// Checks whether stdout may be coloured.
pub fn color() -> bool {
    let wanted = COLOR.load(Ordering::Relaxed);
    let plain = || std::env::var_os("NO_COLOR").is_some_and(|it| !it.is_empty());
    if wanted == ColorArg::Auto as u8 {
        io::stdout().is_terminal() && !plain()
    } else {
        wanted == ColorArg::Always as u8
    }
}

/// Returns the columns of the terminal, or the default of the reporters.
pub fn width() -> usize {
    let columns = rustix::termios::tcgetwinsize(io::stdout()).map(|size| usize::from(size.ws_col));
    columns
        .ok()
        .filter(|columns| *columns >= 40)
        .unwrap_or(qcbus_report_text::DEFAULT_WIDTH)
}

/// Progress line on stderr that is overwritten repeatedly. It appears on terminals only.
#[derive(Debug)]
pub struct Progress {
    shown: bool,
    enabled: bool,
}

impl Progress {
    /// Creates a progress line. It is shown only if stderr is a terminal.
    pub fn new(enabled: bool) -> Progress {
        Progress {
            shown: false,
            enabled: enabled && io::stderr().is_terminal(),
        }
    }

    /// Shows the current progress.
    pub fn show(&mut self, text: &str) {
        if self.enabled {
            let _ = write!(io::stderr().lock(), "\r\x1b[2K{text}");
            self.shown = true;
        }
    }

    /// Removes the line, so that other output can follow.
    pub fn clear(&mut self) {
        if self.shown {
            let _ = write!(io::stderr().lock(), "\r\x1b[2K");
            self.shown = false;
        }
    }
}

/// Writer of log events to stderr. Each event is one line, whatever names and reasons it contains.
struct LogLines;

impl Write for LogLines {
    /// Writes one event as the formatter has formatted it, with its line end.
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

/// Returns the text on one line and keeps the colours of the formatter. The formatter itself
/// escapes those in an event.
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

/// Sends log events to stderr. `QCBUS_LOG` sets the filter (`info`, `qcbus_bus=debug`, …) and
/// `QCBUS_LOG_FORMAT=json` the format.
pub fn log(default: &str) {
    use tracing::subscriber::set_global_default;
    use tracing_subscriber::filter::Targets;
    use tracing_subscriber::layer::SubscriberExt;
    use tracing_subscriber::{fmt, registry};
    let asked = std::env::var("QCBUS_LOG").ok();
    let asked = asked.and_then(|it| it.parse::<Targets>().ok());
    let filter = asked.or_else(|| default.parse().ok()).unwrap_or_default();
    let lines = fmt::layer()
        // A failed write to stderr cannot be reported and is no reason to end.
        .log_internal_errors(false)
        .with_writer(|| LogLines);
    let json = std::env::var("QCBUS_LOG_FORMAT").is_ok_and(|it| it == "json");
    // A second subscriber cannot be set; the first one remains.
    let _ = if json {
        set_global_default(registry().with(lines.json()).with(filter))
    } else {
        let lines = lines.with_ansi(io::stderr().is_terminal());
        set_global_default(registry().with(lines).with(filter))
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_line_keeps_colours_but_no_other_control_codes() {
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
