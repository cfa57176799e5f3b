//! Lexer of expressions. XPath and the table notation share the tokens.

/// A token, borrowed from the expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'t> {
    /// A name, a path such as `a//b/@c`, or a keyword.
    Word(&'t str),
    /// A number.
    Number(&'t str),
    /// A string without its quotes.
    Text(&'t str),
    /// `(`, `)`, or a comparison.
    Sign(&'t str),
}

/// Splits `text` into tokens, or returns a description of the unreadable part.
pub(super) fn tokens(text: &str) -> Result<Vec<Token<'_>>, String> {
    let mut rest = text.trim_start();
    let mut all = Vec::new();
    while let Some(first) = rest.chars().next() {
        let (token, len) = match first {
            '(' | ')' | '=' => (Token::Sign(&rest[..1]), 1),
            '!' | '<' | '>' => {
                let len = 1 + usize::from(rest[1..].starts_with('='));
                (Token::Sign(&rest[..len]), len)
            }
            '\'' | '"' => {
                let end = rest[1..].find(first).ok_or("a string is not closed")?;
                (Token::Text(&rest[1..=end]), end + 2)
            }
            '0'..='9' | '-' => {
                let len =
                    rest.find(|c: char| !matches!(c, '0'..='9' | '.' | '-' | 'e' | 'E' | '+'));
                let len = len.unwrap_or(rest.len());
                (Token::Number(&rest[..len]), len)
            }
            c if is_word(c) => {
                let len = rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
                (Token::Word(&rest[..len]), len)
            }
            c => return Err(format!("unexpected character `{c}`")),
        };
        all.push(token);
        rest = rest[len..].trim_start();
    }
    Ok(all)
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '/' | '@' | ':')
}
