//! Printing the XPaths of many elements without walking their siblings each time.

use foldhash::{HashMap, HashSet};

use super::print::{self, Step, id_attributes, usable_id};
use crate::attribute::Attribute;
use crate::document::Document;
use crate::node::Node;

/// Remembers, for one document, what tells elements from their siblings. The siblings of an
/// element are walked once, when the first of them is asked for; nothing is written to the image.
///
/// It borrows nothing, so that it can be kept beside the document; for the elements of any other
/// document it is no faster than [`Node::xpath`]. It is of no use beyond the life of the image:
/// another one may come to lie at the same place.
#[derive(Clone, Debug)]
pub struct XPaths {
    /// Where the document's image begins: what images are told apart by.
    document: usize,
    ids: &'static [&'static str],
    /// Elements whose children are in `steps`; the root's parent is not among them.
    known: HashSet<u32>,
    steps: HashMap<u32, Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    number: u64,
    by: By,
}

/// What tells an element from its siblings; [`Step`] without the attribute itself.
#[derive(Clone, Copy, Debug)]
enum By {
    Nothing,
    Number,
    Id(&'static str),
}

impl Known {
    const ROOT: Known = Known {
        number: 1,
        by: By::Nothing,
    };

    fn step<'n>(&self, node: Node<'n>) -> Step<'n> {
        match self.by {
            By::Nothing => Step::Alone,
            By::Number => Step::Number(self.number),
            By::Id(name) => usable_id(node, name).map_or(Step::Number(self.number), Step::Id),
        }
    }
}

impl XPaths {
    /// Remembers nothing yet.
    pub fn new(document: Document<'_>) -> XPaths {
        XPaths {
            document: document.address().addr(),
            ids: id_attributes(document),
            known: HashSet::default(),
            steps: HashMap::default(),
        }
    }

    /// The same as [`Node::xpath`].
    pub fn xpath(&mut self, node: Node<'_>) -> String {
        self.learn(node).map_or_else(
            || print::xpath(node),
            |()| print::join(node, |step| self.known(step).step(step)),
        )
    }

    /// The same as [`Node::positional_xpath`].
    pub fn positional_xpath(&mut self, node: Node<'_>) -> String {
        self.learn(node).map_or_else(
            || print::positional(node),
            |()| print::join(node, |step| Step::Number(self.known(step).number)),
        )
    }

    fn known(&self, node: Node<'_>) -> Known {
        let known = self.steps.get(&node.index()).copied();
        known.unwrap_or(Known::ROOT)
    }

    /// Walks the siblings of `node` and of its ancestors; `None` for a node of another document.
    fn learn(&mut self, node: Node<'_>) -> Option<()> {
        let document = node.document();
        if document.address().addr() != self.document {
            return None;
        }
        for parent in node.ancestors() {
            if !self.known.insert(parent.index()) {
                // Whoever learnt about it learnt about all above it.
                break;
            }
            self.learn_children(parent);
        }
        let root = document.root();
        if let Some(root) = root.filter(|root| !self.steps.contains_key(&root.index())) {
            let mut ids = self.ids.iter();
            let id = ids.find(|name| usable_id(root, name).is_some());
            let by = id.map_or(By::Nothing, |name| By::Id(name));
            self.steps.insert(root.index(), Known { number: 1, by });
        }
        Some(())
    }

    fn learn_children(&mut self, parent: Node<'_>) {
        let mut totals: HashMap<u16, u64> = HashMap::default();
        let mut values: HashMap<(u16, u16, &str), u32> = HashMap::default();
        let mut named: Vec<(&'static str, Attribute<'_>)> = Vec::new();
        for child in parent.children() {
            *totals.entry(child.name_number()).or_default() += 1;
            for name in self.ids {
                if let Some(id) = usable_id(child, name) {
                    *values.entry(key(child, id)).or_default() += 1;
                    named.push((name, id));
                }
            }
        }
        let mut named = named.into_iter().peekable();
        let mut numbers: HashMap<u16, u64> = HashMap::default();
        for child in parent.children() {
            let number = numbers.entry(child.name_number()).or_default();
            *number += 1;
            let mut unique = None;
            while let Some((name, id)) = named.next_if(|(_, id)| id.node() == child) {
                let alone = || values.get(&key(child, id)) == Some(&1);
                unique = unique.or_else(|| alone().then_some(name));
            }
            let by = match unique {
                Some(name) => By::Id(name),
                None if totals.get(&child.name_number()) == Some(&1) => By::Nothing,
                None => By::Number,
            };
            let number = *number;
            self.steps.insert(child.index(), Known { number, by });
        }
    }
}

/// What tells elements apart among all children of one parent.
fn key<'n>(child: Node<'n>, id: Attribute<'n>) -> (u16, u16, &'n str) {
    (child.name_number(), id.name_number(), id.value())
}
