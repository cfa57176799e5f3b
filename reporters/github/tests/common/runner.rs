//! A runner of workflow commands: both forms, as a runner reads them from the lines of a log.

use std::collections::BTreeMap;

use qcbus_report_github::MOST_ANNOTATIONS;

/// What a runner of today obeys.
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

/// What a runner obeys in a report: groups that end, and as many annotations as it takes.
pub fn run(report: &str) -> Vec<Command> {
    assert!(!report.contains('\r'), "a runner ends lines there as well");
    let commands: Vec<Command> = report.lines().filter_map(command).collect();
    let mut open = false;
    for command in &commands {
        match command.name.as_str() {
            "group" | "endgroup" => {
                assert_eq!(open, command.name == "endgroup", "{command:?}");
                open = !open;
            }
            "error" | "warning" | "notice" => assert!(!open, "{command:?}"),
            _ => panic!("nobody asked for {command:?}"),
        }
    }
    assert!(!open, "a group has no end");
    for level in ["error", "warning", "notice"] {
        let count = commands.iter().filter(|it| it.name == level).count();
        assert!(count <= MOST_ANNOTATIONS, "{count} of {level}");
    }
    commands
}

/// The command of a line. Strings are compared by the rules of a language, where characters that
/// nobody sees do not count.
fn command(line: &str) -> Option<Command> {
    let unseen = |c| {
        matches!(c, '\u{ad}' | '\u{34f}' | '\u{180e}' | '\u{200b}'..='\u{200f}'
            | '\u{2060}'..='\u{206f}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}' | '\u{e0000}'..='\u{e0fff}')
    };
    let seen = line.replace(unseen, "");
    newer(&seen).or_else(|| older(&seen))
}

/// `::name key=value,key=value::data`, after blanks.
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

/// `##[name key=value;key=value]data`, anywhere.
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
