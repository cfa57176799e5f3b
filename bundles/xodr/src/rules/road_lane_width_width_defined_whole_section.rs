use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[TOLERANCE, GRAVE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "largest sOffset of the first record that is accepted",
);

const GRAVE: Param = Param::number(
    "grave",
    0.1,
    "m",
    "in versions before 1.7, a first record that starts no later than this is a warning",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for lane in map.part(part).lanes() {
        let (Some(_), Some(id)) = (lane.side(), lane.id_text()) else {
            continue;
        };
        let (profile, name) = match (lane.widths(), lane.borders()) {
            (widths, borders) if widths.is_empty() && borders.is_empty() => {
                let text = format!(
                    "lane {id} has neither `width` nor `border`; its width must be defined for the whole \
                     lane section"
                );
                let finding = found.issue(lane.node(), text);
                if let Some(s) = lane.at.s() {
                    finding.road(lane.at.road.id(), s, 0.0);
                }
                continue;
            }
            (widths, _) if !widths.is_empty() => (widths, "width"),
            (_, borders) => (borders, "border"),
        };
        let (Some(first), Some(s)) = (profile.in_order().next(), lane.at.s()) else {
            continue;
        };
        if let Some(begin) = first.start().filter(|begin| begin.abs() > tolerance) {
            let text = format!(
                "the first `{name}` of lane {id} has sOffset = {}; there must be one with sOffset = 0, \
                 so that it is defined for the whole lane section",
                number(begin)
            );
            let older = found.version() < Some(Version::new(1, 7));
            let is_mild = older && begin.abs() <= found.number(&GRAVE);
            let finding = found
                .issue(Place::attribute_or_node(first.node(), "sOffset"), text)
                .road(lane.at.road.id(), s, 0.0);
            if is_mild {
                finding.level(Level::Warning);
            }
        }
    }
}
