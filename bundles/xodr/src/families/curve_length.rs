//! Checks the length of parametric curves against their geometry (OpenDRIVE 1.9, 9.6).

use super::faults::shape_of;
use super::on_road::OnRoad;
use crate::prelude::*;

/// Maximum difference between the two lengths.
pub(crate) const LENGTH_TOLERANCE: Param = Param::number(
    "length_tolerance",
    0.001,
    "m",
    "maximum accepted difference between the curve's length and `@length`",
);

/// Reports curves with this explicit `@pRange` whose length over the parameter range is not
/// `@length`.
pub(crate) fn range_fits(part: MapPart<'_, '_>, range: ParamRange, found: &mut Sink<'_>) {
    for_each_mismatch(part, found, |curve, mismatch, found| {
        if curve.range != range
            || mismatch
                .geometry
                .shape_node()
                .is_none_or(|node| node.attribute("pRange").is_none())
        {
            return;
        }
        let (word, interval) = match range {
            ParamRange::ArcLength => ("arcLength", format!("0 to {}", mismatch.length)),
            ParamRange::Normalized => ("normalized", "0 to 1".to_owned()),
        };
        let hint = match other_range(&curve, &mismatch, found.number(&LENGTH_TOLERANCE)) {
            Some(other) => format!("; with `{other}` the lengths would agree"),
            None => String::new(),
        };
        let text = format!(
            "with `pRange=\"{word}\"` the parameter runs from {interval}; over this range the curve is {:.6} m \
             long, but `length` is {} m{hint}",
            mismatch.found, mismatch.length
        );
        report(&mismatch, text, found);
    });
}

/// Reports curves with a normalized parameter, explicit or by default, whose length is not
/// `@length`. Curves with `arcLength` are reported for their wrong range instead.
pub(crate) fn length_matches(part: MapPart<'_, '_>, found: &mut Sink<'_>) {
    for_each_mismatch(part, found, |curve, mismatch, found| {
        if curve.range == ParamRange::Normalized {
            let text = format!(
                "the curve is {:.6} m long, but `length` is {} m; they should agree within {} m",
                mismatch.found,
                mismatch.length,
                found.number(&LENGTH_TOLERANCE)
            );
            report(&mismatch, text, found);
        }
    });
}

struct Mismatch<'m, 'a> {
    road: &'m Road<'a>,
    geometry: &'m Geometry<'a>,
    length: f64,
    found: f64,
}

fn for_each_mismatch<'d>(
    part: MapPart<'_, '_>,
    found: &mut Sink<'d>,
    mut report: impl FnMut(ParamPoly3, Mismatch<'_, '_>, &mut Sink<'d>),
) {
    let tolerance = found.number(&LENGTH_TOLERANCE);
    for road in part.roads() {
        for geometry in road.plan_view().geometries() {
            let lengths = geometry.length().zip(geometry.true_length());
            let (Some(curve), Some((length, true_length))) = (geometry.param_poly3(), lengths)
            else {
                continue;
            };
            if (true_length - length).abs() > tolerance {
                let mismatch = Mismatch {
                    road,
                    geometry,
                    length,
                    found: true_length,
                };
                report(curve, mismatch, found);
            }
        }
    }
}

/// Returns the name of the other range if the curve has the right length over that range.
fn other_range(
    curve: &ParamPoly3,
    mismatch: &Mismatch<'_, '_>,
    tolerance: f64,
) -> Option<&'static str> {
    let (word, end) = match curve.range {
        ParamRange::ArcLength => ("normalized", 1.0),
        ParamRange::Normalized => ("arcLength", mismatch.length),
    };
    let length = curve.arc_length(0.0, end)?;
    ((length - mismatch.length).abs() <= tolerance).then_some(word)
}

fn report(mismatch: &Mismatch<'_, '_>, text: String, found: &mut Sink<'_>) {
    let geometry = mismatch.geometry;
    let middle = geometry.s().unwrap_or(0.0) + 0.5 * mismatch.length;
    found
        .issue(Place::attribute_or_node(geometry.node(), "length"), text)
        .on(mismatch.road, middle, 0.0)
        .fault(shape_of(mismatch.road));
}
