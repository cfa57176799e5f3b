//! Conversion of an element to its XPath.

use std::fmt::Write;

use crate::attribute::Attribute;
use crate::document::Document;
use crate::node::Node;

pub(super) fn xpath(node: Node<'_>) -> String {
    let ids = id_attributes(node.document());
    join(node, |step| Step::of(step, ids))
}

pub(super) fn positional(node: Node<'_>) -> String {
    join(node, |step| {
        Step::Number(
            siblings(step)
                .take_while(|sibling| sibling != &step)
                .count() as u64
                + 1,
        )
    })
}

/// Joins the steps from the root to `node`; `step_of` returns each step.
pub(super) fn join<'a>(node: Node<'a>, mut step_of: impl FnMut(Node<'a>) -> Step<'a>) -> String {
    let mut path = String::new();
    if !node.is_element() {
        return path;
    }
    let mut steps: Vec<Node<'a>> = std::iter::once(node).chain(node.ancestors()).collect();
    steps.reverse();
    for step in steps {
        path.push('/');
        path.push_str(step.name());
        step_of(step).print(&mut path);
    }
    path
}

/// How an element is distinguished from its equally named siblings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step<'a> {
    /// It has no equally named sibling.
    Alone,
    /// Its number among the siblings, from 1.
    Number(u64),
    /// An attribute with a value that no sibling has.
    Id(Attribute<'a>),
}

impl<'a> Step<'a> {
    fn of(node: Node<'a>, ids: &[&str]) -> Step<'a> {
        for attribute in ids.iter().filter_map(|name| usable_id(node, name)) {
            let same = |other: &Node<'_>| other.attr(attribute.name()) == Some(attribute.value());
            if siblings(node).filter(same).nth(1).is_none() {
                return Step::Id(attribute);
            }
        }
        let mut before = 0;
        let mut after = false;
        for sibling in siblings(node) {
            before += u64::from(sibling < node);
            after |= sibling > node;
        }
        if before > 0 || after {
            Step::Number(before + 1)
        } else {
            Step::Alone
        }
    }

    fn print(self, path: &mut String) {
        // Writing into a string cannot fail.
        let _ = match self {
            Step::Alone => Ok(()),
            Step::Number(number) => write!(path, "[{number}]"),
            Step::Id(attribute) => {
                let quote = if attribute.value().contains('\'') {
                    '"'
                } else {
                    '\''
                };
                write!(
                    path,
                    "[@{}={quote}{}{quote}]",
                    attribute.name(),
                    attribute.value()
                )
            }
        };
    }
}

/// Returns the attributes that identify elements: `id` in roads, `name` in scenarios, else both.
pub(super) fn id_attributes(document: Document<'_>) -> &'static [&'static str] {
    match document.root().map_or("", |root| root.name()) {
        "OpenDRIVE" => &["id"],
        "OpenSCENARIO" => &["name"],
        _ => &["id", "name"],
    }
}

/// Returns the attribute if it is readable and can be quoted in XPath (which has no escapes).
pub(super) fn usable_id<'a>(node: Node<'a>, name: &str) -> Option<Attribute<'a>> {
    const LONGEST: usize = 120;
    let attribute = node.attribute(name)?;
    let value = attribute.value();
    let both_quotes = value.contains('\'') && value.contains('"');
    let usable = !value.is_empty()
        && value.len() <= LONGEST
        && !both_quotes
        && !value.contains(char::is_control);
    usable.then_some(attribute)
}

/// Returns the elements of the same name and parent, with the node itself, in document order.
fn siblings<'a>(node: Node<'a>) -> impl Iterator<Item = Node<'a>> {
    let parent = node.parent();
    let alone = parent.is_none().then_some(node);
    let children = parent
        .into_iter()
        .flat_map(move |parent| parent.children_named(node.name()));
    alone.into_iter().chain(children)
}
