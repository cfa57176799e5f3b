//! Records that repeat a value that already applies (OpenDRIVE 1.9, annex D.2).

use crate::prelude::*;
use qcbus_opendrive::PlanView;
use qcbus_opendrive::Record;

/// A record and the record before it with the same value.
pub(crate) struct Repeated<'p, 'a> {
    pub first: &'p Record<'a>,
    pub second: &'p Record<'a>,
    /// Start of the stretch on which the second record applies.
    pub from: f64,
    pub to: f64,
}

/// Returns pairs of neighbouring records without any change: the continued first record stays
/// within `tolerance` of the second one until its end. `end` is the end of the profile.
pub(crate) fn in_profile<'p, 'a>(
    profile: &'p Profile<'a>,
    end: f64,
    tolerance: f64,
) -> Vec<Repeated<'p, 'a>> {
    if profile.records().len() < 2 {
        return Vec::new();
    }
    let records: Vec<&Record<'a>> = profile.in_order().collect();
    let pairs = (1..records.len()).filter_map(|index| {
        let (first, second) = (records[index - 1], records[index]);
        let next = records.get(index + 1).and_then(|next| next.start());
        let from = second.start()?;
        let to = next.map_or(end, |next| next.min(end)).max(from);
        let shift = from - first.start()?;
        let difference = first.cubic()?.shifted(shift).minus(&second.cubic()?);
        let repeated = Repeated {
            first,
            second,
            from,
            to,
        };
        is_nothing(&difference, to - from, tolerance).then_some(repeated)
    });
    pairs.collect()
}

/// Checks whether a difference stays within `tolerance` over a length. A record without length
/// counts as equal if its polynomial is the same. It ends with the profile or the next record.
fn is_nothing(difference: &Cubic, length: f64, tolerance: f64) -> bool {
    if length <= 0.0 {
        let Cubic { a, b, c, d } = difference;
        return [a, b, c, d].iter().all(|value| value.abs() <= tolerance);
    }
    let extremes = difference
        .minimum(0.0, length)
        .zip(difference.maximum(0.0, length));
    extremes.is_some_and(|(least, most)| least.value >= -tolerance && most.value <= tolerance)
}

/// Returns pairs of neighbouring lines that form one line. They touch within `gap` metres, and
/// their headings differ by at most `turn` radians.
pub(crate) fn in_lines<'p, 'a>(
    plan_view: &'p PlanView<'a>,
    gap: f64,
    turn: f64,
) -> Vec<[&'p Geometry<'a>; 2]> {
    if plan_view.geometries().len() < 2 {
        return Vec::new();
    }
    let lines: Vec<&Geometry<'a>> = plan_view.in_order().collect();
    let one_line = |one: &Geometry<'_>, next: &Geometry<'_>| {
        let both = one.kind() == Some(ShapeKind::Line) && next.kind() == Some(ShapeKind::Line);
        let distance = one.end_point().zip(next.start_point());
        let headings = one.hdg().zip(next.hdg());
        both && distance.is_some_and(|(end, start)| end.distance(start) <= gap)
            && headings
                .and_then(|(one, next)| heading_difference(one, next))
                .is_some_and(|between| between <= turn)
    };
    let pairs = lines.windows(2).filter(|pair| one_line(pair[0], pair[1]));
    pairs.map(|pair| [pair[0], pair[1]]).collect()
}
