//! Parser: builds a tree from lexemes, with one method for each line of the grammar.

use std::f64::consts::E;

use super::lexer::{Lexeme, Lexer, Token};
use super::tree::{Link, Node, NodeKind};
use super::words::{self, Form, Function, Operator};
use super::{Fault, FaultKind, MAX_DEPTH, MAX_LENGTH, Value, quoted};

const MISSING_END: &str = "the expression ends without its `}`";

type Parsed<'t> = Result<Node<'t>, Fault>;

/// Parses the whole of `text` as one expression.
pub(super) fn parse(text: &str) -> Parsed<'_> {
    if text.len() > MAX_LENGTH {
        let length = text.len();
        let text = format!("the expression has {length} bytes; at most {MAX_LENGTH} are allowed");
        return Err(Fault::new(FaultKind::Limit, 0, text));
    }
    let mut lexer = Lexer::new(text)?;
    let ahead = lexer.read()?;
    Parser {
        lexer,
        ahead,
        depth: 0,
    }
    .attribute()
}

struct Parser<'t> {
    lexer: Lexer<'t>,
    /// Lookahead lexeme.
    ahead: Lexeme<'t>,
    /// Number of open brackets, calls and signs.
    depth: usize,
}

impl<'t> Parser<'t> {
    fn attribute(mut self) -> Parsed<'t> {
        if self.ahead.token == Token::Close {
            let text = "the expression is empty; it needs a value, like `${1}`";
            return Err(Fault::evaluation(self.ahead.at, text));
        }
        let tree = self.or()?;
        if self.ahead.token != Token::Close {
            return Err(self.misplaced(None));
        }
        match self.lexer.left() {
            (_, "") => Ok(tree),
            (at, left) => {
                let found = quoted(left);
                let text =
                    format!("an expression must be the whole value, but {found} follows its `}}`");
                Err(Fault::evaluation(at, text))
            }
        }
    }

    fn or(&mut self) -> Parsed<'t> {
        self.chain(&words::OR, Parser::and)
    }

    fn and(&mut self) -> Parsed<'t> {
        self.chain(&words::AND, Parser::not)
    }

    fn not(&mut self) -> Parsed<'t> {
        let at = self.ahead.at;
        if self.eat("not")? {
            let operand = self.nested(at, Parser::not)?;
            let kind = NodeKind::Not(Box::new(operand));
            return Ok(Node { at, kind });
        }
        self.sum()
    }

    fn sum(&mut self) -> Parsed<'t> {
        self.chain(&words::SUM, Parser::product)
    }

    fn product(&mut self) -> Parsed<'t> {
        self.chain(&words::PRODUCT, Parser::unary)
    }

    fn unary(&mut self) -> Parsed<'t> {
        let at = self.ahead.at;
        if self.eat("-")? {
            let operand = self.nested(at, Parser::unary)?;
            let kind = NodeKind::Minus(Box::new(operand));
            return Ok(Node { at, kind });
        }
        if self.ahead.text == "not" {
            // The grammar does not allow this `not`, as in `1 + not true`. The message that it is
            // no number is more helpful than one about its position.
            return self.not();
        }
        self.primary()
    }

    fn primary(&mut self) -> Parsed<'t> {
        let Lexeme { at, text, token } = self.ahead;
        let kind = match (token, text) {
            (Token::Number, _) => NodeKind::Number(text),
            (Token::Parameter, _) => NodeKind::Parameter(text.trim_start_matches('$')),
            (Token::Word, "true") => NodeKind::Constant(Value::Boolean(true)),
            (Token::Word, "false") => NodeKind::Constant(Value::Boolean(false)),
            (Token::Word, "pi") => NodeKind::Pi,
            (Token::Word, _) if let Some(function) = Function::named(text) => {
                return self.call(function);
            }
            (Token::Sign, "(") => return self.brackets(),
            _ => return Err(self.no_operand()),
        };
        self.advance()?;
        Ok(Node { at, kind })
    }

    fn brackets(&mut self) -> Parsed<'t> {
        let opening = self.ahead;
        self.advance()?;
        let inner = self.nested(opening.at, Parser::or)?;
        if !self.eat(")")? {
            return Err(self.misplaced(Some(opening)));
        }
        // The node begins at its bracket.
        Ok(Node {
            at: opening.at,
            kind: inner.kind,
        })
    }

    fn call(&mut self, function: &'static Function) -> Parsed<'t> {
        let at = self.ahead.at;
        self.advance()?;
        let arguments = self.arguments(at, function)?;
        let count = arguments.len();
        let mut arguments = arguments.into_iter();
        let three = (arguments.next(), arguments.next(), arguments.next());
        let kind = match (function.form, three) {
            (Form::One(action), (Some(x), None, None)) => {
                NodeKind::Call1(function, action, Box::new(x))
            }
            (Form::Two(action), (Some(x), Some(y), None)) => {
                NodeKind::Call2(function, action, Box::new([x, y]))
            }
            _ => return Err(wrong_arguments(at, function, &count.to_string())),
        };
        Ok(Node { at, kind })
    }

    /// Parses the arguments of a function in their brackets. Any number is accepted here.
    fn arguments(&mut self, at: usize, function: &Function) -> Result<Vec<Node<'t>>, Fault> {
        let opening = self.ahead;
        if !self.eat("(")? {
            return Err(wrong_arguments(at, function, "no brackets"));
        }
        let mut arguments = Vec::new();
        if self.eat(")")? {
            return Ok(arguments);
        }
        loop {
            if matches!(self.ahead.text, "," | ")") {
                let found = format!("nothing before `{}`", self.ahead.text);
                return Err(wrong_arguments(self.ahead.at, function, &found));
            }
            arguments.push(self.nested(opening.at, Parser::or)?);
            if self.eat(")")? {
                return Ok(arguments);
            }
            if !self.eat(",")? {
                return Err(self.misplaced(Some(opening)));
            }
        }
    }

    /// Parses operands that are joined by any of the `operators`.
    fn chain(
        &mut self,
        operators: &'static [Operator],
        operand: fn(&mut Parser<'t>) -> Parsed<'t>,
    ) -> Parsed<'t> {
        let first = operand(self)?;
        let mut links = Vec::new();
        loop {
            let Lexeme { at, text, .. } = self.ahead;
            let Some(operator) = operators.iter().find(|known| known.symbol == text) else {
                break;
            };
            self.advance()?;
            links.push(Link {
                at,
                operator,
                operand: operand(self)?,
            });
        }
        if links.is_empty() {
            return Ok(first);
        }
        Ok(Node {
            at: first.at,
            kind: NodeKind::Chain(Box::new(first), links),
        })
    }

    /// Parses `inner` one level deeper. The level began at `at`.
    fn nested(&mut self, at: usize, inner: fn(&mut Parser<'t>) -> Parsed<'t>) -> Parsed<'t> {
        if self.depth == MAX_DEPTH {
            let text = format!("the expression is nested deeper than {MAX_DEPTH} levels");
            return Err(Fault::new(FaultKind::Limit, at, text));
        }
        self.depth += 1;
        let node = inner(self)?;
        self.depth -= 1;
        Ok(node)
    }

    fn advance(&mut self) -> Result<(), Fault> {
        self.ahead = self.lexer.read()?;
        Ok(())
    }

    /// Skips `expected` if it is the next lexeme, and returns whether it was.
    fn eat(&mut self, expected: &str) -> Result<bool, Fault> {
        let found = self.ahead.text == expected;
        if found {
            self.advance()?;
        }
        Ok(found)
    }

    /// Returns the reason why the next lexeme cannot be an operand.
    fn no_operand(&self) -> Fault {
        let Lexeme { at, text, token } = self.ahead;
        if token == Token::Word && !words::is_known(text) {
            return self.unknown_word(self.function_or_parameter());
        }
        let text = match text {
            "" => MISSING_END.to_owned(),
            "+" => "`+` must be between two numbers; a positive number has no sign".to_owned(),
            _ => format!(
                "an operand is missing before `{text}`: a number, `true`, `false`, a parameter \
                 like `$name`, a function or `(`"
            ),
        };
        Fault::evaluation(at, text)
    }

    /// Returns the reason why the next lexeme cannot follow an operand. `opening` is the open
    /// bracket, if any.
    fn misplaced(&self, opening: Option<Lexeme<'_>>) -> Fault {
        let Lexeme { at, text, token } = self.ahead;
        match (token, text, opening) {
            (Token::End, ..) => Fault::evaluation(at, MISSING_END),
            (Token::Close, _, Some(opening)) => Fault::evaluation(
                opening.at,
                "`(` is not closed; a `)` is missing before the `}`",
            ),
            (Token::Word, ..) if !words::is_known(text) => {
                self.unknown_word("the operators are `+ - * / % not and or`".to_owned())
            }
            (Token::Sign, ")", _) => Fault::evaluation(at, "`)` has no opening bracket"),
            (Token::Sign, ",", _) => Fault::evaluation(
                at,
                "`,` is allowed only between the arguments of a function; fractions have a point, `0.5`",
            ),
            _ => {
                let found = quoted(text);
                let text = format!("an operator is missing before {found}, like `+` or `and`");
                Fault::evaluation(at, text)
            }
        }
    }

    /// Reports that the language does not have the next word, and which alternative exists.
    fn unknown_word(&self, instead: String) -> Fault {
        let word = self.ahead.text;
        let way_out = match words::ignoring_case(word) {
            Some(known) => format!("words are case-sensitive; write `{known}`"),
            None => instead,
        };
        let found = quoted(word);
        let text = format!("{found} is not part of the expression language; {way_out}");
        Fault::new(FaultKind::Operator, self.ahead.at, text)
    }

    /// Suggests the meaning of an unknown word at the position of an operand.
    fn function_or_parameter(&self) -> String {
        let word = self.ahead.text;
        let is_called = self.lexer.clone().read().is_ok_and(|next| next.text == "(");
        if is_called {
            let names: Vec<&str> = words::FUNCTIONS.iter().map(|f| f.name).collect();
            format!("the functions are `{}`", names.join("`, `"))
        } else if word == "e" {
            format!("write the number as {E}")
        } else {
            format!("write a parameter as {}", quoted(&format!("${word}")))
        }
    }
}

fn wrong_arguments(at: usize, function: &Function, found: &str) -> Fault {
    let text = format!("{}, found {found}", function.takes());
    Fault::new(FaultKind::Arguments, at, text)
}
