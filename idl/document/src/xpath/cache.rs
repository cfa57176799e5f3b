//! Cache for printing the XPaths of many elements without walking their siblings each time.

use foldhash::{HashMap, HashSet};

use super::print::{self, Step, id_attributes, usable_id};
use crate::attribute::Attribute;
use crate::document::Document;
use crate::node::Node;

/// Cache of the ids and numbers that distinguish the siblings of one document. The siblings of an
/// element are walked once, when the first of them is requested. The image is not modified.
///
/// The cache borrows nothing, so it can be stored beside the document. For elements of any other
/// document it is no faster than [`Node::xpath`]. It must not be used after the image is freed,
/// because another image may later have the same address.
#[derive(Clone, Debug)]
pub struct XPaths {
    /// Start address of the document's image, which identifies the image.
    document: usize,
    ids: &'static [&'static str],
    /// Elements with their children in `steps`; the document node above the root is not included.
    known: HashSet<u32>,
    steps: HashMap<u32, Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    number: u64,
    by: By,
}

/// How an element is distinguished from its siblings: a [`Step`] without the attribute itself.
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
    /// Creates an empty cache.
    pub fn new(document: Document<'_>) -> XPaths {
        XPaths {
            document: document.address().addr(),
            ids: id_attributes(document),
            known: HashSet::default(),
            steps: HashMap::default(),
        }
    }

    /// Returns the same as [`Node::xpath`].
    pub fn xpath(&mut self, node: Node<'_>) -> String {
        self.learn(node).map_or_else(
            || print::xpath(node),
            |()| print::join(node, |step| self.known(step).step(step)),
        )
    }

    /// Returns the same as [`Node::positional_xpath`].
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

    /// Walks the siblings of `node` and its ancestors; `None` for a node of another document.
    fn learn(&mut self, node: Node<'_>) -> Option<()> {
        let document = node.document();
        if document.address().addr() != self.document {
            return None;
        }
        for parent in node.ancestors() {
            if !self.known.insert(parent.index()) {
                // A known parent implies that all its ancestors are known too.
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

/// Returns the key that distinguishes the ids of all children of one parent.
fn key<'n>(child: Node<'n>, id: Attribute<'n>) -> (u16, u16, &'n str) {
    (child.name_number(), id.name_number(), id.value())
}
