//! Evaluation of an XPath to the elements that it selects.

use super::parse::{Condition, Predicate, Step};
use crate::document::Document;
use crate::node::Node;

/// Start of a step: an element, or `None` for the document that contains the root.
type Context<'a> = Option<Node<'a>>;

pub(super) fn evaluate<'a>(
    document: Document<'a>,
    from: Context<'a>,
    steps: &[Step<'_>],
) -> Vec<Node<'a>> {
    let mut contexts: Vec<Context<'a>> = vec![from];
    for step in steps {
        let mut found = match (step.anywhere, step.name) {
            (true, Some(name)) if !step.counts() => {
                named_below(document, &outermost(&contexts), name, step)
            }
            (true, _) => select(
                document,
                &with_descendants(document, &outermost(&contexts)),
                step,
            ),
            (false, _) => select(document, &contexts, step),
        };
        found.sort_unstable();
        found.dedup();
        contexts = found.into_iter().map(Some).collect();
    }
    // `/` alone selects the document, and its root element represents it.
    contexts
        .into_iter()
        .filter_map(|context| context.or(document.root()))
        .collect()
}

impl Step<'_> {
    /// Checks whether a predicate depends on the order of siblings.
    fn counts(&self) -> bool {
        self.predicates
            .iter()
            .any(|predicate| !matches!(predicate, Predicate::All(_)))
    }

    fn admits(&self, node: &Node<'_>) -> bool {
        self.name.is_none_or(|name| node.is(name))
    }
}

/// Returns the children that a step selects. Positions count within each context.
fn select<'a>(document: Document<'a>, contexts: &[Context<'a>], step: &Step<'_>) -> Vec<Node<'a>> {
    let mut found = Vec::new();
    for context in contexts {
        let mut candidates: Vec<Node<'a>> = match context {
            Some(node) => node.children().filter(|child| step.admits(child)).collect(),
            None => document
                .root()
                .filter(|root| step.admits(root))
                .into_iter()
                .collect(),
        };
        for predicate in &step.predicates {
            retain(&mut candidates, predicate);
        }
        found.append(&mut candidates);
    }
    found
}

fn retain(candidates: &mut Vec<Node<'_>>, predicate: &Predicate<'_>) {
    let chosen = match predicate {
        Predicate::Number(number) => number.checked_sub(1),
        Predicate::Last => candidates.len().checked_sub(1),
        Predicate::All(conditions) => {
            candidates.retain(|node| conditions.iter().all(|condition| condition.holds(node)));
            return;
        }
    };
    let chosen = chosen.and_then(|index| candidates.get(index).copied());
    candidates.clear();
    candidates.extend(chosen);
}

impl Condition<'_> {
    fn holds(&self, node: &Node<'_>) -> bool {
        match *self {
            Condition::Has(name) => node.attribute(name).is_some(),
            Condition::Equals(name, value) => node.attr(name) == Some(value),
            Condition::LocalName(name) => node.is(name),
        }
    }
}

/// Evaluates `//name` without positions, with the postings.
fn named_below<'a>(
    document: Document<'a>,
    contexts: &[Context<'a>],
    name: &str,
    step: &Step<'_>,
) -> Vec<Node<'a>> {
    let mut found: Vec<Node<'a>> = Vec::new();
    for context in contexts {
        match context {
            Some(node) => found.extend(node.descendants_named(name)),
            None => found.extend(document.elements(name)),
        }
    }
    for predicate in &step.predicates {
        retain(&mut found, predicate);
    }
    found
}

/// Removes contexts within another one, because their descendants would be visited twice.
fn outermost<'a>(contexts: &[Context<'a>]) -> Vec<Context<'a>> {
    let mut outside = 0;
    let keep = |context: &&Context<'a>| match context {
        Some(node) if node.index() < outside => false,
        Some(node) => {
            outside = node.end();
            true
        }
        None => true,
    };
    contexts.iter().filter(keep).copied().collect()
}

fn with_descendants<'a>(document: Document<'a>, contexts: &[Context<'a>]) -> Vec<Context<'a>> {
    let mut all = Vec::new();
    for context in contexts {
        all.push(*context);
        match context {
            Some(node) => all.extend(node.descendants().map(Some)),
            None => {
                let root = document.root();
                all.extend(
                    root.into_iter()
                        .flat_map(|root| root.descendants())
                        .map(Some),
                );
                all.extend(root.map(Some));
            }
        }
    }
    all
}
