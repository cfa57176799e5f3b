use std::f64::consts::PI;

use crate::families::on_road::OnRoad;
use crate::families::touching::KINK;
use crate::families::virtual_junctions::{Branch, all_branches};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.6.0" },
    params: &[KINK],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&KINK);
    for branch in all_branches(map) {
        let poses = branch
            .main
            .pose(branch.s)
            .zip(branch.road.end_pose(branch.end));
        let kink = poses.and_then(|(main, road)| heading_difference(main.hdg, road.hdg));
        if let Some((main, road)) = poses {
            direction(&branch, [main.hdg, road.hdg], found);
        }
        // The road may run along the main road or against it.
        let Some(kink) = kink
            .map(|kink| kink.min(PI - kink))
            .filter(|kink| *kink > limit)
        else {
            continue;
        };
        let text = format!(
            "the {} of road `{}` is not aligned with main road `{}`: their headings differ by {kink:.4} rad \
             ({:.2}°) at s = {}; at most {limit} rad is allowed",
            branch.end,
            branch.road.id(),
            branch.main.id(),
            kink.to_degrees(),
            branch.s
        );
        found
            .issue(branch.road.node(), text)
            .at_end(branch.road, branch.end)
            .at(branch.link.node(), "the link to the main road")
            .on(branch.main, branch.s, 0.0);
    }
}

/// Reports `elementDir` if it says that a road runs along the main road, and it runs against it, or
/// the reverse.
fn direction(branch: &Branch<'_, '_>, [main, road]: [f64; 2], found: &mut Sink<'_>) {
    let Some(attribute) = branch.link.node().attribute("elementDir") else {
        return;
    };
    let Some(angle) = heading_difference(main, road) else {
        return;
    };
    // Between these angles, the road crosses the main road.
    let runs = if angle < PI / 4.0 {
        ("+", "along")
    } else if angle > 0.75 * PI {
        ("-", "against")
    } else {
        return;
    };
    let written = attribute.value().trim();
    if written != runs.0 && matches!(written, "+" | "-") {
        let text = format!(
            "`elementDir` is `{written}`, but road `{}` runs {} the direction of s of main road `{}`; it must be \
             `{}`, otherwise traffic goes the wrong way",
            branch.road.id(),
            runs.1,
            branch.main.id(),
            runs.0
        );
        found
            .issue(attribute, text)
            .in_every_version(Level::Warning)
            .at_end(branch.road, branch.end);
    }
}
