//! Writes the findings of rules into their pages.

use super::Example;

/// Returns a page with the `issues` blocks of some examples replaced, inserted, or (when empty)
/// removed.
pub(super) fn blessed(page: &str, found: &[(&Example, String)]) -> String {
    let mut lines: Vec<String> = page.lines().map(str::to_owned).collect();
    for (example, issues) in found.iter().rev() {
        let range = example.expected_lines.clone();
        let is_new = range.is_empty();
        let block = (!issues.is_empty()).then(|| {
            let blank = is_new.then(String::new);
            let body = issues.lines().map(str::to_owned);
            blank
                .into_iter()
                .chain(["```issues".to_owned()])
                .chain(body)
                .chain(["```".to_owned()])
        });
        lines.splice(range, block.into_iter().flatten());
    }
    lines
        .iter()
        .flat_map(|line| [line.as_str(), "\n"])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::Page;
    use super::*;

    #[test]
    fn blocks_are_inserted_and_replaced_in_place() {
        let text = "# T\n\nS.\n\n```xml bad\n<a/>\n```\n\n```xml bad\n<b/>\n```\n\n```issues\nold\n```\n\nEnd.\n";
        let page = Page::parse(text).unwrap();
        let found = [
            (&page.examples[0], "one\n".to_owned()),
            (&page.examples[1], "two\n".to_owned()),
        ];
        let expected = "# T\n\nS.\n\n```xml bad\n<a/>\n```\n\n```issues\none\n```\n\n```xml bad\n<b/>\n```\n\n```issues\ntwo\n```\n\nEnd.\n";
        let blessed = blessed(text, &found);
        assert_eq!(blessed, expected);
        let again = Page::parse(&blessed).unwrap();
        assert_eq!(again.examples[0].expected.as_deref(), Some("one\n"));
    }
}
