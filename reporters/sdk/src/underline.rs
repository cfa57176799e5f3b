//! Characters of a line to which a finding refers.

/// Maximum length of an underline; the name of an element or an attribute is shorter.
const MOST: usize = 60;

/// Returns the number of characters to mark from `at`: the start of a tag with its name, an
/// attribute with its value, otherwise one character.
pub fn underlined(line: &[char], at: usize) -> usize {
    let rest = line.get(at..).unwrap_or_default();
    let name_from = |start: usize| {
        let name = rest.iter().skip(start).take_while(|&&c| is_name(c));
        start + name.count()
    };
    let length = match rest.first() {
        Some('<') => {
            let slash = matches!(rest.get(1), Some('/' | '?' | '!'));
            name_from(1 + usize::from(slash))
        }
        Some(&c) if is_name(c) => attribute(rest, name_from(0)),
        _ => 1,
    };
    length.clamp(1, MOST)
}

/// Returns the length of `name="value"` if it is present, else that of the name.
fn attribute(rest: &[char], name: usize) -> usize {
    let quoted = match (rest.get(name), rest.get(name + 1)) {
        (Some('='), Some(quote @ ('"' | '\''))) => rest
            .iter()
            .skip(name + 2)
            .position(|c| c == quote)
            .map(|value| name + 2 + value + 1),
        _ => None,
    };
    quoted.unwrap_or(name)
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_attributes_are_underlined_completely() {
        for (line, at, marked) in [
            ("<road id='5'>", 0, 5),
            ("<road id='5'>", 6, 6),
            ("</road>", 0, 6),
            ("a & b", 2, 1),
            ("", 0, 1),
            ("<a>", 99, 1),
            ("n='open", 0, 1),
        ] {
            let chars: Vec<char> = line.chars().collect();
            assert_eq!(underlined(&chars, at), marked, "{line} {at}");
        }
    }
}
