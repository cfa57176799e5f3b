//! Parser and writer of XPath expressions.

use std::fmt::{self, Write};

use super::lexer::{Token, tokens};
use super::{Assertion, Expr, MAX_DEPTH, Path, PathStep, Relation, XPathProblem};
use crate::names::Names;

impl Assertion {
    /// Reads an XPath expression and assigns numbers to its names.
    pub(crate) fn from_xpath(text: &str, names: &mut Names) -> Result<Assertion, XPathProblem> {
        let problem = |what: String| XPathProblem {
            text: text.to_owned(),
            what,
        };
        let tokens = tokens(text).map_err(problem)?;
        let mut parser = Parser {
            tokens: &tokens,
            at: 0,
            names,
        };
        let root = parser.expression(0).map_err(problem)?;
        match parser.peek() {
            None => Ok(Assertion { root }),
            Some(token) => Err(problem(format!("unexpected {token:?}"))),
        }
    }
}

impl Assertion {
    /// Writes the assertion as XPath, for people who know it from the schema.
    pub(crate) fn xpath(&self, names: &Names) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = write_xpath(&self.root, names, &mut out);
        out
    }
}

fn write_xpath(expr: &Expr, names: &Names, out: &mut String) -> fmt::Result {
    match expr {
        Expr::And(parts) => write_joined(" and ", parts, names, out),
        Expr::Or(parts) => write_joined(" or ", parts, names, out),
        Expr::Not(inner) => {
            out.push_str("not(");
            write_xpath(inner, names, out)?;
            out.push(')');
            Ok(())
        }
        Expr::If(parts) => {
            let [test, yes, no] = &**parts;
            out.push_str("if (");
            write_xpath(test, names, out)?;
            out.push_str(") then ");
            write_operand(yes, names, out)?;
            out.push_str(" else ");
            write_operand(no, names, out)
        }
        Expr::Compare(relation, sides) => {
            let sign = format!(" {} ", relation.symbol());
            write_joined(&sign, &**sides, names, out)
        }
        Expr::Count(path) => write!(out, "count({})", path.notation(names)),
        Expr::CountDistinct(path) => {
            write!(out, "count(distinct-values({}))", path.notation(names))
        }
        Expr::Path(path) => out.write_str(&path.notation(names)),
        Expr::Number(number) => write!(out, "{number}"),
        Expr::Text(text) if text.contains('"') => write!(out, "'{text}'"),
        Expr::Text(text) => write!(out, "\"{text}\""),
        Expr::Bool(value) => write!(out, "{value}()"),
    }
}

fn write_joined(word: &str, parts: &[Expr], names: &Names, out: &mut String) -> fmt::Result {
    for (index, part) in parts.iter().enumerate() {
        if index > 0 {
            out.push_str(word);
        }
        write_operand(part, names, out)?;
    }
    Ok(())
}

/// Writes a part of a larger expression, in parentheses if it has parts of its own.
fn write_operand(expr: &Expr, names: &Names, out: &mut String) -> fmt::Result {
    let has_parts = matches!(expr, Expr::And(_) | Expr::Or(_) | Expr::If(_));
    if has_parts {
        out.push('(');
    }
    write_xpath(expr, names, out)?;
    if has_parts {
        out.push(')');
    }
    Ok(())
}

struct Parser<'t, 'n> {
    tokens: &'t [Token<'t>],
    at: usize,
    names: &'n mut Names,
}

type Parsed<T> = Result<T, String>;

impl<'t> Parser<'t, '_> {
    fn peek(&self) -> Option<Token<'t>> {
        self.tokens.get(self.at).copied()
    }

    fn eat(&mut self, token: Token<'_>) -> bool {
        let found = self.peek() == Some(token);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, token: Token<'_>) -> Parsed<()> {
        if self.eat(token) {
            Ok(())
        } else {
            Err(format!("expected {token:?}"))
        }
    }

    fn expression(&mut self, depth: usize) -> Parsed<Expr> {
        if depth > MAX_DEPTH {
            return Err("it is nested too deeply".into());
        }
        if self.peek() == Some(Token::Word("if"))
            && self.tokens.get(self.at + 1) == Some(&Token::Sign("("))
        {
            return self.conditional(depth);
        }
        self.joined("or", depth)
    }

    fn conditional(&mut self, depth: usize) -> Parsed<Expr> {
        self.at += 1;
        let test = self.grouped(depth)?;
        self.expect(Token::Word("then"))?;
        let yes = self.expression(depth + 1)?;
        self.expect(Token::Word("else"))?;
        let no = self.expression(depth + 1)?;
        Ok(Expr::If(Box::new([test, yes, no])))
    }

    fn joined(&mut self, word: &'static str, depth: usize) -> Parsed<Expr> {
        let mut parts = vec![self.part(word, depth)?];
        while self.eat(Token::Word(word)) {
            parts.push(self.part(word, depth)?);
        }
        Ok(match parts.len() {
            1 => parts.remove(0),
            _ if word == "or" => Expr::Or(parts),
            _ => Expr::And(parts),
        })
    }

    fn part(&mut self, word: &str, depth: usize) -> Parsed<Expr> {
        if word == "or" {
            self.joined("and", depth)
        } else {
            self.comparison(depth)
        }
    }

    fn comparison(&mut self, depth: usize) -> Parsed<Expr> {
        let left = self.operand(depth)?;
        let written = match self.peek() {
            Some(Token::Sign(sign)) => sign,
            Some(Token::Word(word)) => word,
            _ => return Ok(left),
        };
        let Some(&(relation, symbol, _)) = Relation::ALL
            .iter()
            .find(|(_, symbol, word)| *symbol == written || *word == written)
        else {
            return Ok(left);
        };
        self.at += 1;
        let right = self.operand(depth)?;
        comparable(&left, &right, written == symbol)?;
        Ok(Expr::Compare(relation, Box::new([left, right])))
    }

    fn operand(&mut self, depth: usize) -> Parsed<Expr> {
        match self.peek() {
            Some(Token::Sign("(")) => self.grouped(depth),
            Some(Token::Number(text)) => {
                self.at += 1;
                let number = text
                    .parse()
                    .map_err(|_| format!("expected a number, found `{text}`"))?;
                Ok(Expr::Number(number))
            }
            Some(Token::Text(text)) => {
                self.at += 1;
                Ok(Expr::Text(text.into()))
            }
            Some(Token::Word(word)) => {
                self.at += 1;
                if self.peek() == Some(Token::Sign("(")) {
                    self.call(word, depth)
                } else {
                    self.path(word).map(Expr::Path)
                }
            }
            Some(token) => Err(format!("unexpected {token:?}")),
            None => Err("it ends too early".into()),
        }
    }

    fn grouped(&mut self, depth: usize) -> Parsed<Expr> {
        self.expect(Token::Sign("("))?;
        let inner = self.expression(depth + 1)?;
        self.expect(Token::Sign(")"))?;
        Ok(inner)
    }

    fn call(&mut self, function: &str, depth: usize) -> Parsed<Expr> {
        match function {
            "not" => Ok(Expr::Not(Box::new(self.grouped(depth)?))),
            "exists" => Ok(Expr::Path(self.path_argument()?)),
            "count" => self.count(),
            "true" | "false" => {
                self.at += 1;
                self.expect(Token::Sign(")"))?;
                Ok(Expr::Bool(function == "true"))
            }
            _ => Err(format!("the function {function}() is not supported")),
        }
    }

    fn count(&mut self) -> Parsed<Expr> {
        if self.tokens.get(self.at + 1) != Some(&Token::Word("distinct-values")) {
            return self.path_argument().map(Expr::Count);
        }
        self.at += 2;
        let path = self.path_argument()?;
        self.expect(Token::Sign(")"))?;
        if path.attribute.is_none() {
            return Err("distinct-values() is supported for attributes only".into());
        }
        Ok(Expr::CountDistinct(path))
    }

    fn path_argument(&mut self) -> Parsed<Path> {
        self.expect(Token::Sign("("))?;
        let Some(Token::Word(word)) = self.peek() else {
            return Err("expected a path".into());
        };
        self.at += 1;
        let path = self.path(word)?;
        self.expect(Token::Sign(")"))?;
        Ok(path)
    }

    fn path(&mut self, text: &str) -> Parsed<Path> {
        Path::parse(text, self.names)
    }
}

/// Checks that a comparison is supported: its result must not depend on the types of attributes.
fn comparable(left: &Expr, right: &Expr, general: bool) -> Parsed<()> {
    let literal = |side: &Expr| matches!(side, Expr::Number(_) | Expr::Text(_) | Expr::Bool(_));
    let number = |side: &Expr| {
        matches!(
            side,
            Expr::Number(_) | Expr::Count(_) | Expr::CountDistinct(_)
        )
    };
    let attribute = |side: &Expr| matches!(side, Expr::Path(path) if path.attribute.is_some());
    let numbers = number(left) && number(right);
    let mixed = attribute(left) && literal(right) || literal(left) && attribute(right);
    if numbers || (general && mixed) {
        return Ok(());
    }
    Err("a comparison must be between two numbers, or between an attribute and a literal (by = != < <= > >=)".into())
}

impl Path {
    /// Reads `a`, `./a/b`, `a//b`, `@c`, `a/@c`.
    pub(super) fn parse(text: &str, names: &mut Names) -> Parsed<Path> {
        let unsupported = || format!("the path `{text}` is not supported");
        let mut path = Path::default();
        let mut deep = false;
        let mut parts = text.split('/').enumerate().peekable();
        while let Some((index, part)) = parts.next() {
            let last = parts.peek().is_none();
            match part {
                "." if index == 0 && !last => {}
                // A second `//` could select an item twice.
                "" if index > 0 && !last && !path.steps.iter().any(|step| step.deep) && !deep => {
                    deep = true;
                }
                _ => {
                    let (attribute, name) = part
                        .strip_prefix('@')
                        .map_or((false, part), |name| (true, name));
                    if !is_plain_name(name) || (attribute && (!last || deep)) {
                        return Err(unsupported());
                    }
                    let name = names.intern(name).ok_or_else(unsupported)?;
                    if attribute {
                        path.attribute = Some(name);
                    } else {
                        path.steps.push(PathStep { deep, name });
                    }
                    deep = false;
                }
            }
        }
        Ok(path)
    }
}

fn is_plain_name(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && chars.all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.'))
}
