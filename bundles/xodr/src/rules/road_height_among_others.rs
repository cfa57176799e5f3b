use crate::families::shown::number;
use crate::prelude::*;

const APART: Param = Param::number(
    "apart",
    100.0,
    "m",
    "largest distance above or below all other roads that is accepted for a road without links",
);

/// Minimum ratio of the two groups. Only a small group is odd; of two halves it is unclear which.
const FEW: usize = 10;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[APART],
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
