//! Outlines that consist of curves (OpenDRIVE 1.9, 13.2.3).

use super::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::CurveLocal;
use qcbus_opendrive::geometry::Curve;

pub(crate) const LENGTH_TOLERANCE: Param = Param::number(
    "length_tolerance",
    0.001,
    "m",
    "maximum accepted difference between the curve's length and `length`",
);

/// Returns every outline that consists of curves.
pub(crate) fn curved_outlines<'m, 'a>(
    map: &'m RoadMap<'a>,
) -> impl Iterator<Item = (&'m Road<'a>, Object<'a>, Outline<'a>)> {
    map.objects().flat_map(|(road, object)| {
        let outlines = object
            .outlines()
            .filter(|outline| outline.curves().next().is_some());
        outlines.map(move |outline| (road, object, outline))
    })
}

/// Returns the start of a curve in u and v.
pub(crate) fn start(curve: &CurveLocal<'_>) -> Option<Point> {
    Point::finite(curve.u()?, curve.v()?)
}

/// Returns the distance from start to end of a curve in metres, independent of `@hdg`.
pub(crate) fn chord(curve: &CurveLocal<'_>) -> Option<f64> {
    let length = curve.length();
    match curve.curve()? {
        Curve::ParamPoly3(poly) => {
            let end = poly.point(last_parameter(&poly, length)?)?;
            Some(end.distance(poly.point(0.0)?))
        }
        other => {
            let end = other.point(length?, length?)?;
            Some(end.x.hypot(end.y))
        }
    }
}

/// Returns the end of a curve, computed from its heading.
pub(crate) fn end(curve: &CurveLocal<'_>) -> Option<Point> {
    let shape = curve.curve()?;
    let length = match &shape {
        Curve::ParamPoly3(poly) => curve.length().or(Some(last_parameter(poly, None)?))?,
        _ => curve.length()?,
    };
    Placed {
        origin: start(curve)?,
        hdg: curve.hdg()?,
        length,
        curve: shape,
    }
    .point(length)
}

fn last_parameter(poly: &ParamPoly3, length: Option<f64>) -> Option<f64> {
    match poly.range {
        ParamRange::Normalized => Some(1.0),
        ParamRange::ArcLength => length,
    }
}

/// Calls `each` for every parametric curve of an outline.
pub(crate) fn for_each_poly<'d>(
    map: &RoadMap<'_>,
    found: &mut Sink<'d>,
    each: impl Fn(&Road<'_>, &Object<'_>, &CurveLocal<'_>, ParamPoly3, &mut Sink<'d>),
) {
    for (road, object, outline) in curved_outlines(map) {
        for curve in outline.curves() {
            if let Some(Curve::ParamPoly3(poly)) = curve.curve() {
                each(road, &object, &curve, poly, found);
            }
        }
    }
}

/// Reports curves with this range that have the given length only over the other range. It also
/// reports curves with `arcLength` and without a length.
pub(crate) fn range_fits(map: &RoadMap<'_>, range: ParamRange, found: &mut Sink<'_>) {
    for_each_poly(map, found, |road, object, curve, poly, found| {
        let (Some((_, node)), true) = (curve.shape(), poly.range == range) else {
            return;
        };
        let Some(length) = curve.length() else {
            if range == ParamRange::ArcLength {
                let text = "with `pRange=\"arcLength\"` the parameter runs from 0 to the `length` of the \
                            `curveLocal`, which is missing";
                found.issue(curve.node(), text).on(
                    road,
                    object.s().unwrap_or(0.0),
                    object.t().unwrap_or(0.0),
                );
            }
            return;
        };
        let (word, said, other) = match range {
            ParamRange::ArcLength => ("arcLength", length, ("normalized", 1.0)),
            ParamRange::Normalized => ("normalized", 1.0, ("arcLength", length)),
        };
        let tolerance = found.number(&LENGTH_TOLERANCE);
        let lengths = poly
            .arc_length(0.0, said)
            .zip(poly.arc_length(0.0, other.1));
        let Some((claimed, alternative)) = lengths else {
            return;
        };
        if (claimed - length).abs() > tolerance && (alternative - length).abs() <= tolerance {
            let text = format!(
                "with `pRange=\"{word}\"` the parameter runs from 0 to {said}; over this range the curve is \
                 {claimed:.3} m long, but `length` is {length} m; with `{}` the lengths would agree",
                other.0
            );
            found
                .issue(Place::attribute_or_node(node, "pRange"), text)
                .on(road, object.s().unwrap_or(0.0), object.t().unwrap_or(0.0));
        }
    });
}
