//! Parser of XSD regular expressions.

use super::PatternError;
use super::charset::CharSet;

/// Maximum nesting of groups. Handwritten patterns stay far below it.
const MAX_DEPTH: usize = 64;

/// Largest bound of a quantifier.
const MAX_REPEAT: u32 = 1000;

#[derive(Clone, Debug)]
pub(super) enum Tree {
    Set(CharSet),
    Sequence(Vec<Tree>),
    Choice(Vec<Tree>),
    Repeat {
        what: Box<Tree>,
        min: u32,
        max: Option<u32>,
    },
}

pub(super) fn parse(source: &str) -> Result<Tree, PatternError> {
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

    fn choice(&mut self, depth: usize) -> Parsed<Tree> {
        if depth > MAX_DEPTH {
            return Err("groups are nested too deeply");
        }
        let mut branches = vec![self.sequence(depth)?];
        while self.eat('|') {
            branches.push(self.sequence(depth)?);
        }
        Ok(if branches.len() == 1 {
            branches.remove(0)
        } else {
            Tree::Choice(branches)
        })
    }

    fn sequence(&mut self, depth: usize) -> Parsed<Tree> {
        let mut pieces = Vec::new();
        while let Some(c) = self.peek() {
            if matches!(c, '|' | ')') {
                break;
            }
            let atom = self.atom(depth)?;
            pieces.push(self.quantified(atom)?);
        }
        Ok(Tree::Sequence(pieces))
    }

    fn atom(&mut self, depth: usize) -> Parsed<Tree> {
        match self.next()? {
            '(' => {
                let inner = self.choice(depth + 1)?;
                if !self.eat(')') {
                    return Err("a group is not closed");
                }
                Ok(inner)
            }
            '[' => self.class(depth).map(Tree::Set),
            '.' => Ok(Tree::Set(CharSet::dot())),
            '\\' => self.escape().map(Tree::Set),
            '?' | '*' | '+' | '{' => Err("a quantifier with nothing before it"),
            '}' | ']' => Err("a closing bracket without an opening one"),
            c => Ok(Tree::Set(CharSet::one(c))),
        }
    }

    fn escape(&mut self) -> Parsed<CharSet> {
        let letter = self.next()?;
        if matches!(letter, 'p' | 'P' | 'w' | 'W') {
            return Err("Unicode categories (\\p, \\w) are not supported");
        }
        CharSet::escape(letter).ok_or("unknown escape sequence")
    }

    fn quantified(&mut self, atom: Tree) -> Parsed<Tree> {
        let (min, max) = match self.peek() {
            Some('?') => (0, Some(1)),
            Some('*') => (0, None),
            Some('+') => (1, None),
            Some('{') => {
                self.at += 1;
                let range = self.range()?;
                return Ok(Tree::Repeat {
                    what: Box::new(atom),
                    min: range.0,
                    max: range.1,
                });
            }
            _ => return Ok(atom),
        };
        self.at += 1;
        Ok(Tree::Repeat {
            what: Box::new(atom),
            min,
            max,
        })
    }

    fn range(&mut self) -> Parsed<(u32, Option<u32>)> {
        let min = self.number()?;
        let max = match self.next()? {
            '}' => return Ok((min, Some(min))),
            ',' if self.eat('}') => return Ok((min, None)),
            ',' => self.number()?,
            _ => return Err("a quantifier is not closed"),
        };
        if !self.eat('}') {
            return Err("a quantifier is not closed");
        }
        if max < min {
            return Err("a quantifier with a maximum below its minimum");
        }
        Ok((min, Some(max)))
    }

    fn number(&mut self) -> Parsed<u32> {
        let digits: String = self.chars[self.at..]
            .iter()
            .take_while(|c| c.is_ascii_digit())
            .collect();
        self.at += digits.len();
        let number: u32 = digits.parse().map_err(|_| "a quantifier needs a number")?;
        if number > MAX_REPEAT {
            Err("a quantifier greater than 1000")
        } else {
            Ok(number)
        }
    }

    /// Reads a class after its opening bracket.
    fn class(&mut self, depth: usize) -> Parsed<CharSet> {
        if depth > MAX_DEPTH {
            return Err("classes are nested too deeply");
        }
        let negative = self.eat('^');
        let mut set = CharSet::default();
        let mut minus = None;
        loop {
            match self.next()? {
                ']' => break,
                '[' => return Err("an opening bracket inside a class"),
                '-' if self.eat('[') => {
                    minus = Some(self.class(depth + 1)?);
                    if !self.eat(']') {
                        return Err("a class is not closed");
                    }
                    break;
                }
                c => set.add(&self.member(c)?),
            }
        }
        let set = if negative { set.negated() } else { set };
        Ok(minus.map_or(set.clone(), |minus| set.without(&minus)))
    }

    /// Reads one character, escape or range of a class.
    fn member(&mut self, first: char) -> Parsed<CharSet> {
        let (start, set) = if first == '\\' {
            let set = self.escape()?;
            let single = set
                .ranges()
                .first()
                .filter(|range| range.0 == range.1 && set.ranges().len() == 1);
            (single.and_then(|range| char::from_u32(range.0)), set)
        } else {
            (Some(first), CharSet::one(first))
        };
        let range_follows = self.peek() == Some('-')
            && self
                .chars
                .get(self.at + 1)
                .is_some_and(|&after| after != ']' && after != '[');
        let (Some(start), true) = (start, range_follows) else {
            return Ok(set);
        };
        self.at += 1;
        let last = match self.next()? {
            '\\' => {
                let set = self.escape()?;
                set.ranges()
                    .first()
                    .and_then(|range| char::from_u32(range.0))
                    .ok_or("an empty range")?
            }
            c => c,
        };
        if last < start {
            Err("a range with its end before its start")
        } else {
            Ok(CharSet::range(start, last))
        }
    }
}
