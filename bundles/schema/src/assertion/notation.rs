//! Assertions in the table notation: the tree in prefix form, `(or (not @a) (> b/@c 0))`.

use std::fmt::{self, Write};

use super::lexer::{Token, tokens};
use super::{Assertion, Expr, MAX_DEPTH, Path, Relation};
use crate::names::Names;

impl Assertion {
    /// Writes the tree in the notation that [`Assertion::from_notation`] reads.
    pub(crate) fn notation(&self, names: &Names) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = write(&self.root, names, &mut out);
        out
    }

    /// Reads the notation that [`Assertion::notation`] writes.
    pub(crate) fn from_notation(text: &str, names: &mut Names) -> Result<Assertion, String> {
        let tokens = tokens(text)?;
        let mut at = 0;
        let root = read(&tokens, &mut at, names, 0)?;
        if at < tokens.len() {
            Err("unexpected text after the assertion".into())
        } else {
            Ok(Assertion { root })
        }
    }
}

fn write(expr: &Expr, names: &Names, out: &mut String) -> fmt::Result {
    match expr {
        Expr::And(parts) => write_call("and", parts, names, out),
        Expr::Or(parts) => write_call("or", parts, names, out),
        Expr::Not(inner) => write_call("not", std::slice::from_ref(&**inner), names, out),
        Expr::If(parts) => write_call("if", parts.as_slice(), names, out),
        Expr::Compare(relation, sides) => {
            write_call(relation.symbol(), sides.as_slice(), names, out)
        }
        Expr::Count(path) => write!(out, "(count {})", path.notation(names)),
        Expr::CountDistinct(path) => write!(out, "(count-distinct {})", path.notation(names)),
        Expr::Path(path) => out.write_str(&path.notation(names)),
        Expr::Number(number) => write!(out, "{number}"),
        Expr::Text(text) if text.contains('"') => write!(out, "'{text}'"),
        Expr::Text(text) => write!(out, "\"{text}\""),
        Expr::Bool(value) => write!(out, "({value})"),
    }
}

fn write_call(name: &str, parts: &[Expr], names: &Names, out: &mut String) -> fmt::Result {
    write!(out, "({name}")?;
    for part in parts {
        out.push(' ');
        write(part, names, out)?;
    }
    out.push(')');
    Ok(())
}

fn read(
    tokens: &[Token<'_>],
    at: &mut usize,
    names: &mut Names,
    depth: usize,
) -> Result<Expr, String> {
    let token = *tokens.get(*at).ok_or("the assertion ends too early")?;
    *at += 1;
    match token {
        _ if depth > MAX_DEPTH => Err("the assertion is nested too deeply".into()),
        Token::Word(path) => Path::parse(path, names).map(Expr::Path),
        Token::Number(text) => text
            .parse()
            .map(Expr::Number)
            .map_err(|_| format!("expected a number, found `{text}`")),
        Token::Text(text) => Ok(Expr::Text(text.into())),
        Token::Sign("(") => read_call(tokens, at, names, depth),
        Token::Sign(sign) => Err(format!("unexpected `{sign}`")),
    }
}

fn read_call(
    tokens: &[Token<'_>],
    at: &mut usize,
    names: &mut Names,
    depth: usize,
) -> Result<Expr, String> {
    let (Some(Token::Word(name)) | Some(Token::Sign(name))) = tokens.get(*at).copied() else {
        return Err("expected an operator".into());
    };
    *at += 1;
    let mut parts = Vec::new();
    while tokens.get(*at) != Some(&Token::Sign(")")) {
        parts.push(read(tokens, at, names, depth + 1)?);
    }
    *at += 1;
    build(name, parts).ok_or_else(|| format!("invalid use of `{name}`"))
}

fn build(name: &str, mut parts: Vec<Expr>) -> Option<Expr> {
    let relation = Relation::ALL.iter().find(|(_, symbol, _)| *symbol == name);
    match (name, parts.len()) {
        ("and", 2..) => Some(Expr::And(parts)),
        ("or", 2..) => Some(Expr::Or(parts)),
        ("not", 1) => parts.pop().map(|inner| Expr::Not(Box::new(inner))),
        ("if", 3) => parts
            .try_into()
            .ok()
            .map(|parts: [Expr; 3]| Expr::If(Box::new(parts))),
        ("true" | "false", 0) => Some(Expr::Bool(name == "true")),
        ("count", 1) => parts.pop().and_then(Expr::into_path).map(Expr::Count),
        ("count-distinct", 1) => parts
            .pop()
            .and_then(Expr::into_path)
            .map(Expr::CountDistinct),
        (_, 2) => {
            let sides: [Expr; 2] = parts.try_into().ok()?;
            relation.map(|(relation, ..)| Expr::Compare(*relation, Box::new(sides)))
        }
        _ => None,
    }
}

impl Expr {
    fn into_path(self) -> Option<Path> {
        match self {
            Expr::Path(path) => Some(path),
            _ => None,
        }
    }
}

impl Path {
    pub(super) fn notation(&self, names: &Names) -> String {
        let mut out = String::new();
        for step in &self.steps {
            if step.deep {
                out.push_str(if out.is_empty() { ".//" } else { "//" });
            } else if !out.is_empty() {
                out.push('/');
            }
            out.push_str(names.text(step.name));
        }
        if let Some(attribute) = self.attribute {
            out.push_str(if out.is_empty() { "@" } else { "/@" });
            out.push_str(names.text(attribute));
        }
        if out.is_empty() { ".".into() } else { out }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(xpath: &str) -> String {
        let mut names = Names::default();
        let read = Assertion::from_xpath(xpath, &mut names).unwrap();
        let text = read.notation(&names);
        assert_eq!(
            Assertion::from_notation(&text, &mut names).unwrap(),
            read,
            "{text}"
        );
        let shown = read.xpath(&names);
        let again = Assertion::from_xpath(&shown, &mut names).unwrap();
        assert_eq!(again, read, "{shown}");
        text
    }

    #[test]
    fn xpath_expressions_round_trip_through_notation() {
        assert_eq!(
            through("not(@a or @b) or (@a and not(b/@c != 0))"),
            "(or (not (or @a @b)) (and @a (not (!= b/@c 0))))"
        );
        assert_eq!(
            through("if (@k = 'x y') then count(./a//b) gt 1 else true()"),
            "(if (= @k \"x y\") (> (count a//b) 1) (true))"
        );
        assert_eq!(
            through("count(c/@id) = count(distinct-values(c/@id))"),
            "(= (count c/@id) (count-distinct c/@id))"
        );
        assert_eq!(through("exists(.//deep)"), ".//deep");
        assert_eq!(
            through("(@a or (if (@b) then @c else @d)) and not(@e)"),
            "(and (or @a (if @b @c @d)) (not @e))"
        );
    }

    #[test]
    fn assertion_is_shown_as_xpath() {
        let mut names = Names::default();
        let xpath = "not(@a or @b) or (@a and count(b/@c) > 0)";
        let read = Assertion::from_xpath(xpath, &mut names).unwrap();
        assert_eq!(read.xpath(&names), xpath);
    }

    #[test]
    fn unsupported_xpath_is_refused_by_name() {
        for (xpath, what) in [
            ("matches(@a, 'x')", "`,`"),
            ("string-length(@a)", "string-length"),
            ("@a = @b", "a comparison must be"),
            ("@a gt 1", "a comparison must be"),
            ("a[1]", "`[`"),
            ("../a", "not supported"),
            ("every $x in a satisfies $x", "`$`"),
            ("count(a", "expected Sign(\")\")"),
        ] {
            let problem = Assertion::from_xpath(xpath, &mut Names::default()).unwrap_err();
            assert!(problem.what.contains(what), "{xpath}: {problem}");
        }
    }
}
