//! A test runner of workflow commands. It reads both forms from the lines of a log.

use std::collections::BTreeMap;

use qcbus_report_github::MOST_ANNOTATIONS;

/// Commands that a current runner executes.
const KNOWN: &[&str] = &[
    "add-mask",
    "add-matcher",
    "add-path",
    "debug",
    "echo",
    "endgroup",
    "error",
    "group",
    "notice",
    "remove-matcher",
    "save-state",
    "set-env",
    "set-output",
    "stop-commands",
    "warning",
];

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command {
    pub name: String,
    pub properties: BTreeMap<String, String>,
    pub data: String,
}

/// Returns the commands that a runner executes in a report. Asserts that groups end, and that the
/// number of annotations is allowed.
pub fn run(report: &str) -> Vec<Command> {
    assert!(
        !report.contains('\r'),
        "a runner also ends lines at carriage returns"
    );
    let commands: Vec<Command> = report.lines().filter_map(command).collect();
    let mut open = false;
    for command in &commands {
        match command.name.as_str() {
            "group" | "endgroup" => {
                assert_eq!(open, command.name == "endgroup", "{command:?}");
                open = !open;
            }
            "error" | "warning" | "notice" => assert!(!open, "{command:?}"),
            _ => panic!("unexpected command {command:?}"),
        }
    }
    assert!(!open, "every group must end");
    for level in ["error", "warning", "notice"] {
        let count = commands.iter().filter(|it| it.name == level).count();
        assert!(
            count <= MOST_ANNOTATIONS,
            "{count} annotations of level {level}"
        );
    }
    commands
}

/// Returns the command of a line. Runners compare strings by the rules of a language, in which
/// invisible characters do not count.
fn command(line: &str) -> Option<Command> {
    let unseen = |c| {
        matches!(c, '\u{ad}' | '\u{34f}' | '\u{180e}' | '\u{200b}'..='\u{200f}'
            | '\u{2060}'..='\u{206f}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}' | '\u{e0000}'..='\u{e0fff}')
    };
    let seen = line.replace(unseen, "");
    newer(&seen).or_else(|| older(&seen))
}

/// Parses `::name key=value,key=value::data`, after blanks.
fn newer(line: &str) -> Option<Command> {
    let inside = line.trim_start().strip_prefix("::")?;
    let (head, data) = inside.split_once("::")?;
    let data = plain(data, &[("%0D", "\r"), ("%0A", "\n"), ("%25", "%")]);
    with_head(head, ',', data, |value| {
        let codes = [
            ("%0D", "\r"),
            ("%0A", "\n"),
            ("%3A", ":"),
            ("%2C", ","),
            ("%25", "%"),
        ];
        plain(value, &codes)
    })
}

/// Parses `##[name key=value;key=value]data`, anywhere in the line.
fn older(line: &str) -> Option<Command> {
    let (_, inside) = line.split_once("##[")?;
    let (head, data) = inside.split_once(']')?;
    with_head(head, ';', data.to_owned(), str::to_owned)
}

fn with_head(
    head: &str,
    comma: char,
    data: String,
    value: impl Fn(&str) -> String,
) -> Option<Command> {
    let (name, properties) = head.split_once(' ').unwrap_or((head, ""));
    let known = KNOWN.iter().any(|it| it.eq_ignore_ascii_case(name));
    let pairs = properties.trim().split(comma);
    let pairs = pairs.filter_map(|pair| pair.split_once('='));
    known.then(|| Command {
        name: name.to_owned(),
        properties: pairs.map(|(k, v)| (k.to_owned(), value(v))).collect(),
        data,
    })
}

fn plain(text: &str, codes: &[(&str, &str)]) -> String {
    codes
        .iter()
        .fold(text.to_owned(), |text, (code, c)| text.replace(code, c))
}
