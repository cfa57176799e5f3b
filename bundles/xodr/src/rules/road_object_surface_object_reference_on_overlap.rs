use std::collections::{BTreeMap, BTreeSet};

use crate::families::on_road::{MAX_PLACES, OnRoad};
use crate::families::strips::{Patch, area, common, strip, traffic_edges};
use crate::families::surface_boxes::{SurfaceBox, surface_boxes};
use crate::prelude::*;

const AREA: Param = Param::number(
    "area",
    0.01,
    "m²",
    "largest area of a road's lanes that an object may cover without a reference",
);
const CLEARANCE: Param = Param::number(
    "clearance",
    1.0,
    "m",
    "roads that are farther than this above or below the object are not covered",
);

/// Length of the compared pieces of roads, and inward shift of their edges, in metres.
const STEP: f64 = 2.0;
const SHRINK: f64 = 0.02;

/// Maximum numbers of pieces, and of compared pairs of a box and a piece.
const MOST_PIECES: usize = 500_000;
const BUDGET: usize = 20_000_000;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    params: &[AREA, CLEARANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let boxes = surface_boxes(map);
    if boxes.is_empty() {
        return;
    }
    let pieces = pieces(map);
    // For each object, the roads that it covers without being referenced there.
    let mut covered: BTreeMap<Node<'_>, (&SurfaceBox<'_, '_>, BTreeSet<usize>)> = BTreeMap::new();
    let mut budget = BUDGET;
    for one in &boxes {
        for (road, piece) in near(&pieces, one) {
            budget = budget.saturating_sub(1);
            if budget == 0 {
                break;
            }
            if road.index() != one.road.index() && covers(one, road, piece, found) {
                let entry = covered.entry(one.object.node());
                entry
                    .or_insert((one, BTreeSet::new()))
                    .1
                    .insert(road.index());
            }
        }
    }
    for (one, roads) in covered.values() {
        let roads: Vec<&Road<'_>> = roads
            .iter()
            .filter_map(|at| map.roads().get(*at))
            .filter(|road| !refers(road, &one.object))
            .collect();
        report(one, &roads, found);
    }
}

/// The pieces of all roads in ascending order of their smallest x. `longest` is the largest extent
/// in x.
struct Pieces<'m, 'a> {
    sorted: Vec<(f64, &'m Road<'a>, Patch)>,
    longest: f64,
}

fn pieces<'m, 'a>(map: &'m RoadMap<'a>) -> Pieces<'m, 'a> {
    let (mut sorted, mut longest) = (Vec::new(), 0.0_f64);
    for road in map.roads() {
        let length = road.length().unwrap_or(0.0);
        for piece in strip(road, [0.0, length], STEP, SHRINK, |station: Station| {
            traffic_edges(road, station)
        }) {
            let values = piece.corners.iter().map(|corner| corner.x);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            longest = longest.max(values.fold(f64::NEG_INFINITY, f64::max) - low);
            sorted.push((low, road, piece));
        }
        if sorted.len() > MOST_PIECES {
            break;
        }
    }
    sorted.sort_by(|one, other| one.0.total_cmp(&other.0));
    Pieces { sorted, longest }
}

fn near<'p, 'm, 'a>(
    pieces: &'p Pieces<'m, 'a>,
    one: &SurfaceBox<'_, '_>,
) -> impl Iterator<Item = (&'m Road<'a>, &'p Patch)> {
    let [low, high] = one.extent();
    let first = pieces
        .sorted
        .partition_point(|(x, ..)| *x < low - pieces.longest);
    let rest = pieces.sorted.get(first..).unwrap_or(&[]).iter();
    rest.take_while(move |(x, ..)| *x <= high)
        .map(|(_, road, piece)| (*road, piece))
}

fn covers(one: &SurfaceBox<'_, '_>, road: &Road<'_>, piece: &Patch, found: &Sink<'_>) -> bool {
    let shape = common(&one.corners, &piece.corners);
    // If only a corner covers the piece, it may be one of several pieces.
    if shape.is_none_or(|shape| area(&shape) <= found.number(&AREA)) {
        return false;
    }
    let ground = one.road.elevation().at_or_zero(one.s);
    let there = road.elevation().at_or_zero(piece.from);
    matches!((ground, there), (Some(here), Some(there)) if (here - there).abs() <= found.number(&CLEARANCE))
}

fn refers(road: &Road<'_>, object: &Object<'_>) -> bool {
    let id = object.id();
    road.object_references()
        .any(|reference| reference.id() == id)
}

fn report(one: &SurfaceBox<'_, '_>, roads: &[&Road<'_>], found: &mut Sink<'_>) {
    if roads.is_empty() {
        return;
    }
    let mut names: Vec<String> = roads
        .iter()
        .take(MAX_PLACES)
        .map(|road| format!("`{}`", road.id()))
        .collect();
    let more = roads.len() - names.len();
    if more > 0 {
        names.push(format!("and {more} more"));
    }
    let text = format!(
        "the surface of object `{}` extends onto road{} {} without an `objectReference` there; each road that it \
         covers must refer to it",
        one.object.id().unwrap_or_default(),
        if names.len() == 1 { "" } else { "s" },
        names.join(", ")
    );
    let finding = found
        .issue(one.object.node(), text)
        .on(one.road, one.s, one.t);
    roads
        .iter()
        .take(MAX_PLACES)
        .fold(finding, |finding, road| {
            finding.at(road.node(), "a road without a reference")
        });
}
