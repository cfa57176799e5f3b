//! Resolves references and line ends, from the raw text to the value.

use super::chars::is_char;

/// An unresolvable reference: its offset within the raw value, and the reason.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct BadReference {
    pub offset: usize,
    pub why: Unresolved,
}

/// Reason why a reference has no character, with the beginning of its name.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unresolved {
    #[error("& must be written &amp;")]
    NoName,
    #[error("the entity &{0}; is not defined (XML has lt, gt, amp, quot and apos)")]
    Undefined(String),
    #[error("&{0}; is not a character that XML allows")]
    Forbidden(String),
    #[error("&{0}; is not a valid character reference")]
    Malformed(String),
}

/// Returns the character for `&name;`. Only the five entities of XML and character references are
/// known. A document cannot define others, because a DOCTYPE is refused.
pub(crate) fn resolve_reference(name: &str) -> Result<char, Unresolved> {
    match name {
        "lt" => return Ok('<'),
        "gt" => return Ok('>'),
        "amp" => return Ok('&'),
        "quot" => return Ok('"'),
        "apos" => return Ok('\''),
        _ => {}
    }
    let shown: String = name.chars().take(40).collect();
    let Some(number) = name.strip_prefix('#') else {
        return Err(Unresolved::Undefined(shown));
    };
    let (digits, radix) = number
        .strip_prefix('x')
        .map_or((number, 10), |digits| (digits, 16));
    let all_digits = !digits.is_empty() && digits.chars().all(|c| c.is_digit(radix));
    let code = all_digits.then(|| u32::from_str_radix(digits, radix).unwrap_or(u32::MAX));
    match code.map(char::from_u32) {
        Some(Some(c)) if is_char(c) => Ok(c),
        Some(_) => Err(Unresolved::Forbidden(shown)),
        None => Err(Unresolved::Malformed(shown)),
    }
}

/// Appends the value of an attribute's raw text. References are resolved, and every tab and line
/// end becomes a blank (XML 1.0, section 3.3.3). Unresolvable references stay as written.
pub(crate) fn attribute_value(raw: &str, out: &mut String, bad: &mut Vec<BadReference>) {
    let mut rest = raw;
    while let Some(at) = rest.find(['&', '\t', '\n', '\r']) {
        out.push_str(&rest[..at]);
        let from = raw.len() - rest.len() + at;
        rest = &rest[at..];
        let used = match rest.as_bytes()[0] {
            b'&' => reference(rest, from, out, bad),
            b'\r' if rest.as_bytes().get(1) == Some(&b'\n') => {
                out.push(' ');
                2
            }
            _ => {
                out.push(' ');
                1
            }
        };
        rest = &rest[used..];
    }
    out.push_str(rest);
}

/// Appends character data with its line ends as single line feeds (XML 1.0, section 2.11).
pub(crate) fn line_ends(raw: &str, out: &mut String) {
    let mut rest = raw;
    while let Some(at) = rest.find('\r') {
        out.push_str(&rest[..at]);
        out.push('\n');
        rest = &rest[at + 1..];
        rest = rest.strip_prefix('\n').unwrap_or(rest);
    }
    out.push_str(rest);
}

/// Resolves the reference at the start of `rest`. Returns the number of bytes used.
fn reference(rest: &str, offset: usize, out: &mut String, bad: &mut Vec<BadReference>) -> usize {
    // The search for the end stops where a name ends, so a value that contains only `&` takes
    // linear time.
    let stops = |c: char| matches!(c, ';' | '&' | '<' | ' ' | '\t' | '\n' | '\r');
    let body = &rest[1..];
    let outcome = match body.find(stops) {
        Some(len) if body.as_bytes()[len] == b';' => {
            resolve_reference(&body[..len]).map(|c| (c, len + 2))
        }
        _ => Err(Unresolved::NoName),
    };
    match outcome {
        Ok((c, used)) => {
            out.push(c);
            used
        }
        Err(why) => {
            bad.push(BadReference { offset, why });
            out.push('&');
            1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(raw: &str) -> (String, Vec<BadReference>) {
        let (mut out, mut bad) = (String::new(), Vec::new());
        attribute_value(raw, &mut out, &mut bad);
        (out, bad)
    }

    #[test]
    fn references_are_resolved_and_line_ends_become_blanks() {
        let raw = "&lt;&gt;&amp;&quot;&apos;&#65;&#x20AC;\ta\r\nb\rc\nd&#10;";
        assert_eq!(value(raw), ("<>&\"'A€ a b c d\n".to_string(), vec![]));
        assert_eq!(value("").0, "");
    }

    #[test]
    fn bad_references_stay_as_written() {
        for (raw, offset, part) in [
            ("a&b;", 1, "entity &b; is not defined"),
            ("&", 0, "& must be written &amp;"),
            ("x & y;", 2, "& must be written &amp;"),
            ("&#0;", 0, "not a character that XML allows"),
            ("&#xD800;", 0, "not a character that XML allows"),
            ("&#99999999999;", 0, "not a character that XML allows"),
            ("&#;", 0, "not a valid character reference"),
            ("&#+65;", 0, "not a valid character reference"),
            ("&#X41;", 0, "not a valid character reference"),
        ] {
            let (out, bad) = value(raw);
            assert_eq!(out, raw);
            assert_eq!(bad.len(), 1, "{raw}");
            assert_eq!(bad[0].offset, offset, "{raw}");
            assert!(bad[0].why.to_string().contains(part), "{}", bad[0].why);
        }
    }

    #[test]
    fn line_ends_become_line_feeds() {
        let mut out = String::new();
        line_ends("a\r\nb\rc\n\r", &mut out);
        assert_eq!(out, "a\nb\nc\n\n");
    }
}
