use crate::families::object_parts::{named, number};
use crate::families::on_road::OnRoad;
use crate::families::roadside::{place, things};
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[NEAR],
    each: Some(each),
    ..Rule::after(READABLE)
};

const NEAR: Param = Param::number(
    "near",
    0.01,
    "m",
    "grid size within which positions count as the same",
);

/// Attributes that distinguish two signals or objects at one place.
const WORDS: [&str; 6] = ["type", "subtype", "name", "orientation", "value", "text"];
const NUMBERS: [&str; 3] = ["zOffset", "hOffset", "hdg"];
/// Parts and validities of an object or signal. Elements with one of these may share a place.
const PARTS: [&str; 9] = [
    "repeat",
    "outline",
    "outlines",
    "skeleton",
    "validity",
    "staticBoard",
    "vmsBoard",
    "multiBoard",
    "positionInertial",
];

/// Name of the element, its words, and its numbers other than s and t as positions in the grid.
type Key<'a> = (&'a str, [Option<&'a str>; 6], [i64; 3]);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let grid = found.number(&NEAR).max(1e-9);
    for road in map.part(part).roads() {
        let cell = |value: f64| (value / grid).round() as i64;
        let mut stands: Vec<Stand<'_>> = things(road)
            .filter_map(|thing| {
                let (s, t) = place(thing, road)?;
                Some((cell(s), cell(t), thing, s, t))
            })
            .collect();
        stands.sort_unstable_by_key(|(s, t, thing, ..)| (*s, *t, thing.index()));
        // Nearly all elements are alone at their place, so their attributes are not read.
        let together = stands.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1));
        for group in together.filter(|group| group.len() > 1) {
            twins(road, group, grid, found);
        }
    }
}

/// Position of an element in the grid, the element, its s and t.
type Stand<'a> = (i64, i64, Node<'a>, f64, f64);

/// Reports duplicates among the elements at one place.
fn twins(road: &Road<'_>, group: &[Stand<'_>], grid: f64, found: &mut Sink<'_>) {
    let mut seen: HashMap<Key<'_>, Node<'_>> = HashMap::default();
    for (_, _, thing, s, t) in group.iter().copied() {
        if PARTS.iter().any(|part| thing.child(part).is_some()) {
            continue;
        }
        let cell = |name: &str| (number(thing, name).unwrap_or(0.0) / grid).round() as i64;
        let key = (
            thing.name(),
            WORDS.map(|name| thing.attr(name).filter(|text| !text.is_empty())),
            NUMBERS.map(cell),
        );
        let Some(first) = seen.get(&key).copied() else {
            seen.insert(key, thing);
            continue;
        };
        // Another rule reports elements with the same id.
        if first.attr("id") == thing.attr("id") {
            continue;
        }
        let text = format!(
            "{} has the same position and kind as {}; one of them should be removed",
            named(thing),
            named(first)
        );
        found
            .issue(Place::attribute_or_node(thing, "id"), text)
            .on(road, s, t)
            .at(first, "the one before it");
    }
}
