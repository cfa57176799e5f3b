use crate::families::edges::border;
use crate::families::on_road::OnRoad;
use crate::families::shown::number;
use crate::prelude::*;
use qcbus_opendrive::geometry::Minimum;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.001,
    "m",
    "largest width at the right edge of the road that the shapes may leave uncovered",
);

const STARTS_RIGHT: &str = "asam.net:xodr:1.9.0:road.use_cases.shape_elements_start_right";

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.shape.t_definition_coverage",
        "asam.net:xodr:1.9.0:road.use_cases.shape_elements_start_right",
    ],
    versions: "1.1.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map
        .part(part)
        .roads()
        .iter()
        .filter(|road| !road.lateral().shape.is_empty())
    {
        if let Some(edge) = right_edge(road) {
            check(road, edge, found);
        }
    }
}

/// Returns the rightmost position of all lanes that follow the lateral profile.
fn right_edge(road: &Road<'_>) -> Option<Minimum> {
    let sections = road.permanent()?.sections(road);
    let lowest = sections.flat_map(|section| {
        let follows = |lane: &LaneRef<'_, '_>| lane.level() != Some(true);
        let count = section.side(Side::Right).take_while(follows).count();
        border(section, Side::Right, count)
    });
    let lowest = lowest.filter_map(|piece| piece.minimum());
    lowest.min_by(|one, other| one.value.total_cmp(&other.value))
}

fn check(road: &Road<'_>, edge: Minimum, found: &mut Sink<'_>) {
    let flat = is_flat(road);
    for row in road.lateral().shape.rows() {
        let Some(first) = row.profile.in_order().next() else {
            continue;
        };
        let Some(begin) = first
            .start()
            .filter(|t| *t > edge.value + found.number(&TOLERANCE))
        else {
            continue;
        };
        let text = format!(
            "the shapes at s = {} begin at t = {}, but the lanes of road `{}` extend to t = {:.3} on the right \
             (at s = {:.2}); shapes must cover the whole width of the road",
            number(row.s),
            number(begin),
            road.id(),
            edge.value,
            edge.at
        );
        let newer = found.version() >= Some(Version::new(1, 9));
        let place = Place::attribute_or_node(first.node(), "t");
        let mut finding = found.issue(place, text).on(road, row.s, edge.value);
        if flat {
            finding = finding.level(Level::Information);
        }
        if begin >= 0.0 && newer {
            finding.uid(STARTS_RIGHT);
        }
    }
}

/// Checks whether the height of all shapes of the road is 0. Then it is 0 beside them as well,
/// whatever a reader assumes there.
fn is_flat(road: &Road<'_>) -> bool {
    let rows = road.lateral().shape.rows().iter();
    let mut records = rows.flat_map(|row| row.profile.records());
    records.all(|record| record.cubic() == Some(Cubic::constant(0.0)))
}
