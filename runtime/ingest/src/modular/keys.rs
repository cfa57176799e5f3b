//! Applies the keys of a reference to the attributes that they fit.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU32, Ordering};

use qcbus_document::{Attribute, Node};

use super::OFFERS;
use super::copy::{Copy, Value};
use super::problem::{Problem, Problems, Spot, What};

/// A `ParameterReference` of a use.
#[derive(Debug)]
pub struct Key<'d> {
    /// The element.
    pub node: Node<'d>,
    /// Its `key`: an attribute name, optionally preceded by its element and by further ancestors.
    pub key: &'d str,
    /// Its `value`.
    pub value: Attribute<'d>,
    /// Number of attributes that the key fits.
    pub fits: AtomicU32,
    /// Number of attributes that have taken its value.
    pub wins: AtomicU32,
}

/// Reads the `ParameterReference` elements of a use.
pub(super) fn read<'d>(within: Node<'d>, problems: &mut Problems<'d>) -> Vec<Key<'d>> {
    let mut keys: Vec<Key<'d>> = Vec::new();
    let mut first: HashMap<&str, Node<'d>> = HashMap::new();
    for node in within.children_named("ParameterReference") {
        let (Some(key), Some(value)) = (node.attr("key"), node.attribute("value")) else {
            problems.push(Problem {
                what: What::KeyMalformed,
                at: Spot::Node(node),
                target: None,
                text: "`ParameterReference` needs the attributes `key` and `value`".to_owned(),
            });
            continue;
        };
        // Each empty key is reported separately as unmatched, so it is not reported as a duplicate.
        let before = first.get(key).filter(|_| !key.trim().is_empty());
        if let Some(&before) = before {
            let text = match before.attr("value") == Some(value.value()) {
                true => {
                    format!("the key `{key}` is given twice with the same value; remove one")
                }
                false => format!(
                    "the key `{key}` is given twice; the reference tool takes the later value, `{}`, instead of \
                     `{}`: remove the wrong one",
                    value.value(),
                    before.attr("value").unwrap_or("")
                ),
            };
            problems.push(Problem {
                what: What::KeyTwice,
                at: Spot::of(node, "key"),
                target: Some(Spot::of(before, "key")),
                text,
            });
        } else {
            first.insert(key, node);
        }
        keys.push(Key {
            node,
            key,
            value,
            fits: AtomicU32::new(0),
            wins: AtomicU32::new(0),
        });
    }
    keys
}

/// Returns the attributes that an element offers for replacement and has.
pub fn offered<'d>(element: Node<'d>) -> impl Iterator<Item = Attribute<'d>> {
    let listed = element.attr(OFFERS).unwrap_or("");
    let names = listed.split(',').map(str::trim);
    names.filter_map(move |name| element.attribute(name).filter(|_| name != OFFERS))
}

/// Puts the values of keys into a copy. If several keys fit an attribute, the most specific one
/// wins. It names the most elements around the attribute.
pub(super) fn apply<'d>(
    copy: &mut Copy<'d>,
    piece: usize,
    keys: &[Key<'d>],
    problems: &mut Problems<'d>,
) {
    if keys.is_empty() {
        return;
    }
    let table = Table::of(keys);
    let group = copy.group;
    for element in group.descendants() {
        for attribute in offered(element) {
            let fitting = table.fitting(attribute);
            let Some((&best, others)) = fitting.split_last() else {
                continue;
            };
            for &other in others {
                overlap(&keys[best[0]], &keys[other[0]], attribute, problems);
            }
            for &index in fitting.iter().copied().flatten() {
                keys[index].fits.fetch_add(1, Ordering::Relaxed);
            }
            // If equal keys agree, the last one is used.
            let Some(&winner) = best.last() else { continue };
            let winner = &keys[winner];
            let different = |&&index: &&usize| keys[index].value.value() != winner.value.value();
            if let Some(&other) = best.iter().find(different) {
                tie(winner, &keys[other], attribute, problems);
                continue;
            }
            winner.wins.fetch_add(1, Ordering::Relaxed);
            copy.edits
                .insert(attribute.offset(), Value::of(piece, winner.value));
        }
    }
}

/// Reports the keys that fit no attribute in any copy of a use. `group` is the first copied group.
pub(super) fn say_unmatched<'d>(keys: &[Key<'d>], group: Node<'d>, problems: &mut Problems<'d>) {
    let lost = keys
        .iter()
        .filter(|key| key.fits.load(Ordering::Relaxed) == 0);
    lost.for_each(|key| problems.push(unmatched(key, group)));
}

/// Keys by their text.
struct Table<'k> {
    by_text: HashMap<&'k str, Vec<usize>>,
    /// Maximum number of parts of a key.
    longest: usize,
}

impl<'k> Table<'k> {
    fn of(keys: &[Key<'k>]) -> Table<'k> {
        let mut by_text: HashMap<&str, Vec<usize>> = HashMap::new();
        for (index, key) in keys.iter().enumerate() {
            by_text.entry(key.key).or_default().push(index);
        }
        let longest = by_text.keys().map(|key| key.split('.').count()).max();
        Table {
            by_text,
            longest: longest.unwrap_or(0),
        }
    }

    /// Returns the keys that fit an attribute, the most specific last. Equal keys are grouped.
    fn fitting(&self, attribute: Attribute<'_>) -> Vec<&[usize]> {
        let element = attribute.node();
        let mut path = attribute.name().to_owned();
        let mut found: Vec<&[usize]> = Vec::new();
        found.extend(self.by_text.get(path.as_str()).map(Vec::as_slice));
        let around = std::iter::once(element).chain(element.ancestors());
        for element in around.take(self.longest.saturating_sub(1)) {
            path.insert(0, '.');
            path.insert_str(0, element.name());
            found.extend(self.by_text.get(path.as_str()).map(Vec::as_slice));
        }
        found
    }
}

fn overlap<'d>(
    best: &Key<'d>,
    other: &Key<'d>,
    attribute: Attribute<'d>,
    problems: &mut Problems<'d>,
) {
    // An overlap of two keys is reported once, however many attributes they share.
    if best.value.value() == other.value.value() || !problems.is_new_overlap(best.node, other.node)
    {
        return;
    }
    let of_the_tool = match other.key.contains('.') {
        true => "one of the two at random",
        false => "the key without an element",
    };
    let text = format!(
        "the keys `{}` and `{}` both match `{}` of `{}` and give it different values, `{}` and `{}`: here the \
         key that names more elements wins, but the reference tool takes {of_the_tool}",
        best.key,
        other.key,
        attribute.name(),
        attribute.node().name(),
        best.value.value(),
        other.value.value()
    );
    problems.push(Problem {
        what: What::KeyOverlap,
        at: Spot::of(other.node, "key"),
        target: Some(Spot::Attribute(attribute)),
        text,
    });
}

fn tie<'d>(one: &Key<'d>, other: &Key<'d>, attribute: Attribute<'d>, problems: &mut Problems<'d>) {
    // A tie of two keys is reported once, however many attributes they fit.
    let is_said =
        |problem: &Problem<'d>| problem.what == What::KeyTie && problem.at.node() == one.node;
    if problems.lately(is_said) {
        return;
    }
    let text = format!(
        "`{}` of `{}` can have only one value, but the key `{}` gives it `{}` and `{}`",
        attribute.name(),
        attribute.node().name(),
        one.key,
        other.value.value(),
        one.value.value()
    );
    problems.push(Problem {
        what: What::KeyTie,
        at: Spot::of(one.node, "key"),
        target: Some(Spot::Attribute(attribute)),
        text,
    });
}

fn unmatched<'d>(key: &Key<'d>, group: Node<'d>) -> Problem<'d> {
    let name = group.attr("name").unwrap_or("");
    let text = match key.key.trim().is_empty() {
        true => format!(
            "`key` is empty, so its value `{}` is not used",
            key.value.value()
        ),
        false => format!(
            "the key `{}` matches no attribute that the group `{name}` offers by `{OFFERS}`, so its value `{}` \
             is not used",
            key.key,
            key.value.value()
        ),
    };
    Problem {
        what: What::KeyUnmatched,
        at: Spot::of(key.node, "key"),
        target: Some(Spot::Node(group)),
        text,
    }
}
