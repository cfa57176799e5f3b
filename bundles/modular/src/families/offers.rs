//! Attributes that groups offer for replacement, and the attributes that a key names.

use std::collections::HashMap;

use crate::prelude::*;
use qcbus_sdk::modular::offered;

/// Maximum number of attributes of one element and name for a key. No group offers more.
const MOST_ALIKE: usize = 256;

/// The attributes that the groups of a use offer.
pub struct Offers<'d> {
    /// All offered attributes in document order, group by group.
    pub all: Vec<Attribute<'d>>,
    /// The first attribute of each name.
    pub named: HashMap<&'d str, Attribute<'d>>,
    by_element: HashMap<(&'d str, &'d str), Vec<Attribute<'d>>>,
}

impl<'d> Offers<'d> {
    /// Collects the attributes that the groups of a use offer.
    pub fn of(one: &Use<'d>) -> Offers<'d> {
        let groups = one.copies.iter().map(|copy| copy.group);
        let all: Vec<_> = groups.flat_map(offered_in).collect();
        let mut named = HashMap::new();
        let mut by_element: HashMap<_, Vec<_>> = HashMap::new();
        for &attribute in &all {
            named.entry(attribute.name()).or_insert(attribute);
            let pair = (attribute.node().name(), attribute.name());
            let alike = by_element.entry(pair).or_default();
            if alike.len() < MOST_ALIKE {
                alike.push(attribute);
            }
        }
        Offers {
            all,
            named,
            by_element,
        }
    }

    /// Returns the attributes whose element and name match the last two parts of a key.
    pub fn ending(&self, key: &'d str) -> &[Attribute<'d>] {
        let mut parts = key.rsplit('.');
        let (Some(name), Some(element)) = (parts.next(), parts.next()) else {
            return &[];
        };
        self.by_element
            .get(&(element, name))
            .map_or(&[], Vec::as_slice)
    }

    /// Returns the attributes that the reference tool accepts for a key that is not their path. Of
    /// the elements around an attribute, the tool compares only the outermost one of the key.
    pub fn taken_loosely(&self, key: &'d str) -> impl Iterator<Item = Attribute<'d>> {
        let count = key.split('.').count();
        let outermost = key.split('.').next().unwrap_or("");
        let candidates = self.ending(key).iter().copied();
        candidates.filter(move |attribute| {
            let around = count.checked_sub(3);
            let ancestor = around.and_then(|around| attribute.node().ancestors().nth(around));
            ancestor.is_some_and(|ancestor| ancestor.is(outermost))
                && path(*attribute, count) != key
        })
    }
}

/// Returns the existing attributes that the elements of a group offer. Attributes that the group
/// itself offers are not replaced and are left out.
pub fn offered_in<'d>(group: Node<'d>) -> impl Iterator<Item = Attribute<'d>> {
    group.descendants().flat_map(offered)
}

/// Checks whether one name may be a misspelling of another. Very short names like `x` and `y` are
/// never taken for misspellings.
pub fn may_be_meant(written: &str, other: &str) -> bool {
    const SHORT: usize = 3;
    written.eq_ignore_ascii_case(other) || (written.len() >= SHORT && other.len() >= SHORT)
}

/// Returns the path of an attribute in `parts` parts: its name, its element, then those around.
pub fn path(attribute: Attribute<'_>, parts: usize) -> String {
    let element = attribute.node();
    let around = std::iter::once(element).chain(element.ancestors());
    let elements = around.take(parts.saturating_sub(1));
    let mut names: Vec<&str> = elements.map(|element| element.name()).collect();
    names.reverse();
    names.push(attribute.name());
    names.join(".")
}

/// Checks whether an element in any of the groups offers attributes.
pub fn offers_any(groups: &[Node<'_>]) -> bool {
    let mut elements = groups.iter().flat_map(|group| group.descendants());
    elements.any(|element| element.attr(OFFERS).is_some())
}

/// Returns the attributes in the groups that a key would match if they were offered.
pub fn unoffered<'a, 'd: 'a>(
    key: &'a str,
    groups: &'a [Node<'d>],
) -> impl Iterator<Item = Attribute<'d>> + use<'a, 'd> {
    let elements = groups.iter().flat_map(|group| group.descendants());
    elements.filter_map(move |element| named_by(key, element))
}

/// Returns the attribute of an element that a key names.
pub fn named_by<'d>(key: &str, element: Node<'d>) -> Option<Attribute<'d>> {
    let mut parts = key.rsplit('.');
    let attribute = element.attribute(parts.next()?);
    let attribute = attribute.filter(|attribute| !attribute.is(OFFERS))?;
    let mut around = std::iter::once(element).chain(element.ancestors());
    parts
        .all(|part| around.next().is_some_and(|element| element.is(part)))
        .then_some(attribute)
}
