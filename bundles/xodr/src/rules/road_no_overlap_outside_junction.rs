use crate::families::faults::shape_of;
use std::collections::BTreeSet;

use crate::families::overlap::{Limits, Overlap, Slice, overlaps, slices};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};

const AREA: Param = Param::number(
    "area",
    1.0,
    "m²",
    "largest common area of two pieces that is accepted",
);
const SHRINK: Param = Param::number(
    "shrink",
    0.05,
    "m",
    "distance by which the edges of roads are moved inward before the comparison",
);
const CLEARANCE: Param = Param::number(
    "clearance",
    3.0,
    "m",
    "roads with at least this difference in height count as lying above each other",
);

const INSIDE: &str = "asam.net:xodr:1.4.0:road.overlap_inside_junction";
const SELF: &str = "asam.net:xodr:1.4.0:road.no_overlap_self";

/// Distance from a common contact in metres within which linked roads may overlap. Their ends are
/// cut at right angles, independent of the course of the roads.
const NEAR_CONTACT: f64 = 10.0;

/// Maximum number of roads that share one place in a real map.
const MOST: usize = 64;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.no_overlap_outside_junction",
        "asam.net:xodr:1.4.0:road.overlap_inside_junction",
        "asam.net:xodr:1.4.0:road.no_overlap_self",
    ],
    versions: "1.1.0..",
    params: &[AREA, SHRINK, CLEARANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let limits = Limits {
        area: found.number(&AREA),
        shrink: found.number(&SHRINK),
        clearance: found.number(&CLEARANCE),
    };
    let friends = friends(map);
    let mouths = mouths(map);
    let slices = slices(map, &limits);
    let owners = owners(map);
    let wanted = |one: &Slice, other: &Slice| {
        if one.road == other.road {
            return is_far(map, one, other);
        }
        let (Some(a), Some(b)) = (map.road_at(one.road), map.road_at(other.road)) else {
            return false;
        };
        let of = [a, b].map(|road| owners.get(&road.index()).copied().or(road.junction()));
        let same_junction = of[0].is_some() && of[0] == of[1];
        !same_junction
            && !friends.contains(&(one.road.min(other.road), one.road.max(other.road)))
            && !meet(map, &mouths, one, other)
    };
    overlaps(&slices, &limits, wanted, |overlap| {
        report(map, &overlap, found);
    });
}

/// Returns the junctions of connecting roads that name no junction themselves, by place of the road.
/// `junctions.cross_path.correct_junction_id` reports these roads, and they may overlap there.
fn owners<'a>(map: &RoadMap<'a>) -> HashMap<usize, &'a str> {
    let mut owners = HashMap::default();
    for (junction, connection) in map.connections() {
        let road = connection.connecting_road().and_then(|id| map.road(id));
        if let Some(road) = road.filter(|road| road.junction().is_none()) {
            owners.entry(road.index()).or_insert(junction.id());
        }
    }
    owners
}

/// Returns the pairs of roads that may overlap because of their common junction: direct junctions,
/// crossings, and everything related to virtual junctions.
fn friends(map: &RoadMap<'_>) -> HashSet<(usize, usize)> {
    let mut friends = HashSet::default();
    let mut add = |one: Option<&str>, other: Option<&str>| {
        if let (Some(a), Some(b)) = (
            one.and_then(|id| map.road(id)),
            other.and_then(|id| map.road(id)),
        ) {
            friends.insert((a.index().min(b.index()), a.index().max(b.index())));
        }
    };
    for junction in map.junctions() {
        let sections: Vec<_> = junction.road_sections().take(MOST).collect();
        for (at, one) in sections.iter().enumerate() {
            for other in &sections[at + 1..] {
                add(one.road_id(), other.road_id());
            }
        }
        for path in junction.cross_paths() {
            add(path.crossing_road(), path.road_at_start());
            add(path.crossing_road(), path.road_at_end());
        }
        if junction.kind() == Some(JunctionType::Direct) {
            let linked: BTreeSet<&str> = junction
                .connections()
                .flat_map(|one| [one.incoming_road(), one.linked_road()])
                .flatten()
                .take(MOST)
                .collect();
            let linked: Vec<&str> = linked.into_iter().collect();
            for (at, one) in linked.iter().enumerate() {
                for other in &linked[at + 1..] {
                    add(Some(one), Some(other));
                }
            }
        }
        if junction.kind() == Some(JunctionType::Virtual) {
            // The junction attribute of these roads is ignored.
            let named = junction.connections();
            let named = named.filter_map(|one| one.connecting_road());
            let named: BTreeSet<&str> = named.take(MOST).collect();
            let named: Vec<&str> = named.into_iter().collect();
            for (at, one) in named.iter().enumerate() {
                add(Some(one), junction.main_road());
                for other in &named[at + 1..] {
                    add(Some(one), Some(other));
                }
            }
        }
    }
    for road in map.roads() {
        let junction = map.junction_of(road);
        let is_virtual = |one: &&Junction<'_>| one.kind() == Some(JunctionType::Virtual);
        if let Some(junction) = junction.filter(is_virtual) {
            add(Some(road.id()), junction.main_road());
        }
    }
    friends
}

/// Checks whether two pieces of one road are so far apart along it that they should not touch.
fn is_far(map: &RoadMap<'_>, one: &Slice, other: &Slice) -> bool {
    let (first, second) = if one.from <= other.from {
        (one, other)
    } else {
        (other, one)
    };
    let gap = second.from - first.to;
    let length = map
        .road_at(one.road)
        .and_then(Road::length)
        .unwrap_or(f64::INFINITY);
    // The last piece of a ring touches the first one.
    let around = first.from + length - second.to;
    gap.min(around) > NEAR_CONTACT.max(2.0 * one.width.max(other.width))
}

/// Returns the junctions to which the start and the end of each road are linked.
fn mouths<'a>(map: &RoadMap<'a>) -> Vec<[Option<&'a str>; 2]> {
    let linked = |road: &Road<'a>, end| road.link(end).and_then(|link| link.junction_id());
    let roads = map.roads().iter();
    roads
        .map(|road| ContactPoint::BOTH.map(|end| linked(road, end)))
        .collect()
}

/// Checks whether both pieces lie at an end where the file connects their roads.
fn meet(map: &RoadMap<'_>, mouths: &[[Option<&str>; 2]], one: &Slice, other: &Slice) -> bool {
    let near = |slice: &Slice, end: ContactPoint| {
        let length = map
            .road_at(slice.road)
            .and_then(Road::length)
            .unwrap_or(0.0);
        let reach = NEAR_CONTACT.max(slice.width);
        match end {
            ContactPoint::Start => slice.from <= reach,
            ContactPoint::End => slice.to >= length - reach,
        }
    };
    let touches = |end: ContactPoint| {
        let own = RoadEnd {
            road: one.road,
            end,
        };
        let mut contacts = map.contacts_of(own).take(MOST);
        near(one, end)
            && contacts.any(|contact| {
                let there = if contact.from == own {
                    contact.to
                } else {
                    contact.from
                };
                there.road == other.road && near(other, there.end)
            })
    };
    // Adjacent roads at the mouth of one junction share its corners.
    let junction_near = |slice: &Slice| {
        let road = map.road_at(slice.road)?;
        let [at_start, at_end] = *mouths.get(slice.road)?;
        let linked = if near(slice, ContactPoint::Start) {
            at_start
        } else if near(slice, ContactPoint::End) {
            at_end
        } else {
            return None;
        };
        linked.or(road.junction())
    };
    let here = junction_near(one);
    let at_junction = here.is_some() && here == junction_near(other);
    at_junction || ContactPoint::BOTH.into_iter().any(touches)
}

fn report(map: &RoadMap<'_>, overlap: &Overlap<'_>, found: &mut Sink<'_>) {
    let (one, other) = (overlap.one, overlap.other);
    let (Some(a), Some(b)) = (map.road_at(one.road), map.road_at(other.road)) else {
        return;
    };
    let [x, y, z] = [overlap.point.x, overlap.point.y, overlap.z];
    if one.road == other.road {
        let text = format!(
            "road `{}` overlaps itself: its lanes around s = {:.1} and s = {:.1} cover the same area ({:.1} m²)",
            a.id(),
            one.from,
            other.from,
            overlap.area
        );
        found
            .issue(a.node(), text)
            .uid(SELF)
            .road(a.id(), one.from, 0.0)
            .point(x, y, z)
            .follows(shape_of(a));
        return;
    }
    let belongs = |road: &Road<'_>| match road.junction() {
        Some(id) => format!(" of junction `{id}`"),
        None => String::new(),
    };
    let within = a.junction().is_some() || b.junction().is_some();
    let rule = if within {
        "only roads of the same junction may overlap"
    } else {
        "roads outside of junctions must not overlap"
    };
    let text = format!(
        "the lanes of road `{}`{} around s = {:.1} and of road `{}`{} around s = {:.1} cover the same area \
         ({:.1} m²); {rule}",
        a.id(),
        belongs(a),
        one.from,
        b.id(),
        belongs(b),
        other.from,
        overlap.area
    );
    let mut finding = found.issue(a.node(), text);
    if within {
        finding = finding.uid(INSIDE);
    }
    finding
        .road(a.id(), one.from, 0.0)
        .point(x, y, z)
        .at(b.node(), "the other road")
        .road(b.id(), other.from, 0.0)
        .fault(format!("overlap of roads {} and {}", a.index(), b.index()));
}
