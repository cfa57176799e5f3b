//! Optional colours.

use anstyle::{AnsiColor, Style};
use qcbus_formats::xqar::Level;
use qcbus_messages::Verdict;

/// Styling of text, if colours are enabled.
#[derive(Clone, Copy)]
pub(crate) struct Paint {
    color: bool,
}

impl Paint {
    pub(crate) fn new(color: bool) -> Paint {
        Paint { color }
    }

    pub(crate) fn bold(self, text: &str) -> String {
        self.with(Style::new().bold(), text)
    }

    /// Styles lines, arrows and row numbers.
    pub(crate) fn frame(self, text: &str) -> String {
        self.with(AnsiColor::BrightBlue.on_default().bold(), text)
    }

    pub(crate) fn level(self, level: Level, text: &str) -> String {
        self.with(color_of(level).on_default().bold(), text)
    }

    pub(crate) fn verdict(self, verdict: Verdict, text: &str) -> String {
        let color = match verdict {
            Verdict::Accepted => AnsiColor::BrightGreen,
            Verdict::Rejected => AnsiColor::BrightRed,
            Verdict::Undetermined => AnsiColor::BrightMagenta,
        };
        self.with(color.on_default().bold(), text)
    }

    fn with(self, style: Style, text: &str) -> String {
        if self.color && !text.is_empty() {
            format!("{style}{text}{style:#}")
        } else {
            text.to_owned()
        }
    }
}

fn color_of(level: Level) -> AnsiColor {
    match level {
        Level::Error => AnsiColor::BrightRed,
        Level::Warning => AnsiColor::BrightYellow,
        Level::Information => AnsiColor::BrightCyan,
    }
}
