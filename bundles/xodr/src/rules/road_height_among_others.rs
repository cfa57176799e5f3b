use crate::families::shown::number;
use crate::prelude::*;

const APART: Param = Param::number(
    "apart",
    100.0,
    "m",
    "largest distance above or below all other roads that is accepted for a road without links",
);

const HIGHEST: Param = Param::number(
    "highest",
    9000.0,
    "m",
    "largest plausible height of a road, as of the highest mountains",
);
const DEEPEST: Param = Param::number(
    "deepest",
    1000.0,
    "m",
    "largest plausible depth of a road below zero",
);

/// Size in metres beyond which values exceed the Earth itself.
const EARTH: f64 = 1e8;

/// Minimum ratio of the two groups. Only a small group is odd; of two halves it is unclear which.
const FEW: usize = 10;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[APART, HIGHEST, DEEPEST],
    run,
    ..Rule::after(READABLE)
};

/// A road with the heights of its ends, the lower one first.
struct Span<'m, 'd> {
    road: &'m Road<'d>,
    low: f64,
    high: f64,
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let apart = found.number(&APART);
    let mut spans: Vec<Span<'_, '_>> = map.roads().iter().filter_map(Span::of).collect();
    off_the_earth(&spans, found);
    spans.sort_by(|one, other| one.low.total_cmp(&other.low));
    let mut below = f64::NEG_INFINITY;
    for (at, span) in spans.iter().enumerate() {
        let step = span.low - below;
        if at > 0 && step > apart {
            let (lower, upper) = spans.split_at(at);
            let (few, many, word) = if upper.len() < lower.len() {
                (upper, lower, "above")
            } else {
                (lower, upper, "below")
            };
            if few.len() * FEW <= many.len() {
                few.iter()
                    .filter(|one| is_unlinked(map, one.road))
                    .for_each(|one| one.report((step, apart), word, found));
            }
        }
        below = below.max(span.high);
    }
}

/// Reports the first road whose height no road on Earth has.
fn off_the_earth(spans: &[Span<'_, '_>], found: &mut Sink<'_>) {
    let (highest, deepest) = (found.number(&HIGHEST), found.number(&DEEPEST));
    // `numbers.computable` reports larger values.
    let is_known = |height: f64| height.abs() <= EARTH;
    let is_off = |span: &&Span<'_, '_>| {
        (span.high > highest || span.low < -deepest) && is_known(span.low) && is_known(span.high)
    };
    let mut off = spans.iter().filter(is_off);
    let Some(first) = off.next() else { return };
    let others = match off.count() {
        0 => String::new(),
        count => format!(", as do {count} other roads"),
    };
    let height = if first.high > highest {
        first.high
    } else {
        first.low
    };
    let text = format!(
        "road `{}` lies at a height of {} m{others}; heights are in metres, and roads lie between {} m and {highest} m",
        first.road.id(),
        number(height.round()),
        -deepest
    );
    let node = first.road.elevation_node();
    found.issue(Place::from(node.unwrap_or(first.road.node())), text);
}

impl<'m, 'd> Span<'m, 'd> {
    fn of(road: &'m Road<'d>) -> Option<Span<'m, 'd>> {
        let [one, other] = [0.0, road.length()?].map(|s| road.elevation().at_or_zero(s));
        let (one, other) = (one?, other?);
        Some(Span {
            road,
            low: one.min(other),
            high: one.max(other),
        })
    }

    fn report(&self, (step, limit): (f64, f64), word: &str, found: &mut Sink<'_>) {
        let text = format!(
            "road `{}` lies {} m {word} the rest of the map and is not linked to it; roads of one place should \
             lie at similar heights (accepted difference: {limit} m)",
            self.road.id(),
            number(step.round())
        );
        let node = self.road.elevation_node();
        found.issue(Place::from(node.unwrap_or(self.road.node())), text);
    }
}

/// Checks whether a road has no links. Steps between linked roads are found at the links.
fn is_unlinked<'a>(map: &RoadMap<'a>, road: &Road<'a>) -> bool {
    ContactPoint::BOTH
        .iter()
        .all(|end| map.neighbours(road, *end).is_empty())
}
