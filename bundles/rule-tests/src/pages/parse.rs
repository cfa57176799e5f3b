//! Parser of a page.

use qcbus_sdk::pages::Head;

use super::example::Verdict;

/// A parsed page.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Page {
    /// The examples in order of appearance.
    pub examples: Vec<Example>,
}

/// An example and its expected result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Example {
    /// Expected result of the rule.
    pub verdict: Verdict,
    /// `in=NAME`: the template for the text.
    pub template: Option<String>,
    /// `version=1.7`: the version for the template.
    pub version: Option<String>,
    /// `set:NAME=VALUE`: parameters.
    pub params: Vec<(String, String)>,
    /// The root file, and further files from the following `xml also file=…` blocks.
    pub files: Vec<ExampleFile>,
    /// The content of the `issues` block, if there is one.
    pub expected: Option<String>,
    /// Lines of the page, from 0, of the `issues` block, or the place to insert it.
    pub expected_lines: std::ops::Range<usize>,
    /// The line of the opening fence, from 1.
    pub line: usize,
}

/// One file of an example.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExampleFile {
    /// `file=NAME`, if given.
    pub name: Option<String>,
    /// `in=NAME` of a further file.
    pub template: Option<String>,
    /// Content of the file.
    pub text: String,
}

/// Reason why a text is not a valid page.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct PageError {
    /// Line, from 1.
    pub line: usize,
    /// Description of the error and of the expected text.
    pub what: String,
}

impl Page {
    /// Parses a page.
    ///
    /// # Errors
    /// [`PageError`] if the title or the summary is missing, a block is not closed, or the words
    /// after the fence of an example are unknown.
    pub fn parse(text: &str) -> Result<Page, PageError> {
        let mut page = Page::default();
        let lines: Vec<&str> = text.lines().collect();
        let mut at = 0;
        while let Some(line) = lines.get(at) {
            if let Some(info) = line.strip_prefix("```") {
                let close = closing_fence(&lines, at)?;
                let content = content(&lines[at + 1..close]);
                page.block(info, content, at, close)?;
                at = close + 1;
            } else {
                at += 1;
            }
        }
        let missing = |what: &str| {
            Err(PageError {
                line: 1,
                what: what.to_owned(),
            })
        };
        let head = Head::of(text);
        match (head.title.is_empty(), head.summary.is_empty()) {
            (true, _) => missing("a page must begin with a title, `# …`"),
            (_, true) => missing("a sentence under the title must say what the rule requires"),
            _ => Ok(page),
        }
    }

    fn block(
        &mut self,
        info: &str,
        text: String,
        open: usize,
        close: usize,
    ) -> Result<(), PageError> {
        let wrong = |what: String| {
            Err(PageError {
                line: open + 1,
                what,
            })
        };
        let mut words = info.split_whitespace();
        match (words.next(), words.next()) {
            (Some("issues"), _) => match self.examples.last_mut() {
                Some(example) if example.expected.is_none() => {
                    example.expected = Some(text);
                    example.expected_lines = open..close + 1;
                    Ok(())
                }
                _ => wrong("a block of issues must follow its example".to_owned()),
            },
            (Some("xml"), Some("also")) => {
                let Some(example) = self.examples.last_mut() else {
                    return wrong("`xml also` must follow an example".to_owned());
                };
                let (mut name, mut template) = (None, None);
                for word in words {
                    match word.split_once('=') {
                        Some(("file", value)) => name = Some(value.to_owned()),
                        Some(("in", value)) => template = Some(value.to_owned()),
                        _ => return wrong(format!("expected `file=` or `in=`, found `{word}`")),
                    }
                }
                if name.is_none() {
                    return wrong("`xml also` needs `file=NAME`".to_owned());
                }
                example.files.push(ExampleFile {
                    name,
                    template,
                    text,
                });
                example.expected_lines = close + 1..close + 1;
                Ok(())
            }
            (Some("xml"), Some(verdict)) => {
                let verdict = verdict.parse::<Verdict>();
                let example =
                    verdict.and_then(|verdict| Example::of(verdict, words, text, open, close));
                match example {
                    Ok(example) => self.examples.push(example),
                    Err(what) => return wrong(what),
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

impl Example {
    fn of<'w>(
        verdict: Verdict,
        words: impl Iterator<Item = &'w str>,
        text: String,
        open: usize,
        close: usize,
    ) -> Result<Example, String> {
        let mut example = Example {
            verdict,
            template: None,
            version: None,
            params: Vec::new(),
            files: vec![ExampleFile {
                name: None,
                template: None,
                text,
            }],
            expected: None,
            expected_lines: close + 1..close + 1,
            line: open + 1,
        };
        for word in words {
            let (key, value) = word.split_once('=').ok_or_else(|| unknown_word(word))?;
            match key.strip_prefix("set:") {
                Some(name) => example.params.push((name.to_owned(), value.to_owned())),
                None => match key {
                    "in" => example.template = Some(value.to_owned()),
                    "version" => example.version = Some(value.to_owned()),
                    "file" => example.files[0].name = Some(value.to_owned()),
                    _ => return Err(unknown_word(word)),
                },
            }
        }
        Ok(example)
    }
}

fn unknown_word(word: &str) -> String {
    format!("expected `in=`, `version=`, `file=` or `set:NAME=`, found `{word}`")
}

fn closing_fence(lines: &[&str], open: usize) -> Result<usize, PageError> {
    let after = lines
        .iter()
        .skip(open + 1)
        .position(|line| line.trim_end() == "```");
    after
        .map(|count| open + 1 + count)
        .ok_or_else(|| PageError {
            line: open + 1,
            what: "the block is not closed".to_owned(),
        })
}

fn content(lines: &[&str]) -> String {
    lines.iter().flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# Title\n\nOne sentence\non two lines.\n\n## Why\n\nBecause.\n\n\
        ```xml good\n<a/>\n```\n\n```xml bad in=road version=1.7 set:gap=2\n<b/>\n```\n\n\
        ```xml also file=c.xodr\n<c/>\n```\n\n```issues\nerror 1:1 /b: no\n```\n";

    #[test]
    fn page_is_parsed_into_examples() {
        let page = Page::parse(PAGE).unwrap();
        let [good, bad] = page.examples.as_slice() else {
            panic!("{page:?}")
        };
        assert_eq!((good.verdict, good.line), (Verdict::Good, 10));
        assert_eq!(good.files[0].text, "<a/>\n");
        assert_eq!(bad.template.as_deref(), Some("road"));
        assert_eq!(bad.params, [("gap".to_owned(), "2".to_owned())]);
        assert_eq!(bad.files[1].name.as_deref(), Some("c.xodr"));
        assert_eq!(bad.expected.as_deref(), Some("error 1:1 /b: no\n"));
        assert_eq!(bad.expected_lines, 21..24);
    }

    #[test]
    fn page_errors_are_reported_with_their_line() {
        let of = |page: &str| Page::parse(page).unwrap_err().to_string();
        assert!(of("no title").starts_with("line 1: a page must begin"));
        assert!(
            of("# T\n\nS.\n\n```xml bda\n```\n")
                .contains("line 5: expected `good`, `bad`, `skipped` or `also`, found `bda`")
        );
        assert!(of("# T\n\nS.\n\n```xml bad color=red\n```\n").contains("`color=red`"));
        assert!(of("# T\n\nS.\n\n```xml bad\n").contains("not closed"));
        assert!(of("# T\n\nS.\n\n```issues\n```\n").contains("must follow"));
    }
}
