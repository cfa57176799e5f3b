use std::collections::BTreeSet;

use crate::families::on_road::OnRoad;
use crate::families::strips::{Patch, area, common, strip, traffic_edges};
use crate::prelude::*;
use qcbus_opendrive::RoadSection;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.1,
    "m",
    "maximum distance by which the overlap may extend beyond a section",
);
const CLEARANCE: Param = Param::number(
    "clearance",
    3.0,
    "m",
    "height difference above which roads lie over each other",
);

/// Distance around a section in which roads are checked, in metres. The step and the inward shift
/// follow.
const AROUND: f64 = 50.0;
const STEP: f64 = 0.5;
const SHRINK: f64 = 0.02;

/// Maximum numbers of sections of one crossing, and of compared pairs of pieces.
const MOST: usize = 16;
const BUDGET: usize = 20_000_000;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE, CLEARANCE],
    run,
    ..Rule::after(READABLE)
};

/// A road section with its road and its range.
struct Crossed<'m, 'a> {
    section: RoadSection<'a>,
    road: &'m Road<'a>,
    range: [f64; 2],
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut budget = BUDGET;
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Crossing) {
            continue;
        }
        let sections: Vec<Crossed<'_, '_>> = junction
            .road_sections()
            .filter_map(|section| {
                let road = map.road(section.road_id()?)?;
                let range = [section.s_start()?, section.s_end()?];
                Some(Crossed {
                    section,
                    road,
                    range,
                })
            })
            .take(MOST)
            .collect();
        let mut told = BTreeSet::new();
        for (at, one) in sections.iter().enumerate() {
            for other in &sections[at + 1..] {
                if one.road.index() != other.road.index() {
                    check([one, other], &sections, &mut told, &mut budget, found);
                }
            }
        }
    }
}

fn check<'a>(
    pair: [&Crossed<'_, 'a>; 2],
    all: &[Crossed<'_, 'a>],
    told: &mut BTreeSet<(Node<'a>, usize)>,
    budget: &mut usize,
    found: &mut Sink<'_>,
) {
    let [one, other] = pair.map(pieces);
    let cost = one.len() * other.len();
    if cost > *budget {
        return;
    }
    *budget -= cost;
    let clearance = found.number(&CLEARANCE);
    let overlaps = overlaps([pair[0].road, pair[1].road], &one, &other, clearance);
    let touches = |overlap: &[[f64; 2]; 2]| {
        (0..2).any(|at| {
            let [from, to] = pair[at].range;
            overlap[at][0] <= from.max(to) && from.min(to) <= overlap[at][1]
        })
    };
    let alone = overlaps.len() == 1;
    for overlap in overlaps.iter().filter(|one| alone || touches(one)) {
        for at in 0..2 {
            let (here, there) = (pair[at], pair[1 - at]);
            let beyond = |section: &Crossed<'_, '_>| {
                let [from, to] = section.range;
                (from - overlap[at][0]).max(overlap[at][1] - to)
            };
            // Of several sections of a road in a crossing, one that covers the overlap is
            // sufficient.
            let same_road = all
                .iter()
                .filter(|section| section.road.index() == here.road.index());
            let least = same_road.map(beyond).fold(f64::INFINITY, f64::min);
            let place = (here.section.node(), there.road.index());
            if least > found.number(&TOLERANCE) && told.insert(place) {
                report(here, there.road, overlap[at], found);
            }
        }
    }
}

fn report(crossed: &Crossed<'_, '_>, other: &Road<'_>, overlap: [f64; 2], found: &mut Sink<'_>) {
    let [from, to] = crossed.range;
    let text = format!(
        "roads `{}` and `{}` overlap from s = {:.2} to s = {:.2} of road `{}`, but this section covers only s = {from} \
         to s = {to}; it must cover the whole overlap",
        crossed.road.id(),
        other.id(),
        overlap[0],
        overlap[1],
        crossed.road.id(),
    );
    let outside = if from - overlap[0] > overlap[1] - to {
        overlap[0]
    } else {
        overlap[1]
    };
    found
        .issue(crossed.section.node(), text)
        .on(crossed.road, outside, 0.0);
}

fn pieces(crossed: &Crossed<'_, '_>) -> Vec<Patch> {
    let [from, to] = crossed.range;
    let length = crossed.road.length().unwrap_or(0.0);
    let range = [
        (from.min(to) - AROUND).clamp(0.0, length.max(0.0)),
        (from.max(to) + AROUND).clamp(0.0, length.max(0.0)),
    ];
    strip(crossed.road, range, STEP, SHRINK, |station: Station| {
        traffic_edges(crossed.road, station)
    })
}

/// Returns the places where the pieces of two roads cover the same ground at the same height. Each
/// place has the ranges of s on both roads.
fn overlaps(
    roads: [&Road<'_>; 2],
    ones: &[Patch],
    others: &[Patch],
    clearance: f64,
) -> Vec<[[f64; 2]; 2]> {
    let mut all: Vec<[[f64; 2]; 2]> = Vec::new();
    for one in ones {
        for other in others {
            let Some(shape) = common(&one.corners, &other.corners) else {
                continue;
            };
            let heights = [
                roads[0].elevation().at_or_zero(one.from),
                roads[1].elevation().at_or_zero(other.from),
            ];
            let level =
                matches!(heights, [Some(here), Some(there)] if (here - there).abs() <= clearance);
            if !level || area(&shape) < 1e-6 {
                continue;
            }
            let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for point in shape {
                let here = [
                    one.road_coordinates(point).0,
                    other.road_coordinates(point).0,
                ];
                for (range, s) in range.iter_mut().zip(here) {
                    *range = [range[0].min(s), range[1].max(s)];
                }
            }
            join(&mut all, range);
        }
    }
    all
}

/// Adds a range and merges it with all adjacent places.
fn join(all: &mut Vec<[[f64; 2]; 2]>, range: [[f64; 2]; 2]) {
    let hangs = |place: &[[f64; 2]; 2]| {
        let mut roads = place.iter().zip(&range);
        roads.all(|(one, other)| one[0] <= other[1] + 2.0 * STEP && other[0] <= one[1] + 2.0 * STEP)
    };
    let mut joined = range;
    all.retain(|place| {
        let apart = !hangs(place);
        if !apart {
            for (one, other) in joined.iter_mut().zip(place) {
                *one = [one[0].min(other[0]), one[1].max(other[1])];
            }
        }
        apart
    });
    all.push(joined);
}
