use qcbus_document::{Attribute, Node};
use qcbus_sdk::modular::{Followed, Key, OFFERS, Spot, Use};
use qcbus_sdk::{Level, Rule, Sink};

use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::{short_name, taken_at};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_library_parameter_attributes_missing",
    uids: &["qcbus.dev:mosc:1.0.0:library.parameter_attributes_missing"],
    level: Level::Warning,
    page: include_str!("library_parameter_attributes_missing.md"),
    run,
    ..Rule::DEFAULTS
};

/// Most elements that a finding shows.
const MOST: usize = 5;

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for reference in &assembly.expansion.references {
        for one in &reference.uses {
            let Some(copy) = one.copies.first() else {
                continue;
            };
            let groups: Vec<Node<'_>> = one.copies.iter().map(|copy| copy.group).collect();
            if one.keys.is_empty() {
                continue;
            }
            let offers = |group: &Node<'_>| group.descendants().any(|it| it.attr(OFFERS).is_some());
            match groups.iter().any(offers) {
                true => say_unlisted(one, &groups, found),
                false => say_nothing_offered(reference, one, (copy.group, &groups), found),
            }
        }
    }
}

/// Of a group that offers nothing, where the keys would fit.
fn say_nothing_offered(
    reference: &Followed<'_>,
    one: &Use<'_>,
    (group, groups): (Node<'_>, &[Node<'_>]),
    found: &mut Sink<'_>,
) {
    let name = group.attr("name").unwrap_or("");
    let keys = match one.keys.len() {
        1 => "1 key is".to_owned(),
        many => format!("{many} keys are"),
    };
    let text = format!(
        "{keys} given, but the group `{name}` of `{}` offers nothing to be replaced: no element in it has \
         `{OFFERS}`, which lists the attributes that keys may set",
        short_name(group.document())
    );
    let at = place(taken_at(reference, one));
    let mut finding = found
        .issue(at, text)
        .at(place(Spot::of(group, "name")), "the group");
    let wanted = one.keys.iter().flat_map(|key| {
        let fitting = fitting(key, groups).into_iter().next();
        fitting.map(|attribute| (key, attribute))
    });
    for (key, attribute) in wanted.take(MOST) {
        let there = format!(
            "the key `{}` would fit here, with `{OFFERS}=\"{}\"`",
            key.key,
            attribute.name()
        );
        finding = finding.at(attribute, there);
    }
}

/// The keys whose attributes are there and not offered.
fn say_unlisted(one: &Use<'_>, groups: &[Node<'_>], found: &mut Sink<'_>) {
    for key in one.keys.iter().filter(|key| key.fits.get() == 0) {
        let mut fitting = fitting(key, groups);
        // A list that nobody can read is another fault.
        fitting.retain(|attribute| !is_mentioned(*attribute));
        let Some(first) = fitting.first() else {
            continue;
        };
        let (attribute, element) = (first.name(), first.node());
        let offered = element.attr(OFFERS);
        let add = match offered {
            Some(listed) => format!("it lists only `{listed}` in `{OFFERS}`"),
            None => format!("it has no `{OFFERS}=\"{attribute}\"`"),
        };
        let text = format!(
            "the key `{}` asks for `{attribute}` of `{}`, which is there but not offered: {add}; mend it in `{}`",
            key.key,
            element.name(),
            short_name(element.document())
        );
        let mut finding = found.issue(place(Spot::of(key.node, "key")), text);
        for attribute in fitting.into_iter().take(MOST) {
            finding = finding.at(attribute, "the attribute that is not offered");
        }
    }
}

/// The attributes of groups that a key would fit if they were offered. A group's own cannot be.
fn fitting<'d>(key: &Key<'_>, groups: &[Node<'d>]) -> Vec<Attribute<'d>> {
    let mut path: Vec<&str> = key.key.split('.').collect();
    let Some(name) = path.pop().filter(|name| *name != OFFERS) else {
        return Vec::new();
    };
    let is_there = |element: &Node<'d>| {
        let around = std::iter::once(*element).chain(element.ancestors());
        let names: Vec<&str> = around.take(path.len()).map(|it| it.name()).collect();
        names.iter().eq(path.iter().rev())
    };
    let elements = groups
        .iter()
        .flat_map(|group| group.descendants())
        .filter(is_there);
    elements
        .filter_map(|element| element.attribute(name))
        .collect()
}

fn is_mentioned(attribute: Attribute<'_>) -> bool {
    let listed = attribute.node().attr(OFFERS).unwrap_or("");
    let mut words = listed.split(|c: char| !c.is_alphanumeric() && c != '_');
    words.any(|word| word == attribute.name())
}
