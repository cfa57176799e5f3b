//! Borders of lanes as polynomials over s, for finding extremes without sampling (OpenDRIVE 1.9,
//! 11.5, 11.7).

use crate::prelude::*;
use qcbus_opendrive::geometry::Minimum;

/// A stretch on which a value is one cubic polynomial in the distance from `from`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    /// s of the start, in metres.
    pub from: f64,
    /// s of the end, in metres.
    pub to: f64,
    pub cubic: Cubic,
}

impl Piece {
    /// Returns the lowest value with its s.
    pub fn minimum(&self) -> Option<Minimum> {
        let low = self.cubic.minimum(0.0, self.to - self.from)?;
        Some(Minimum {
            at: self.from + low.at,
            value: low.value,
        })
    }

    /// Returns the highest value with its s.
    pub fn maximum(&self) -> Option<Minimum> {
        let high = self.cubic.maximum(0.0, self.to - self.from)?;
        Some(Minimum {
            at: self.from + high.at,
            value: high.value,
        })
    }

    /// Returns the value with the greatest magnitude, with its s.
    pub fn farthest(&self) -> Option<Minimum> {
        let (low, high) = (self.minimum()?, self.maximum()?);
        Some(if low.value.abs() > high.value.abs() {
            low
        } else {
            high
        })
    }

    /// Returns the same polynomial from `from` to `to`.
    fn cut(&self, from: f64, to: f64) -> Piece {
        Piece {
            from,
            to,
            cubic: self.cubic.shifted(from - self.from),
        }
    }
}

/// Returns the sum of two polynomials.
pub(crate) fn sum(one: Cubic, other: Cubic) -> Cubic {
    Cubic::new(
        one.a + other.a,
        one.b + other.b,
        one.c + other.c,
        one.d + other.d,
    )
}

/// Returns t of the outer border of the `count`-th lane of a side, counted from the center, which
/// is 0. Stretches where a lane has no width or border are left out.
pub(crate) fn border(section: SectionRef<'_, '_>, side: Side, count: usize) -> Vec<Piece> {
    let (Some(start), Some(end)) = (section.s(), section.end(side)) else {
        return Vec::new();
    };
    if count > 0 && !section.is_numbered(side) {
        return Vec::new();
    }
    let lanes: Vec<_> = section.side(side).take(count).collect();
    // Each profile has the origin of its records, its sign, and a flag. The flag tells whether the
    // value is zero where the profile has no record.
    let mut parts: Vec<(&Profile<'_>, f64, f64, bool)> = Vec::new();
    if section.has_widths(side) || count == 0 {
        parts.push((section.layer.offset(), 0.0, 1.0, true));
        let widths = lanes
            .iter()
            .map(|lane| (lane.widths(), start, side.sign(), false));
        parts.extend(widths);
    } else if let Some(lane) = lanes.last() {
        parts.push((lane.borders(), start, 1.0, false));
    }
    let mut breaks: Vec<f64> = vec![start, end];
    for (profile, from, _, _) in &parts {
        let starts = profile
            .in_order()
            .filter_map(|record| Some(record.start()? + from));
        breaks.extend(starts.filter(|s| *s > start && *s < end));
    }
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|next, one| *next - *one < 1e-9);
    let pieces = breaks.windows(2).filter_map(|pair| {
        let mut cubic = Cubic::constant(0.0);
        for (profile, from, sign, zero) in &parts {
            let at = pair[0] - from;
            match profile.valid_at(at) {
                Some(valid) => cubic = sum(cubic, valid.cubic.shifted(valid.ds).scaled(*sign)),
                None if *zero && profile.at_or_zero(at).is_some() => {}
                None => return None,
            }
        }
        Some(Piece {
            from: pair[0],
            to: pair[1],
            cubic,
        })
    });
    pieces.collect()
}

/// Combines two lists of pieces in ascending order, on the stretches that both cover.
pub(crate) fn combine(
    ones: &[Piece],
    others: &[Piece],
    both: impl Fn(Cubic, Cubic) -> Cubic,
) -> Vec<Piece> {
    let (mut i, mut k) = (0, 0);
    let mut pieces = Vec::new();
    while let (Some(one), Some(other)) = (ones.get(i), others.get(k)) {
        let (from, to) = (one.from.max(other.from), one.to.min(other.to));
        if from < to {
            let cubic = both(one.cut(from, to).cubic, other.cut(from, to).cubic);
            pieces.push(Piece { from, to, cubic });
        }
        if one.to <= other.to {
            i += 1;
        } else {
            k += 1;
        }
    }
    pieces
}
