//! What people see: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};

/// Prints to stdout. A reader that has left (a closed pipe) is no error of ours.
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Says one line on stderr.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Says what failed on stderr.
pub fn fail(text: &str) {
    say(&format!("error: {text}"));
}

/// Whether stdout may be coloured.
pub fn color() -> bool {
    io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|it| it.is_empty())
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

/// Sends log events to stderr. `QCBUS_LOG` sets what is logged (`info`, `qcbus_bus=debug`, …) and
/// `QCBUS_LOG_FORMAT=json` how.
pub fn log(default: &str) {
    use tracing_subscriber::EnvFilter;
    let filter = EnvFilter::try_from_env("QCBUS_LOG").unwrap_or_else(|_| EnvFilter::new(default));
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        // Where nobody reads the log any more, there is nobody to tell, and no reason to end.
        .log_internal_errors(false)
        .with_writer(io::stderr);
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
