//! The regular expressions of XML Schema as deterministic automata.
//!
//! XSD patterns differ from other regular expressions: they are anchored at both ends, `^` and `$`
//! are ordinary characters, and `[a-z-[aeiou]]` subtracts. A match takes one table lookup per byte.
//! A pattern with an automaton beyond the limit is rejected when it is read.

use std::sync::Arc;

use regex_syntax::hir::{Class, ClassUnicode, ClassUnicodeRange, Hir, HirKind, Repetition};

use crate::automaton::{Automaton, MAX_MIB};

/// Maximum nesting of groups. Handwritten patterns stay far below it.
const MAX_DEPTH: usize = 64;

/// Largest bound of a quantifier.
const MAX_REPEAT: u32 = 1000;

/// Characters that may begin a name (XML 1.0, fifth edition, `NameStartChar`).
const NAME_START: &str = concat!(
    r":_A-Za-z\u{C0}-\u{D6}\u{D8}-\u{F6}\u{F8}-\u{2FF}\u{370}-\u{37D}\u{37F}-\u{1FFF}\u{200C}\u{200D}",
    r"\u{2070}-\u{218F}\u{2C00}-\u{2FEF}\u{3001}-\u{D7FF}\u{F900}-\u{FDCF}\u{FDF0}-\u{FFFD}",
    r"\u{10000}-\u{EFFFF}",
);

/// Characters that a name may have after its first one (`NameChar`).
const NAME_MORE: &str = r"\-.0-9\u{B7}\u{300}-\u{36F}\u{203F}\u{2040}";

/// A compiled pattern.
#[derive(Clone, Debug)]
pub struct Pattern {
    source: Box<str>,
    automaton: Arc<Automaton>,
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
    /// Its automaton exceeds the limit.
    #[error("compile the pattern `{pattern}`: its automaton needs more than {limit} MiB")]
    TooLarge {
        /// The pattern.
        pattern: String,
        /// The limit in MiB.
        limit: usize,
    },
}

impl Pattern {
    /// Compiles a pattern in XSD notation.
    ///
    /// # Errors
    /// If it is not a supported pattern, or if its automaton is too large.
    pub fn new(source: &str) -> Result<Pattern, PatternError> {
        let automaton = Automaton::new(&parse(source)?);
        let automaton = automaton.ok_or_else(|| PatternError::TooLarge {
            pattern: source.to_owned(),
            limit: MAX_MIB,
        })?;
        Ok(Pattern {
            source: source.into(),
            automaton: Arc::new(automaton),
        })
    }

    /// Returns the pattern as written.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Checks whether the whole of `text` matches.
    pub fn matches(&self, text: &str) -> bool {
        let end = self
            .automaton
            .after(self.automaton.start(), text.as_bytes());
        end.is_some_and(|state| self.automaton.accepts(state))
    }
}

fn parse(source: &str) -> Result<Hir, PatternError> {
    let mut parser = Parser {
        chars: source.chars().collect(),
        at: 0,
    };
    let parsed = parser.choice(0).and_then(|tree| match parser.peek() {
        None => Ok(tree),
        Some(_) => Err("a closing parenthesis without an opening one"),
    });
    parsed.map_err(|what| PatternError::Syntax {
        pattern: source.to_owned(),
        at: parser.at + 1,
        what,
    })
}

struct Parser {
    chars: Vec<char>,
    at: usize,
}

type Parsed<T> = Result<T, &'static str>;

impl Parser {
    fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    fn eat(&mut self, c: char) -> bool {
        let found = self.peek() == Some(c);
        self.at += usize::from(found);
        found
    }

    fn next(&mut self) -> Parsed<char> {
        let c = self.peek().ok_or("the pattern ends too early")?;
        self.at += 1;
        Ok(c)
    }

    fn choice(&mut self, depth: usize) -> Parsed<Hir> {
        if depth > MAX_DEPTH {
            return Err("groups are nested too deeply");
        }
        let mut branches = vec![self.sequence(depth)?];
        while self.eat('|') {
            branches.push(self.sequence(depth)?);
        }
        Ok(Hir::alternation(branches))
    }

    fn sequence(&mut self, depth: usize) -> Parsed<Hir> {
        let mut pieces = Vec::new();
        while self.peek().is_some_and(|c| !matches!(c, '|' | ')')) {
            let atom = self.atom(depth)?;
            pieces.push(self.quantified(atom)?);
        }
        Ok(Hir::concat(pieces))
    }

    fn atom(&mut self, depth: usize) -> Parsed<Hir> {
        let set = match self.next()? {
            '(' => {
                let inner = self.choice(depth + 1)?;
                return if self.eat(')') {
                    Ok(inner)
                } else {
                    Err("a group is not closed")
                };
            }
            '[' => self.class(depth)?,
            '.' => class(r"^\r\n")?,
            '\\' => self.escape()?,
            '?' | '*' | '+' | '{' => return Err("a quantifier with nothing before it"),
            '}' | ']' => return Err("a closing bracket without an opening one"),
            c => range(c, c),
        };
        Ok(Hir::class(Class::Unicode(set)))
    }

    fn escape(&mut self) -> Parsed<ClassUnicode> {
        match self.next()? {
            's' => class(r" \t\r\n"),
            'S' => class(r"^ \t\r\n"),
            'd' => class(r"\d"),
            'D' => class(r"^\d"),
            'i' => class(NAME_START),
            'I' => class(&format!("^{NAME_START}")),
            'c' => class(&format!("{NAME_START}{NAME_MORE}")),
            'C' => class(&format!("^{NAME_START}{NAME_MORE}")),
            'n' => Ok(range('\n', '\n')),
            'r' => Ok(range('\r', '\r')),
            't' => Ok(range('\t', '\t')),
            'p' | 'P' | 'w' | 'W' => Err("Unicode categories (\\p, \\w) are not supported"),
            c if r"\|.?*+(){}-[]^".contains(c) => Ok(range(c, c)),
            _ => Err("unknown escape sequence"),
        }
    }

    fn quantified(&mut self, atom: Hir) -> Parsed<Hir> {
        let (min, max) = if self.eat('?') {
            (0, Some(1))
        } else if self.eat('*') {
            (0, None)
        } else if self.eat('+') {
            (1, None)
        } else if self.eat('{') {
            self.counts()?
        } else {
            return Ok(atom);
        };
        Ok(Hir::repetition(Repetition {
            min,
            max,
            greedy: true,
            sub: Box::new(atom),
        }))
    }

    /// Reads the bounds of a quantifier after its opening bracket.
    fn counts(&mut self) -> Parsed<(u32, Option<u32>)> {
        let min = self.number()?;
        let max = match self.next()? {
            '}' => return Ok((min, Some(min))),
            ',' if self.eat('}') => return Ok((min, None)),
            ',' => self.number()?,
            _ => return Err("a quantifier is not closed"),
        };
        if !self.eat('}') {
            Err("a quantifier is not closed")
        } else if max < min {
            Err("a quantifier with a maximum below its minimum")
        } else {
            Ok((min, Some(max)))
        }
    }

    fn number(&mut self) -> Parsed<u32> {
        let rest = self.chars[self.at..].iter();
        let digits: String = rest.take_while(|c| c.is_ascii_digit()).collect();
        self.at += digits.len();
        match digits.parse::<u32>() {
            Ok(number) if number <= MAX_REPEAT => Ok(number),
            Err(_) if digits.is_empty() => Err("a quantifier needs a number"),
            _ => Err("a quantifier greater than 1000"),
        }
    }

    /// Reads a class after its opening bracket.
    fn class(&mut self, depth: usize) -> Parsed<ClassUnicode> {
        if depth > MAX_DEPTH {
            return Err("classes are nested too deeply");
        }
        let negative = self.eat('^');
        let mut set = ClassUnicode::empty();
        let mut minus = ClassUnicode::empty();
        if matches!(self.chars[self.at..], [']', ..] | ['-', '[', ..]) {
            return Err("a class without characters");
        }
        loop {
            match self.next()? {
                ']' => break,
                '[' => return Err("an opening bracket inside a class"),
                '-' if self.eat('[') => {
                    minus = self.class(depth + 1)?;
                    if !self.eat(']') {
                        return Err("a class is not closed");
                    }
                    break;
                }
                c => set.union(&self.member(c)?),
            }
        }
        if negative {
            set.negate();
        }
        set.difference(&minus);
        Ok(set)
    }

    /// Reads one character, escape or range of a class.
    fn member(&mut self, c: char) -> Parsed<ClassUnicode> {
        let set = self.single(c)?;
        let after = self.chars.get(self.at + 1);
        let in_range = self.peek() == Some('-') && !matches!(after, None | Some(']' | '['));
        let (Some(start), true) = (only(&set), in_range) else {
            return Ok(set);
        };
        self.at += 1;
        let c = self.next()?;
        match only(&self.single(c)?) {
            None => Err("a range must end with one character"),
            Some(end) if end < start => Err("a range with its end before its start"),
            Some(end) => Ok(range(start, end)),
        }
    }

    /// Returns the set of a character or an escape.
    fn single(&mut self, c: char) -> Parsed<ClassUnicode> {
        if c == '\\' {
            self.escape()
        } else {
            Ok(range(c, c))
        }
    }
}

/// Returns the only member of a set.
fn only(set: &ClassUnicode) -> Option<char> {
    match set.ranges() {
        [one] if one.start() == one.end() => Some(one.start()),
        _ => None,
    }
}

fn range(first: char, last: char) -> ClassUnicode {
    ClassUnicode::new([ClassUnicodeRange::new(first, last)])
}

/// Returns a set in the notation of `regex-syntax`, without its brackets.
fn class(members: &str) -> Parsed<ClassUnicode> {
    match regex_syntax::parse(&format!("[{members}]")).map(Hir::into_kind) {
        Ok(HirKind::Class(Class::Unicode(set))) => Ok(set),
        _ => Err("unknown escape sequence"),
    }
}
