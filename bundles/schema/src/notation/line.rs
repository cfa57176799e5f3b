//! Splits one line of the notation into words and quoted texts.

use std::borrow::Cow;

/// The unread part of a line.
pub(super) struct Line<'t> {
    rest: &'t str,
}

pub(super) type Parsed<T> = Result<T, String>;

impl<'t> Line<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self {
            rest: text.trim_ascii(),
        }
    }

    /// Returns the rest of the line.
    pub(super) fn rest(&self) -> &'t str {
        self.rest
    }

    /// Returns the next word, if there is one.
    pub(super) fn next(&mut self) -> Option<&'t str> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self
            .rest
            .bytes()
            .position(|byte| byte == b' ')
            .unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest.trim_ascii_start();
        Some(word)
    }

    pub(super) fn word(&mut self, what: &str) -> Parsed<&'t str> {
        self.next().ok_or_else(|| format!("expected {what}"))
    }

    pub(super) fn number<T: std::str::FromStr>(&mut self, what: &str) -> Parsed<T> {
        let word = self.word(what)?;
        word.parse()
            .map_err(|_| format!("expected {what}, found `{word}`"))
    }

    /// Checks whether a quoted text comes next.
    pub(super) fn at_quote(&self) -> bool {
        self.rest.starts_with('"')
    }

    /// Reads a text in double quotes.
    pub(super) fn quoted(&mut self) -> Parsed<Cow<'t, str>> {
        let body = self
            .rest
            .strip_prefix('"')
            .ok_or("expected a quoted text")?;
        let end = closing_quote(body).ok_or("the quoted text is not closed")?;
        let (text, rest) = (&body[..end], &body[end + 1..]);
        self.rest = rest.trim_ascii_start();
        if text.contains('\\') {
            unescape(text).map(Cow::Owned)
        } else {
            Ok(Cow::Borrowed(text))
        }
    }
}

fn closing_quote(body: &str) -> Option<usize> {
    let mut escaped = false;
    for (at, byte) in body.bytes().enumerate() {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return Some(at),
            _ => {}
        }
    }
    None
}

fn unescape(text: &str) -> Parsed<String> {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        out.push(match chars.next() {
            Some('n') => '\n',
            Some('r') => '\r',
            Some('t') => '\t',
            Some(plain @ ('"' | '\\')) => plain,
            _ => return Err("unknown escape sequence".into()),
        });
    }
    Ok(out)
}
