use qcbus_opendrive::geometry::Point;
use qcbus_opendrive::{Junction, Place, Road, RoadMap};
use qcbus_sdk::{Level, Param, Rule, Sink};

use crate::families::junction_area::{boundary, ring};
use crate::families::polygons::{contains, distance_to_boundary, sides};
use crate::families::strips::{Patch, area, common, middle, strip, traffic_edges};
use crate::model::Roads;

const AREA: Param = Param::number(
    "area",
    1.0,
    "m²",
    "largest common area of roads of two junctions that is accepted",
);
const DEPTH: Param = Param::number(
    "depth",
    0.1,
    "m",
    "how far the boundary of one junction may reach into that of another",
);
const CLEARANCE: Param = Param::number(
    "clearance",
    3.0,
    "m",
    "junctions that are farther apart in height lie over each other",
);

/// Length of the pieces of roads that are compared, in metres, and by how much they are narrower.
const STEP: f64 = 2.0;
const SHRINK: f64 = 0.05;

/// No more pieces are compared, and no more points are taken along a straight side of a boundary.
const BUDGET: usize = 10_000_000;
const MOST_POINTS: f64 = 64.0;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_no_overlap",
    uids: &["asam.net:xodr:1.4.0:junctions.no_overlap"],
    versions: "1.4.0..",
    after: super::READABLE,
    params: &[AREA, DEPTH, CLEARANCE],
    page: include_str!("junctions_no_overlap.md"),
    run,
    ..Rule::DEFAULTS
};

/// A junction with its roads and the box that holds it all.
struct Site<'m, 'a> {
    junction: &'m Junction<'a>,
    roads: Vec<&'m Road<'a>>,
    ring: Option<Vec<Point>>,
    /// Least and greatest x, least and greatest y.
    extent: [f64; 4],
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut sites = sites(map);
    sites.sort_by(|one, other| one.extent[0].total_cmp(&other.extent[0]));
    let mut budget = BUDGET;
    for (at, one) in sites.iter().enumerate() {
        let beside = sites[at + 1..].iter();
        for other in beside.take_while(|other| other.extent[0] <= one.extent[1]) {
            budget = budget.saturating_sub(1);
            if budget == 0 {
                return;
            }
            if one.extent[2] <= other.extent[3] && other.extent[2] <= one.extent[3] {
                let (one, other) = if one.junction.index() < other.junction.index() {
                    (one, other)
                } else {
                    (other, one)
                };
                check(one, other, &mut budget, found);
            }
        }
    }
}

fn sites<'m, 'a>(map: &'m RoadMap<'a>) -> Vec<Site<'m, 'a>> {
    let mut roads: Vec<Vec<&Road<'_>>> = map.junctions().iter().map(|_| Vec::new()).collect();
    for road in map.roads() {
        let junction = road.junction().and_then(|id| map.junction(id));
        if let Some(own) = junction.and_then(|one| roads.get_mut(one.index())) {
            own.push(road);
        }
    }
    let sites = map.junctions().iter().zip(roads).map(|(junction, roads)| {
        let ring = boundary(map, junction).map(|stretches| ring(&stretches));
        let outline = roads.iter().filter_map(|road| reach(road)).chain(
            ring.iter()
                .flatten()
                .map(|point| [point.x, point.x, point.y, point.y]),
        );
        let nothing = [
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        let extent = outline.fold(nothing, |all, one| {
            [
                all[0].min(one[0]),
                all[1].max(one[1]),
                all[2].min(one[2]),
                all[3].max(one[3]),
            ]
        });
        Site {
            junction,
            roads,
            ring,
            extent,
        }
    });
    sites.filter(|site| site.extent[0].is_finite()).collect()
}

/// A box that a road cannot leave: no point of it is farther from either end than its length.
fn reach(road: &Road<'_>) -> Option<[f64; 4]> {
    let length = road.length().filter(|length| *length > 0.0)?;
    let [start, end] = [road.pose(0.0)?, road.pose(Place::before(length))?];
    let width = [Place::at(0.0), Place::before(length)]
        .into_iter()
        .filter_map(|place| traffic_edges(road, place))
        .fold(0.0_f64, |widest, (right, left)| {
            widest.max(right.abs()).max(left.abs())
        });
    // Half of what the detour adds to the way from end to end, on either side.
    let around = 0.5 * length + width + 1.0;
    let (x, y) = (0.5 * (start.x + end.x), 0.5 * (start.y + end.y));
    Some([x - around, x + around, y - around, y + around])
}

fn check(one: &Site<'_, '_>, other: &Site<'_, '_>, budget: &mut usize, found: &mut Sink<'_>) {
    if one.junction.id() == other.junction.id() {
        return;
    }
    if let (Some(here), Some(there)) = (&one.ring, &other.ring) {
        let depth = found.number(&DEPTH);
        let level = heights_meet(one, other, found.number(&CLEARANCE));
        if let Some((deep, point)) = deepest(here, there).filter(|(deep, _)| level && *deep > depth)
        {
            let text = format!(
                "the boundaries of junctions `{}` and `{}` overlap by {deep:.2} m; the areas of junctions must not",
                one.junction.id(),
                other.junction.id()
            );
            found
                .issue(other.junction.node(), text)
                .point(point.x, point.y, 0.0)
                .at(one.junction.node(), "the other junction");
        }
        return;
    }
    roads_overlap(one, other, budget, found);
}

fn heights_meet(one: &Site<'_, '_>, other: &Site<'_, '_>, clearance: f64) -> bool {
    let range = |site: &Site<'_, '_>| {
        let heights = site
            .roads
            .iter()
            .filter_map(|road| road.elevation().at_or_zero(0.0));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
            (low.min(z), high.max(z))
        })
    };
    let (here, there) = (range(one), range(other));
    here.0 - there.1 <= clearance && there.0 - here.1 <= clearance
}

/// The point of either ring that lies deepest in the other one.
fn deepest(one: &[Point], other: &[Point]) -> Option<(f64, Point)> {
    let inside = |points: &[Point], ring: &[Point]| {
        let inner = fine(points)
            .filter(|point| contains(ring, *point))
            .map(|point| (distance_to_boundary(point, ring), point));
        inner.max_by(|one, other| one.0.total_cmp(&other.0))
    };
    let both = [inside(one, other), inside(other, one)];
    both.into_iter()
        .flatten()
        .max_by(|one, other| one.0.total_cmp(&other.0))
}

/// The points of a ring, with more of them along its straight sides.
fn fine(ring: &[Point]) -> impl Iterator<Item = Point> {
    sides(ring).flat_map(|(one, other)| {
        let count = one.distance(other).ceil().clamp(1.0, MOST_POINTS);
        (0..count as usize).map(move |index| {
            let share = index as f64 / count;
            Point {
                x: one.x + share * (other.x - one.x),
                y: one.y + share * (other.y - one.y),
            }
        })
    })
}

fn roads_overlap(
    one: &Site<'_, '_>,
    other: &Site<'_, '_>,
    budget: &mut usize,
    found: &mut Sink<'_>,
) {
    let pieces = |road: &Road<'_>| -> Vec<Patch> {
        let range = [0.0, road.length().unwrap_or(0.0)];
        strip(road, range, STEP, SHRINK, |place| {
            traffic_edges(road, place)
        })
    };
    let clearance = found.number(&CLEARANCE);
    for a in &one.roads {
        for b in other.roads.iter().filter(|b| near(a, b)) {
            let (ones, others) = (pieces(a), pieces(b));
            *budget = budget.saturating_sub(ones.len() * others.len());
            if *budget == 0 {
                return;
            }
            let mut total = 0.0;
            let mut place = None;
            for here in &ones {
                for there in &others {
                    let Some(shape) = common(&here.corners, &there.corners) else {
                        continue;
                    };
                    let heights = [
                        a.elevation().at_or_zero(here.from),
                        b.elevation().at_or_zero(there.from),
                    ];
                    if matches!(heights, [Some(one), Some(other)] if (one - other).abs() <= clearance)
                    {
                        total += area(&shape);
                        place = place.or_else(|| Some((middle(&shape)?, here.from, there.from)));
                    }
                }
            }
            if let Some((point, s, at)) = place.filter(|_| total > found.number(&AREA)) {
                let text = format!(
                    "junctions `{}` and `{}` overlap: their roads `{}` around s = {s:.1} and `{}` around s = {at:.1} \
                     cover the same ground ({total:.1} m²); the areas of junctions must not overlap",
                    one.junction.id(),
                    other.junction.id(),
                    a.id(),
                    b.id()
                );
                found
                    .issue(other.junction.node(), text)
                    .level(Level::Warning)
                    .point(point.x, point.y, 0.0)
                    .at(one.junction.node(), "the other junction")
                    .at(a.node(), "the one road")
                    .at(b.node(), "the other road");
                return;
            }
        }
    }
}

fn near(one: &Road<'_>, other: &Road<'_>) -> bool {
    let boxes = reach(one).zip(reach(other));
    boxes.is_some_and(|(a, b)| a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3])
}
