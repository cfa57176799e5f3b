//! XPath expressions of elements: printing for people and tools, and evaluation back to elements.
//!
//! Names are printed without prefix, as in rules. Prefixes in an expression are ignored when it is
//! read.

mod cache;
mod evaluate;
mod parse;
mod print;

pub use cache::XPaths;
pub use parse::XPathError;

use crate::document::Document;
use crate::node::Node;

impl Node<'_> {
    /// Returns an XPath by which a person recognises the element:
    /// `/OpenDRIVE/road[@id='5']/lanes/laneSection[2]`. Each step contains the id (in OpenSCENARIO
    /// the name) if it is unique among the equally named siblings. Otherwise the step contains the
    /// element's number among them, if there are any. The cost grows with the number of siblings on
    /// the way; use [`XPaths`] to print many XPaths of one document.
    ///
    /// Empty for character data.
    pub fn xpath(&self) -> String {
        print::xpath(*self)
    }

    /// Returns the XPath with each element's number among its equally named siblings:
    /// `/OpenDRIVE[1]/road[3]`. Empty for character data.
    pub fn positional_xpath(&self) -> String {
        print::positional(*self)
    }
}

impl<'a> Document<'a> {
    /// Returns the elements that an XPath selects, in document order, each once.
    ///
    /// Supports the output of [`Node::xpath`] and common expressions of other tools: steps by `/`
    /// and `//` with a name or `*`, and the predicates `[3]`, `[last()]`, `[@id]`, `[@id='5']`,
    /// `[@a='x' and @b='y']` and `[local-name()='road']`. A last step `@attribute` or `text()`
    /// selects the element itself, even without it, because findings often point at missing items.
    ///
    /// # Errors
    /// The expression is malformed or uses more of XPath than this.
    pub fn evaluate(&self, xpath: &str) -> Result<Vec<Node<'a>>, XPathError> {
        Ok(evaluate::evaluate(*self, None, &parse::parse(xpath)?))
    }
}

impl<'a> Node<'a> {
    /// Evaluates an XPath from here, like [`Document::evaluate`]. A first step without `/` selects
    /// children of this element. `.`, `.//` and leading `..` are supported.
    ///
    /// # Errors
    /// The errors of [`Document::evaluate`].
    pub fn evaluate(&self, xpath: &str) -> Result<Vec<Node<'a>>, XPathError> {
        let mut path = xpath.trim();
        if path.is_empty() || path.starts_with('/') {
            return self.document().evaluate(path);
        }
        let mut from = Some(*self);
        while let Some((rest, is_up)) = leading_dots(path) {
            if is_up {
                from = from.and_then(|node| node.parent());
            }
            path = rest;
        }
        let Some(from) = from else {
            return Ok(Vec::new());
        };
        if path.is_empty() {
            return Ok(vec![from]);
        }
        let rooted = match path.starts_with('/') {
            true => path.to_owned(),
            false => format!("/{path}"),
        };
        let steps = parse::parse(&rooted).map_err(|error| XPathError {
            xpath: xpath.to_owned(),
            at: error.at.saturating_sub(usize::from(rooted != path)) + (xpath.len() - path.len()),
            ..error
        })?;
        Ok(evaluate::evaluate(self.document(), Some(from), &steps))
    }
}

/// Splits off a leading `.` or `..` (then `true`). A `/` or `//` is kept if steps may follow.
fn leading_dots(path: &str) -> Option<(&str, bool)> {
    let (rest, is_up) = match path.strip_prefix("..") {
        Some(rest) => (rest, true),
        None => (path.strip_prefix('.')?, false),
    };
    match rest.strip_prefix('/') {
        None if rest.is_empty() => Some((rest, is_up)),
        None => None,
        // Steps follow: `//` is kept, and so are further dots.
        Some(further) if further.starts_with('.') => Some((further, is_up)),
        Some(_) => Some((rest, is_up)),
    }
}
