use crate::families::corner_references::markings;
use crate::families::object_parts::Stands;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    versions: "1.9.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for marking in markings(map).filter(|marking| marking.outline.is_some()) {
        let Some(path) = marking.path() else { continue };
        for pair in path.steps.windows(2) {
            let ([(from, start), (to, end)], all) = (pair, path.points.len()) else {
                continue;
            };
            // Points between the two references, across the closing side if the numbers fall.
            let between = (end + all - start + all - 1) % all;
            let falls = end <= start;
            if between == 0 || (falls && path.is_closed() == Some(false)) {
                continue;
            }
            let (a, b) = (
                from.attr("id").unwrap_or_default(),
                to.attr("id").unwrap_or_default(),
            );
            let text = format!(
                "the marking leads from point `{a}` to point `{b}`, which are not neighbours on the outline; it \
                 includes the outline between them ({between} more points), although readers of 1.8 draw a \
                 straight line"
            );
            found
                .issue(*to, text)
                .stands(map, marking.object)
                .at(*from, "the reference before it");
        }
    }
}
