use std::collections::BTreeMap;

use crate::families::crg::{parent, purpose, records};
use crate::families::object_parts::{named, number};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "s_tolerance",
    1e-3,
    "m",
    "largest overlap of two records that is \
    accepted",
);

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let mut groups: BTreeMap<(Node<'_>, &str), Vec<Stretch<'_>>> = BTreeMap::new();
    for record in records(map) {
        let (Some(parent), Some(start), Some(end)) = (
            parent(record),
            number(record, "sStart"),
            number(record, "sEnd"),
        ) else {
            continue;
        };
        if end <= start {
            continue;
        }
        let stretch = Stretch { record, start, end };
        groups
            .entry((parent, purpose(record)))
            .or_default()
            .push(stretch);
    }
    for ((parent, purpose), mut stretches) in groups {
        stretches.sort_by(|a, b| a.start.total_cmp(&b.start));
        let mut furthest: Option<Stretch<'_>> = None;
        for stretch in stretches {
            if let Some(before) = furthest.filter(|before| before.end > stretch.start + tolerance) {
                let text = format!(
                    "two CRG records for {purpose} apply from s = {} m to {} m of {}; only one should apply at any place",
                    stretch.start,
                    before.end.min(stretch.end),
                    named(parent)
                );
                found
                    .issue(stretch.record, text)
                    .at(before.record, "the other record");
            }
            if furthest.is_none_or(|before| before.end < stretch.end) {
                furthest = Some(stretch);
            }
        }
    }
}

/// The stretch on which a record applies, in metres along the road.
#[derive(Clone, Copy)]
struct Stretch<'a> {
    record: Node<'a>,
    start: f64,
    end: f64,
}
