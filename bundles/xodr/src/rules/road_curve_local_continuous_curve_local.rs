use crate::families::on_road::OnRoad;
use crate::families::outline_curves::{chord, curved_outlines, end, start};
use crate::prelude::*;
use qcbus_opendrive::CurveLocal;
use qcbus_opendrive::geometry::Curve;

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance between the end of a curve and the start of the next one",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[GAP],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (road, object, outline) in curved_outlines(map) {
        let curves: Vec<CurveLocal<'_>> = outline.curves().collect();
        let closing = curves.first().filter(|_| outline.closed() == Some(true));
        for (curve, next) in curves.iter().zip(curves.iter().skip(1).chain(closing)) {
            check(road, &object, curve, next, found);
        }
    }
}

fn check(
    road: &Road<'_>,
    object: &Object<'_>,
    curve: &CurveLocal<'_>,
    next: &CurveLocal<'_>,
    found: &mut Sink<'_>,
) {
    let limit = found.number(&GAP);
    let (Some(from), Some(to)) = (start(curve), start(next)) else {
        return;
    };
    let distance = from.distance(to);
    let by_length = chord(curve).filter(|chord| (chord - distance).abs() > limit);
    // A curve without a length ends at the start of the next curve if its radius allows that.
    let too_far = match (curve.curve(), curve.length()) {
        (Some(Curve::Arc { curvature }), None) => {
            Some(2.0 / curvature.abs()).filter(|widest| distance > widest + limit)
        }
        _ => None,
    };
    let (text, level) = if let Some(chord) = by_length {
        let text = format!(
            "the curve ends {chord:.3} m from its start, but the next curve starts {distance:.3} m from that \
             start; an outline must be continuous"
        );
        (text, Level::Error)
    } else if let Some(widest) = too_far {
        let text = format!(
            "the next curve starts {distance:.3} m away, but an arc of this curvature reaches at most \
             {widest:.3} m; an outline must be continuous"
        );
        (text, Level::Error)
    } else if let Some(gap) = end(curve)
        .map(|end| end.distance(to))
        .filter(|gap| *gap > limit)
    {
        let text = format!(
            "with its `hdg`, the curve ends {gap:.3} m away from the start of the next curve; an outline must be \
             continuous"
        );
        (text, Level::Warning)
    } else {
        return;
    };
    found
        .issue(curve.node(), text)
        .level(level)
        .on(road, object.s().unwrap_or(0.0), object.t().unwrap_or(0.0))
        .at(next.node(), "the next curve");
}
