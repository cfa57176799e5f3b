//! The page of a rule: a text for people, which also has examples that run as tests.
//!
//! A page is Markdown. Its first heading is the title, its first paragraph the summary. The crate
//! `qcbus-rule-tests` reads the examples and runs them.

/// Title and summary of a page, each on one line and empty if it is missing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Head {
    /// The first heading.
    pub title: String,
    /// The first paragraph.
    pub summary: String,
}

impl Head {
    /// Reads the head of a page. Every start of a bundle needs those of all its rules.
    pub fn of(page: &str) -> Head {
        let mut head = Head::default();
        for line in page.lines().map(str::trim) {
            let is_over = line.is_empty() || line.starts_with('#');
            if line.starts_with("```") || (is_over && !head.summary.is_empty()) {
                break;
            }
            match line.strip_prefix("# ") {
                Some(title) if head.title.is_empty() => title.trim().clone_into(&mut head.title),
                _ if is_over || head.title.is_empty() => {}
                _ => {
                    let gap = if head.summary.is_empty() { "" } else { " " };
                    head.summary.extend([gap, line]);
                }
            }
        }
        head
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summary_ends_with_its_paragraph() {
        let of = |text: &str| Head::of(text).summary;
        assert_eq!(
            of("# Title\n\nOne sentence\non two lines.\n\n## Why\n\nBecause.\n"),
            "One sentence on two lines."
        );
        assert_eq!(
            of("\n\n  # T  \n\n\n  One  \n two\n\ntwo\nthree\n"),
            "One two"
        );
        assert_eq!(of("# T\n\nS\n```xml good\n<a/>\n```\nS\nafter it\n"), "S");
        assert_eq!(of("# T\nS\n## Next\nnot S\n"), "S");
        assert_eq!(of("no title"), "");
    }
}
