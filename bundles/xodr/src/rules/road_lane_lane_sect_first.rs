use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[TOLERANCE, GRAVE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "largest distance from 0 that is accepted",
);

const GRAVE: Param = Param::number(
    "grave",
    0.1,
    "m",
    "in versions before 1.9, a first section that starts at most this far from 0 is a warning",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for road in map.part(part).roads() {
        let first = road
            .permanent()
            .and_then(|layer| layer.in_order(road).next());
        let Some((section, s)) = first.and_then(|section| Some((section, section.s()?))) else {
            continue;
        };
        if s.abs() > tolerance {
            let text = format!(
                "the first lane section of road `{}` starts at s = {}; it must start at s = 0, so that \
                 the road has lanes from its beginning",
                road.id(),
                number(s)
            );
            let older = found.version() < Some(Version::new(1, 9));
            let is_mild = older && s.abs() <= found.number(&GRAVE);
            let finding = found
                .issue(Place::attribute_or_node(section.node(), "s"), text)
                .road(road.id(), s, 0.0);
            if is_mild {
                finding.level(Level::Warning);
            }
        }
    }
}
