//! Lexer: splits the text of an expression into lexemes.

use super::words::FOREIGN;
use super::{Fault, FaultKind, OPENING, is_blank, quoted};
use crate::types::text::identifier;

/// The signs of the language.
const SIGNS: [char; 8] = ['+', '-', '*', '/', '%', '(', ')', ','];

/// A number, name, word or sign, and its position.
#[derive(Clone, Copy)]
pub(super) struct Lexeme<'t> {
    pub at: usize,
    pub text: &'t str,
    pub token: Token,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Token {
    /// A number in the notation of the grammar.
    Number,
    /// A name with its `$`.
    Parameter,
    /// A word, known or not.
    Word,
    /// One of `+ - * / % ( ) ,`.
    Sign,
    /// The `}` at the end.
    Close,
    /// The text ended without a `}`.
    End,
}

/// Reads lexemes from the front of a text. Reports a fault when it reaches invalid text.
#[derive(Clone)]
pub(super) struct Lexer<'t> {
    at: usize,
    rest: &'t str,
}

/// Returns the name at the start of `rest`.
pub(super) fn name(rest: &str) -> Option<&str> {
    Some(identifier(rest)).filter(|name| !name.is_empty())
}

impl<'t> Lexer<'t> {
    /// Creates a lexer that starts after the `${` at the start of `text`.
    pub fn new(text: &'t str) -> Result<Lexer<'t>, Fault> {
        let mut lexer = Lexer { at: 0, rest: text };
        lexer.skip_blanks();
        if lexer.rest.starts_with(OPENING) {
            lexer.take(OPENING.len());
            Ok(lexer)
        } else {
            let text = format!("an expression must begin with `{OPENING}`");
            Err(Fault::evaluation(lexer.at, text))
        }
    }

    /// Returns the remaining text without surrounding blanks, and its position.
    pub fn left(&mut self) -> (usize, &'t str) {
        self.skip_blanks();
        (self.at, self.rest.trim_end_matches(is_blank))
    }

    /// Returns the next lexeme.
    pub fn read(&mut self) -> Result<Lexeme<'t>, Fault> {
        self.skip_blanks();
        let (at, rest) = (self.at, self.rest);
        let (token, length) = match rest.as_bytes() {
            [] => (Token::End, 0),
            [b'0'..=b'9', ..] | [b'.', b'0'..=b'9', ..] => (Token::Number, self.number()?),
            [b'$', ..] => (Token::Parameter, self.parameter()?),
            [b'}', ..] => (Token::Close, 1),
            _ => match name(rest) {
                Some(word) => (Token::Word, word.len()),
                None => (Token::Sign, self.sign()?),
            },
        };
        let text = self.take(length);
        Ok(Lexeme { at, text, token })
    }

    fn skip_blanks(&mut self) {
        let trimmed = self.rest.trim_start_matches(is_blank);
        self.take(self.rest.len() - trimmed.len());
    }

    fn take(&mut self, length: usize) -> &'t str {
        let (taken, rest) = self.rest.split_at(length);
        self.at += length;
        self.rest = rest;
        taken
    }

    /// Returns the length of the number here. All characters that could be meant as part of it are
    /// included. `5f` is therefore one fault and not two lexemes.
    fn number(&self) -> Result<usize, Fault> {
        let (mut digits_only, mut after_e) = (true, false);
        let end = self.rest.find(|c: char| {
            let inside = c.is_ascii_alphanumeric() || matches!(c, '.' | '_');
            let belongs = inside || after_e && matches!(c, '+' | '-');
            after_e = digits_only && matches!(c, 'e' | 'E');
            digits_only &= c.is_ascii_digit() || c == '.';
            !belongs
        });
        let length = end.unwrap_or(self.rest.len());
        let number = self.rest.split_at(length).0;
        match misspelt(number) {
            None => Ok(length),
            Some(why) => {
                let text = format!("{} is not a number: {why}", quoted(number));
                // Letters in a number are taken for an operand that does not exist.
                let letters = number.contains(|c: char| c == '_' || c.is_ascii_alphabetic());
                let kind = if why == FOREIGN_TO_NUMBERS && letters {
                    FaultKind::Operator
                } else {
                    FaultKind::Evaluation
                };
                Err(Fault::new(kind, self.at, text))
            }
        }
    }

    fn parameter(&self) -> Result<usize, Fault> {
        let dollar = "$";
        let name = self.rest.strip_prefix(dollar).and_then(name);
        let text = "`$` is not followed by a name; a parameter is written `$name`";
        name.map(|name| dollar.len() + name.len())
            .ok_or_else(|| Fault::evaluation(self.at, text))
    }

    fn sign(&self) -> Result<usize, Fault> {
        let foreign = FOREIGN.iter().find(|entry| self.rest.starts_with(entry.0));
        if foreign.is_none() && self.rest.starts_with(SIGNS) {
            return Ok(1);
        }
        let (found, way_out) = match foreign {
            Some((sign, way_out)) => (format!("`{sign}`"), *way_out),
            None => {
                let found = self.rest.chars().next().map(shown);
                (
                    found.unwrap_or_default(),
                    "the allowed signs are `+ - * / % ( ) ,`",
                )
            }
        };
        let text = format!("{found} is not part of the expression language; {way_out}");
        Err(Fault::new(FaultKind::Operator, self.at, text))
    }
}

/// Formats a character for a message. An invisible character is shown as its number.
fn shown(c: char) -> String {
    if c.is_control() || c.is_whitespace() {
        format!("the character U+{:04X}", u32::from(c))
    } else {
        format!("`{c}`")
    }
}

const FOREIGN_TO_NUMBERS: &str =
    "numbers are written like `2`, `0.5` or `1.5e-3`, without units and separators";

/// Returns the reason why `text` is no number of the grammar.
fn misspelt(text: &str) -> Option<&'static str> {
    let parts = text.split_once(['e', 'E']);
    let (mantissa, exponent) = parts.map_or((text, None), |(m, e)| (m, Some(e)));
    let (whole, fraction) = match mantissa.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let exponent = exponent.map(|e| e.strip_prefix(['+', '-']).unwrap_or(e));
    let foreign = |digits: &str| digits.bytes().any(|c| !c.is_ascii_digit());
    let padded = |digits: &str| digits.len() > 1 && digits.starts_with('0');
    if [Some(whole), fraction, exponent]
        .into_iter()
        .flatten()
        .any(foreign)
    {
        Some(FOREIGN_TO_NUMBERS)
    } else if whole.is_empty() {
        Some("a digit must come before the point, like `0.5`")
    } else if fraction == Some("") {
        Some("a digit must come after the point, like `2.0`")
    } else if exponent == Some("") {
        Some("a digit must come after the `e`, like `1.5e3`")
    } else if padded(whole) || exponent.is_some_and(padded) {
        Some("numbers and exponents must not have leading zeros")
    } else {
        None
    }
}
