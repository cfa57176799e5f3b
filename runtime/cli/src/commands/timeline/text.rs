//! A story for people.

use qcbus_messages::shown;
use qcbus_openscenario::story::{End, Sentence, Story};

use crate::talk;

/// Maximum number of unknown parts of the storyboard that are listed.
const MOST_GAPS: usize = 10;

/// Returns the story as text. Only colours in it are control codes.
pub(super) fn of(story: &Story) -> String {
    let mut lines = vec![
        match story.openings.is_empty() && story.globals.is_empty() {
            true => "Init: no entities and no global actions".to_owned(),
            false => "Init".to_owned(),
        },
    ];
    let openings = story.openings.iter();
    lines.extend(openings.map(|it| plain(&format!("  `{}`: {}", it.entity, it.sentence()))));
    if !story.globals.is_empty() {
        lines.push(plain(&format!(
            "  global: `{}`",
            story.globals.join("`, `")
        )));
    }
    if !story.is_timed {
        lines.extend(gaps(story));
    }
    for (element, sentence) in story.elements.iter().zip(story.sentences()) {
        if element.depth == 0 {
            lines.push(String::new());
        }
        lines.push(format!("{}{}", "  ".repeat(element.depth), line(&sentence)));
    }
    lines.push(String::new());
    lines.push(run(&story.end));
    lines.join("\n") + "\n"
}

fn line(sentence: &Sentence) -> String {
    const NEVER: &str = "never starts";
    let facts = plain(&sentence.facts());
    let facts = match facts.strip_prefix(NEVER) {
        Some(rest) => format!("{}{rest}", red(NEVER)),
        None => facts,
    };
    let colon = if facts.is_empty() { "" } else { ": " };
    format!("{}{colon}{facts}", bold(&sentence.head))
}

fn gaps(story: &Story) -> Vec<String> {
    let mut lines = vec![
        String::new(),
        "The times are unknown, because a part of the storyboard is unknown:".to_owned(),
    ];
    let listed = story.gaps.iter().take(MOST_GAPS);
    lines.extend(listed.map(|gap| plain(&format!("  {}: {}", gap.place, gap.text))));
    match story.gaps.len().saturating_sub(MOST_GAPS) {
        0 => {}
        more => lines.push(format!("  and {more} more")),
    }
    lines
}

fn run(end: &End) -> String {
    let (head, rest) = end.sentence();
    let head = match head.as_str() {
        "" => String::new(),
        head if end.standard.is_never() => red(head),
        head => bold(head),
    };
    format!("{head}{}", plain(&rest))
}

fn bold(text: &str) -> String {
    painted("1", text)
}

fn red(text: &str) -> String {
    painted("1;91", text)
}

fn painted(code: &str, text: &str) -> String {
    match talk::color() {
        true => format!("\u{1b}[{code}m{}\u{1b}[0m", plain(text)),
        false => plain(text),
    }
}

/// Returns a text of the file without control codes.
fn plain(text: &str) -> String {
    shown::line(text).into_owned()
}
