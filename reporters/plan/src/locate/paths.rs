//! Search for the element of a finding by its XPath; suitable for very many findings.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;

use qcbus_document::{Document, Node};

/// Elements with more children than this cache them by number and id.
const MANY: usize = 24;

/// Maximum number of nodes that are visited for XPaths without the plain form.
const WORK: u64 = 50_000_000;

/// Minimum cost of an XPath without the plain form.
const STEP: u64 = 10_000;

/// Finder of elements in one document.
pub(super) struct Paths<'a> {
    document: Document<'a>,
    /// Cached children of elements with many children.
    children: RefCell<HashMap<u32, Children<'a>>>,
    /// Remaining work for XPaths without the plain form.
    left: Cell<u64>,
}

/// The many children of an element.
struct Children<'a> {
    named: HashMap<&'a str, Vec<Node<'a>>>,
    /// First child for each element name, attribute name and attribute value.
    with: HashMap<(&'a str, String), HashMap<&'a str, Node<'a>>>,
}

/// A step in the form that `Node::xpath` prints.
struct Step<'x> {
    name: &'x str,
    which: Which<'x>,
}

enum Which<'x> {
    First,
    /// Position, counted from one.
    Number(usize),
    With(&'x str, &'x str),
}

impl<'a> Paths<'a> {
    pub(super) fn new(document: Document<'a>) -> Paths<'a> {
        Paths {
            document,
            children: RefCell::default(),
            left: Cell::new(WORK),
        }
    }

    /// Returns the first element that an XPath matches. If the last step is an attribute or text,
    /// it returns the element that contains it.
    pub(super) fn find(&self, xpath: &str) -> Option<Node<'a>> {
        self.follow(xpath).or_else(|| self.evaluate(xpath))
    }

    /// Follows an XPath of plain steps. Returns `None` if it has other steps. If a step matches
    /// several elements, only the first is followed; `None` if that one does not lead on.
    fn follow(&self, xpath: &str) -> Option<Node<'a>> {
        let mut rest = xpath.trim();
        let mut at: Option<Node<'a>> = None;
        while !rest.is_empty() {
            rest = rest.strip_prefix('/')?;
            if rest == "text()" || rest.strip_prefix('@').is_some_and(is_name) {
                break;
            }
            let (step, after) = step(rest)?;
            at = Some(match at {
                Some(node) => self.child(node, &step)?,
                None => self.root(&step)?,
            });
            rest = after;
        }
        at
    }

    fn root(&self, step: &Step<'_>) -> Option<Node<'a>> {
        let root = self.document.root().filter(|root| root.is(step.name))?;
        let is_meant = match step.which {
            Which::First => true,
            Which::Number(number) => number == 1,
            Which::With(name, value) => root.attr(name) == Some(value),
        };
        is_meant.then_some(root)
    }

    fn child(&self, node: Node<'a>, step: &Step<'_>) -> Option<Node<'a>> {
        if node.children().nth(MANY).is_some() {
            return self.child_of_many(node, step);
        }
        let mut named = node.children_named(step.name);
        match step.which {
            Which::First => named.next(),
            Which::Number(number) => named.nth(number.checked_sub(1)?),
            Which::With(name, value) => named.find(|child| child.attr(name) == Some(value)),
        }
    }

    fn child_of_many(&self, node: Node<'a>, step: &Step<'_>) -> Option<Node<'a>> {
        let mut all = self.children.borrow_mut();
        let children = all
            .entry(node.index())
            .or_insert_with(|| Children::of(node));
        match step.which {
            Which::First => children.named.get(step.name)?.first().copied(),
            Which::Number(number) => {
                let named = children.named.get(step.name)?;
                named.get(number.checked_sub(1)?).copied()
            }
            Which::With(name, value) => children.with(step.name, name, value),
        }
    }

    /// Evaluates an XPath that `follow` does not support, up to the work limit for such XPaths.
    fn evaluate(&self, xpath: &str) -> Option<Node<'a>> {
        let anywhere = xpath.contains("//");
        let price = if anywhere {
            u64::from(self.document.len())
        } else {
            0
        };
        self.left.set(self.left.get().checked_sub(price.max(STEP))?);
        let found = self.document.evaluate(xpath).ok()?;
        found.first().copied()
    }
}

impl<'a> Children<'a> {
    fn of(node: Node<'a>) -> Children<'a> {
        let mut named: HashMap<&'a str, Vec<Node<'a>>> = HashMap::new();
        for child in node.children() {
            named.entry(child.name()).or_default().push(child);
        }
        Children {
            named,
            with: HashMap::new(),
        }
    }

    fn with(&mut self, element: &str, attribute: &str, value: &str) -> Option<Node<'a>> {
        let (&element, nodes) = self.named.get_key_value(element)?;
        let known = self
            .with
            .entry((element, attribute.to_owned()))
            .or_insert_with(|| {
                let mut first = HashMap::new();
                for node in nodes {
                    if let Some(value) = node.attr(attribute) {
                        first.entry(value).or_insert(*node);
                    }
                }
                first
            });
        known.get(value).copied()
    }
}

/// Returns the first step of `text` and the rest after it.
fn step(text: &str) -> Option<(Step<'_>, &str)> {
    let end = text.find(['/', '[']).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    if !is_name(name) {
        return None;
    }
    let Some(inside) = rest.strip_prefix('[') else {
        let which = Which::First;
        return Some((Step { name, which }, rest));
    };
    let (which, rest) = match inside.strip_prefix('@') {
        None => {
            let (number, rest) = inside.split_once(']')?;
            (Which::Number(number.parse().ok()?), rest)
        }
        Some(condition) => {
            let (attribute, quoted) = condition.split_once('=')?;
            let quote = quoted
                .chars()
                .next()
                .filter(|quote| matches!(quote, '\'' | '"'))?;
            let (value, rest) = quoted.get(1..)?.split_once(quote)?;
            if !is_name(attribute) {
                return None;
            }
            (Which::With(attribute, value), rest.strip_prefix(']')?)
        }
    };
    let ends = rest.is_empty() || rest.starts_with('/');
    ends.then_some((Step { name, which }, rest))
}

/// Checks whether this is a plain name without a prefix.
fn is_name(text: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
    !text.is_empty() && text.chars().all(plain) && !text.starts_with(['-', '.'])
}
