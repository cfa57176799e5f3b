use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest distance between a link and the start of a section that is accepted",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(permanent) = road.permanent() else {
            continue;
        };
        let mut starts: Vec<f64> = permanent
            .sections(road)
            .filter_map(|section| section.s())
            .collect();
        starts.sort_by(f64::total_cmp);
        let temporary = road.layer(LayerKind::Temporary).into_iter();
        for section in temporary.flat_map(|layer| layer.sections(road)) {
            for end in ContactPoint::BOTH {
                check(section, end, &starts, found);
            }
        }
    }
}

/// Checks one end of a section of the temporary layer. If one of its lanes is linked to the
/// permanent layer, a section of that layer must begin there. `starts` is in ascending order.
fn check(section: SectionRef<'_, '_>, end: ContactPoint, starts: &[f64], found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let mut links = section
        .lanes()
        .flat_map(|lane| lane.links(end).map(move |link| (lane, link)));
    let Some((lane, link)) = links.find(|(_, link)| link.layer() == LayerKind::Permanent) else {
        return;
    };
    let s = match end {
        ContactPoint::Start => section.s(),
        ContactPoint::End => section.end(lane.side().unwrap_or(Side::Right)),
    };
    let (Some(s), Some(length)) = (s, section.road.length()) else {
        return;
    };
    let is_near = |place: f64| (place - s).abs() <= tolerance;
    let after = starts.partition_point(|start| *start < s - tolerance);
    let begins = starts.get(after).is_some_and(|start| is_near(*start));
    if is_near(0.0) || is_near(length) || begins {
        return;
    }
    let text = format!(
        "a temporary lane is linked to the permanent layer at s = {s}, but no section of the permanent layer \
         starts there; a new section must be defined where the layers are linked"
    );
    found
        .issue(link.node(), text)
        .road(section.road.id(), s, 0.0);
}
