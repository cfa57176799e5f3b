//! Handling of untrusted text in messages.

use qcbus_reporter_sdk::{one_line, printable};

/// Maximum number of characters of a message: enough for people, and a limit for hostile files.
const LONGEST_MESSAGE: usize = 2000;

/// Maximum number of characters of a rule's description at GitHub.
const LONGEST_DESCRIPTION: usize = 1024;

/// Returns a message: one line of plain text. SARIF plain text can hold links, `[text](target)`
/// (3.11.6); untrusted text must not create one. Braces stay, because they are placeholders only in
/// messages with arguments.
pub(crate) fn message(text: &str) -> String {
    match short(&one_line(text), LONGEST_MESSAGE) {
        text if text.is_empty() => "(no description)".to_owned(),
        text => text.replace("](", "] ("),
    }
}

/// Returns a description of a rule: a message within GitHub's length limit.
pub(crate) fn description(text: &str) -> String {
    short(&message(text), LONGEST_DESCRIPTION)
}

/// Returns the text of a rule page, which may have several lines.
pub(crate) fn page(text: &str) -> String {
    printable(text)
}

/// Returns a name, such as the id of a rule: one line without spaces at its ends.
pub(crate) fn name(text: &str) -> String {
    short(&one_line(text), LONGEST_DESCRIPTION)
}

fn short(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        // The ellipsis counts as one of the characters.
        Some(_) => {
            let kept: String = text.chars().take(most.saturating_sub(1)).collect();
            format!("{}…", kept.trim_end())
        }
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_text_cannot_steer_terminal_or_add_links() {
        assert_eq!(
            message("a\u{1b}[2K\n b [x](http://e) {0}"),
            "a\u{FFFD}[2K b [x] (http://e) {0}"
        );
        assert_eq!(message(" \n"), "(no description)");
    }

    #[test]
    fn long_message_ends_with_ellipsis() {
        let long = message(&"ü".repeat(5000));
        assert_eq!(long.chars().count(), LONGEST_MESSAGE);
        assert!(long.ends_with("ü…"));
        assert_eq!(description(&"ü".repeat(1024)), "ü".repeat(1024));
    }
}
