use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.lane.center_elem_definition",
        "asam.net:xodr:1.9.0:road.lane.center_lane",
        "asam.net:xodr:1.9.0:road.lane.center_lane_singular",
        "asam.net:xodr:1.9.0:road.lane.layer.center_lane_permanent",
    ],
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

/// First version with separate rules for center lanes.
const CENTER_LANE_RULES: Version = Version::new(1, 9);
const CENTER_LANE: &str = "asam.net:xodr:1.9.0:road.lane.center_lane";
const SINGULAR: &str = "asam.net:xodr:1.9.0:road.lane.center_lane_singular";
const PERMANENT: &str = "asam.net:xodr:1.9.0:road.lane.layer.center_lane_permanent";

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let is_new = found
        .version()
        .is_some_and(|version| version >= CENTER_LANE_RULES);
    for road in map.part(part).roads() {
        let mut sections = road.sections().peekable();
        if sections.peek().is_some() && sections.all(|section| section.center().is_none()) {
            no_center_at_all(road, is_new, found);
        } else {
            for section in road.sections() {
                check(section, is_new, found);
            }
        }
    }
}

fn no_center_at_all(road: &Road<'_>, is_new: bool, found: &mut Sink<'_>) {
    // If there is only one section, that is the one to fix.
    let mut sections = road.sections().map(|section| section.node());
    let only = sections.next().filter(|_| sections.next().is_none());
    let lanes = road.layers().first().map(|lanes| lanes.node());
    let Some(place) = only.or(lanes) else {
        return;
    };
    let text = format!(
        "road `{}` has no center lane in any lane section; each lane section must have one",
        road.id()
    );
    let finding = found.issue(place, text);
    if is_new {
        finding.uid(CENTER_LANE);
    }
}

fn check(section: SectionRef<'_, '_>, is_new: bool, found: &mut Sink<'_>) {
    let groups: Vec<Node<'_>> = section.node().children_named("center").collect();
    let is_permanent = section.layer.kind() == LayerKind::Permanent;
    match groups.as_slice() {
        [] if section.single_side() == Some(true) => {}
        [] => {
            let text = "the lane section has no `center`; there must be one at every s";
            let level = if is_permanent {
                Level::Error
            } else {
                Level::Warning
            };
            found.issue(section.node(), text).level(level);
        }
        [group] => check_lanes(*group, is_permanent, is_new, found),
        [first, second, ..] => {
            let text =
                "the lane section has a second `center`; there must be exactly one at every s";
            found.issue(*second, text).at(*first, "the first one");
        }
    }
}

fn check_lanes(group: Node<'_>, is_permanent: bool, is_new: bool, found: &mut Sink<'_>) {
    // Before 1.9, only the schema limits the number of lanes within `center`.
    let level = if is_new { Level::Error } else { Level::Warning };
    match group.children_named("lane").collect::<Vec<_>>().as_slice() {
        [_] => {}
        [] => {
            let uid = if is_permanent && is_new {
                PERMANENT
            } else {
                SINGULAR
            };
            let text = "`center` contains no lane; it must contain exactly one";
            found.issue(group, text).level(level).uid(uid);
        }
        [first, second, ..] => {
            let text = "`center` contains a second lane; it must contain exactly one";
            found
                .issue(*second, text)
                .level(level)
                .uid(SINGULAR)
                .at(*first, "the first one");
        }
    }
}
