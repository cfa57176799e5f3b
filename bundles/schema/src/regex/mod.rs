//! The regular expressions of XML Schema as deterministic automata.
//!
//! XSD patterns differ from other regular expressions: they are anchored at both ends, `^` and `$`
//! are ordinary characters, and `[a-z-[aeiou]]` subtracts. A match takes one table lookup per
//! character. A pattern with an automaton beyond the limits is rejected when it is read.

mod automaton;
mod charset;
mod parse;

use automaton::Automaton;

/// A compiled pattern.
#[derive(Clone, Debug)]
pub struct Pattern {
    source: Box<str>,
    automaton: Automaton,
}

/// Reason why a pattern cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PatternError {
    /// It is not a regular expression, or uses a construct that is not supported.
    #[error("parse the pattern `{pattern}` at character {at}: {what}")]
    Syntax {
        /// The pattern.
        pattern: String,
        /// Position of the error in characters, from 1.
        at: usize,
        /// Description of the error.
        what: &'static str,
    },
    /// It needs more states than the limit allows.
    #[error("compile the pattern `{pattern}`: it needs more than {limit} states")]
    TooLarge {
        /// The pattern.
        pattern: String,
        /// The limit.
        limit: usize,
    },
}

impl Pattern {
    /// Compiles a pattern in XSD notation.
    pub fn new(source: &str) -> Result<Pattern, PatternError> {
        let tree = parse::parse(source)?;
        let automaton = Automaton::build(&tree).map_err(|limit| PatternError::TooLarge {
            pattern: source.to_owned(),
            limit,
        })?;
        Ok(Pattern {
            source: source.into(),
            automaton,
        })
    }

    /// Returns the pattern as written.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Checks whether the whole of `text` matches.
    pub fn matches(&self, text: &str) -> bool {
        self.automaton.matches(text)
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        self.source.len() + self.automaton.heap_bytes()
    }

    /// Returns a short text that matches, if there is one.
    pub(crate) fn example(&self) -> Option<String> {
        self.automaton.example()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches(pattern: &str, text: &str) -> bool {
        Pattern::new(pattern).unwrap().matches(text)
    }

    #[test]
    fn patterns_are_anchored_at_both_ends() {
        assert!(matches("[A-Z]{2}", "DE"));
        assert!(
            !matches("[A-Z]{2}", "DEU") && !matches("[A-Z]{2}", "xDE") && !matches("[A-Z]{2}", "")
        );
        assert!(matches("^a$", "^a$") && !matches("^a$", "a"));
    }

    #[test]
    fn quantifiers_and_groups_match() {
        assert!(matches(r"\d\.\d{2}", "1.25") && !matches(r"\d\.\d{2}", "1.2"));
        assert!(
            matches("(ab|c){2,3}", "abc")
                && matches("(ab|c){2,3}", "ccab")
                && !matches("(ab|c){2,3}", "c")
        );
        assert!(matches("a{0}b?", "") && matches("a{2,}", "aaaa") && !matches("a{2,}", "a"));
        assert!(matches("", "") && !matches("", "x") && matches("a||b", ""));
    }

    #[test]
    fn character_classes_subtract_and_negate() {
        assert!(matches("[a-z-[aeiou]]+", "xyz") && !matches("[a-z-[aeiou]]+", "xay"));
        assert!(matches("[^0-9]", "ä") && !matches("[^0-9]", "7"));
        assert!(matches(r"[\-+a\]]*", "+-a]") && matches("[a-]", "-") && matches("[-a]", "-"));
        assert!(matches(r"\i\c*", "_x-1") && !matches(r"\i\c*", "1x"));
        assert!(
            matches(r"\s\S", " x")
                && matches(r"\D", "x")
                && matches(".", "𝄞")
                && !matches(".", "\n")
        );
    }

    #[test]
    fn unsupported_or_explosive_pattern_is_refused() {
        for bad in [
            "(", ")", "[", "[z-a]", "a{3,1}", "*", r"\p{L}", r"\w", r"\q", "a{99999}", "a**", "]",
            "}",
        ] {
            assert!(Pattern::new(bad).is_err(), "{bad}");
        }
        let explosive = "(a|b)*a(a|b){20}";
        assert!(matches!(
            Pattern::new(explosive),
            Err(PatternError::TooLarge { .. })
        ));
    }

    #[test]
    fn pattern_matches_its_own_example() {
        for pattern in ["[$][A-Za-z_][A-Za-z0-9_]*", r"\d\.\d{2}", "x|", "(ab){3}"] {
            let compiled = Pattern::new(pattern).unwrap();
            assert!(compiled.matches(&compiled.example().unwrap()), "{pattern}");
        }
    }
}
