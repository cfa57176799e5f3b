use crate::families::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::Crg;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map
        .part(part)
        .roads()
        .iter()
        .filter(|road| road.surface_node().is_some())
    {
        for object in road.objects() {
            let hides = |crg: &Crg<'_>| crg.hides_road_surface().unwrap_or(true);
            if let Some(crg) = object.crgs().find(hides) {
                check(road, &object, &crg, found);
            }
        }
    }
}

fn check(road: &Road<'_>, object: &Object<'_>, crg: &Crg<'_>, found: &mut Sink<'_>) {
    let (Some(s), Some(length), Some(width)) = (object.s(), object.length(), object.width()) else {
        return;
    };
    let (sin, cos) = object.hdg().unwrap_or(0.0).sin_cos();
    let half = 0.5 * ((length * cos).abs() + (width * sin).abs());
    let fixed = ["attached0", "genuine", "global"];
    let below = road.crgs().find(|below| {
        let mode = below.mode().filter(|mode| fixed.contains(mode));
        let heights = below.purpose().is_none_or(|purpose| purpose == "elevation");
        let range = below.s_start().zip(below.s_end());
        mode.is_some()
            && heights
            && range.is_some_and(|(from, to)| s - half < to && s + half > from)
    });
    if let Some(below) = below {
        let text = format!(
            "the surface of object `{}` hides the road surface, but lies over a CRG with mode `{}`; with any \
             mode other than `attached`, `hideRoadSurfaceCRG` must be false",
            object.id().unwrap_or_default(),
            below.mode().unwrap_or_default()
        );
        found
            .issue(
                Place::attribute_or_node(crg.node(), "hideRoadSurfaceCRG"),
                text,
            )
            .on(road, s, object.t().unwrap_or(0.0))
            .at(below.node(), "the road's CRG");
    }
}
