//! XPath expressions of elements: printed for people and tools, and led back to the element.
//!
//! Names are printed without prefix, as rules know them; an expression with prefixes is read as if
//! it had none.

mod cache;
mod evaluate;
mod parse;
mod print;

pub use cache::XPaths;
pub use parse::XPathError;

use crate::document::Document;
use crate::node::Node;

impl Node<'_> {
    /// An XPath that a person recognises the element by:
    /// `/OpenDRIVE/road[@id='5']/lanes/laneSection[2]`. Each step bears the id (in OpenSCENARIO
    /// the name) if that tells the element from its equally named siblings, else its number among
    /// them if it has any. Takes time in proportion to the siblings on the way; whoever prints
    /// many of one document holds [`XPaths`].
    ///
    /// Empty for character data.
    pub fn xpath(&self) -> String {
        print::xpath(*self)
    }

    /// The XPath with each element's number among its equally named siblings:
    /// `/OpenDRIVE[1]/road[3]`. Empty for character data.
    pub fn positional_xpath(&self) -> String {
        print::positional(*self)
    }
}

impl<'a> Document<'a> {
    /// The elements that an XPath means, in document order, each once.
    ///
    /// Understands what [`Node::xpath`] prints and what other tools usually do: steps by `/` and
    /// `//` with a name or `*`, and the predicates `[3]`, `[last()]`, `[@id]`, `[@id='5']`,
    /// `[@a='x' and @b='y']` and `[local-name()='road']`. A last step `@attribute` or `text()` leads to the element that
    /// bears it, whether or not it does, for findings often point at what is missing.
    ///
    /// # Errors
    /// When the expression is malformed or uses more of XPath than this.
    pub fn evaluate(&self, xpath: &str) -> Result<Vec<Node<'a>>, XPathError> {
        Ok(evaluate::evaluate(*self, None, &parse::parse(xpath)?))
    }
}

impl<'a> Node<'a> {
    /// The elements that an XPath means from here: as [`Document::evaluate`], but a step without `/` before it leads
    /// to what lies directly within this element, and `.`, `.//` and leading `..` are understood.
    ///
    /// # Errors
    /// As [`Document::evaluate`].
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

/// What follows a leading `.` or `..` (then `true`), with the `/` or `//` behind it if more than one may follow.
fn leading_dots(path: &str) -> Option<(&str, bool)> {
    let (rest, is_up) = match path.strip_prefix("..") {
        Some(rest) => (rest, true),
        None => (path.strip_prefix('.')?, false),
    };
    match rest.strip_prefix('/') {
        None if rest.is_empty() => Some((rest, is_up)),
        None => None,
        // Steps follow: `//` stays, and so do further dots.
        Some(further) if further.starts_with('.') => Some((further, is_up)),
        Some(_) => Some((rest, is_up)),
    }
}
