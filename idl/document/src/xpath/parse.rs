//! Parser for the part of XPath 1.0 that tools use to name an element.

use thiserror::Error;

/// Reason why an XPath cannot be evaluated.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("evaluate the XPath '{xpath}': expected {expected} at character {at}")]
pub struct XPathError {
    /// The expression.
    pub xpath: String,
    /// Position of the error, in characters from 1.
    pub at: usize,
    /// Description of a valid input at this position.
    pub expected: &'static str,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct Step<'x> {
    /// Whether the step follows `//` rather than `/`.
    pub(super) anywhere: bool,
    /// The local name; `None` stands for `*`.
    pub(super) name: Option<&'x str>,
    pub(super) predicates: Vec<Predicate<'x>>,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Predicate<'x> {
    Number(usize),
    Last,
    All(Vec<Condition<'x>>),
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Condition<'x> {
    Has(&'x str),
    Equals(&'x str, &'x str),
    LocalName(&'x str),
}

pub(super) fn parse(xpath: &str) -> Result<Vec<Step<'_>>, XPathError> {
    let mut parser = Parser {
        whole: xpath,
        rest: xpath,
    };
    parser.path().map_err(|expected| XPathError {
        xpath: xpath.to_owned(),
        at: xpath[..xpath.len() - parser.rest.len()].chars().count() + 1,
        expected,
    })
}

struct Parser<'x> {
    whole: &'x str,
    rest: &'x str,
}

/// Description of the expected input.
type Expected = &'static str;

impl<'x> Parser<'x> {
    fn path(&mut self) -> Result<Vec<Step<'x>>, Expected> {
        let mut steps = Vec::new();
        self.skip_space();
        if self.rest.is_empty() {
            return Err("'/'");
        }
        if self.rest.trim_end() == "/" {
            return Ok(steps);
        }
        loop {
            let anywhere = self.take("//");
            if !anywhere && !self.take("/") && self.rest.len() < self.whole.trim_start().len() {
                return Err("'/', '[' or the end");
            }
            if !steps.is_empty() && self.ends_beside_an_element()? {
                return Ok(steps);
            }
            steps.push(self.step(anywhere)?);
            self.skip_space();
            if self.rest.is_empty() {
                return Ok(steps);
            }
        }
    }

    /// Checks for a last step to an attribute or to text, which selects the element that contains
    /// it.
    fn ends_beside_an_element(&mut self) -> Result<bool, Expected> {
        self.skip_space();
        if self.take("text()") {
        } else if self.take("@") {
            if !self.take("*") {
                self.name("the name of an attribute")?;
            }
        } else {
            return Ok(false);
        }
        self.skip_space();
        if self.rest.is_empty() {
            Ok(true)
        } else {
            Err("the end")
        }
    }

    fn step(&mut self, anywhere: bool) -> Result<Step<'x>, Expected> {
        self.skip_space();
        let name = if self.take("*") {
            None
        } else {
            let name = self.name("the name of an element, or '*'")?;
            Some(crate::builder::local_name(name)).filter(|name| *name != "*")
        };
        let mut predicates = Vec::new();
        self.skip_space();
        while self.take("[") {
            self.skip_space();
            predicates.push(self.predicate()?);
            self.skip_space();
            self.demand("]", "']'")?;
            self.skip_space();
        }
        Ok(Step {
            anywhere,
            name,
            predicates,
        })
    }

    fn predicate(&mut self) -> Result<Predicate<'x>, Expected> {
        let digits = self.rest.len()
            - self
                .rest
                .trim_start_matches(|c: char| c.is_ascii_digit())
                .len();
        if digits > 0 {
            let number = self.rest[..digits].parse().unwrap_or(usize::MAX);
            self.rest = &self.rest[digits..];
            return Ok(Predicate::Number(number));
        }
        if self.take("last()") {
            return Ok(Predicate::Last);
        }
        let mut conditions = vec![self.condition()?];
        self.skip_space();
        while self.take("and") {
            self.skip_space();
            conditions.push(self.condition()?);
            self.skip_space();
        }
        Ok(Predicate::All(conditions))
    }

    fn condition(&mut self) -> Result<Condition<'x>, Expected> {
        if self.take("local-name()") {
            self.skip_space();
            self.demand("=", "'='")?;
            self.skip_space();
            return self.literal().map(Condition::LocalName);
        }
        self.demand("@", "a number, 'last()', 'local-name()' or '@'")?;
        let name = self.name("the name of an attribute")?;
        self.skip_space();
        if !self.take("=") {
            return Ok(Condition::Has(name));
        }
        self.skip_space();
        Ok(Condition::Equals(name, self.literal()?))
    }

    fn literal(&mut self) -> Result<&'x str, Expected> {
        let quote = if self.take("'") {
            '\''
        } else {
            self.demand("\"", "a quoted value")?;
            '"'
        };
        let (value, rest) = self.rest.split_once(quote).ok_or("a closing quote")?;
        self.rest = rest;
        Ok(value)
    }

    /// Parses a name as written, including its prefix; also accepts `prefix:*`.
    fn name(&mut self, expected: Expected) -> Result<&'x str, Expected> {
        let ends = |c: char| c.is_whitespace() || "/[]@'\"=()|,<>!+$".contains(c);
        let len = self.rest.find(ends).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(len);
        if name.is_empty()
            || name.contains("::")
            || name.starts_with(['.', '-', ':'])
            || rest.starts_with('(')
        {
            return Err(expected);
        }
        self.rest = rest;
        Ok(name)
    }

    fn take(&mut self, token: &str) -> bool {
        let rest = self.rest.strip_prefix(token);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn demand(&mut self, token: &str, expected: Expected) -> Result<(), Expected> {
        if self.take(token) {
            Ok(())
        } else {
            Err(expected)
        }
    }

    fn skip_space(&mut self) {
        self.rest = self.rest.trim_start();
    }
}
