//! Fewer points for the same line, level by level.

use crate::origin::Spot;

/// How far, in centimetres, a line may lie from the sampled one on the levels of detail from fine to coarse. Near by
/// 2 cm are allowed, of which the samples themselves take [`SAMPLED`](crate::sample::SAMPLED).
const TOLERANCES: [f64; 3] = [2.0 - crate::sample::SAMPLED, 25.0, 200.0];

/// The coarsest level.
const COARSEST: u8 = 2;

/// From this depth on a line is halved instead of being split at its farthest point: a line that loses one point at a
/// time would take quadratic time.
const DEEPEST: u32 = 48;

/// A point of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vertex {
    /// In centimetres from the origin.
    pub(crate) at: [i64; 2],
    /// Where it lies along the road, in metres.
    pub(crate) s: f64,
    /// The coarsest level of detail that still has it.
    pub(crate) level: u8,
}

/// A stretch of the line between two points that stay.
struct Stretch {
    from: usize,
    to: usize,
    /// The level of the coarser neighbours, which nothing between them exceeds: so every level keeps what the
    /// coarser ones have.
    level: u8,
    depth: u32,
}

/// The coarsest level that needs each point, `None` where no level does (Ramer, Douglas and Peucker, on a stack).
/// Distances are those from lines between rounded points, so that rounding takes nothing from the tolerance. The
/// first, the last and those of `forced` (ascending) stay.
pub(crate) fn levels(points: &[Spot], forced: &[usize]) -> Vec<Option<u8>> {
    let mut levels = vec![None; points.len()];
    let Some(last) = points.len().checked_sub(1) else {
        return levels;
    };
    levels[0] = Some(COARSEST);
    levels[last] = Some(COARSEST);
    let mut open = vec![Stretch {
        from: 0,
        to: last,
        level: COARSEST,
        depth: 0,
    }];
    while let Some(stretch) = open.pop() {
        let Some((at, level)) = split(points, forced, &stretch) else {
            continue;
        };
        levels[at] = Some(level);
        let depth = stretch.depth + 1;
        open.extend([(stretch.from, at), (at, stretch.to)].map(|(from, to)| Stretch {
            from,
            to,
            level,
            depth,
        }));
    }
    levels
}

/// The point at which a stretch has to be split, with its level.
fn split(points: &[Spot], forced: &[usize], stretch: &Stretch) -> Option<(usize, u8)> {
    let &Stretch { from, to, level, .. } = stretch;
    if to - from < 2 {
        return None;
    }
    let rounded = |at: usize| {
        let [x, y] = points[at].rounded();
        Spot {
            x: x as f64,
            y: y as f64,
        }
    };
    let (start, end) = (rounded(from), rounded(to));
    let (mut farthest, mut distance) = (from + 1, -1.0);
    for (at, point) in points.iter().enumerate().take(to).skip(from + 1) {
        let off = point.off(start, end);
        if off > distance {
            (farthest, distance) = (at, off);
        }
    }
    if distance > TOLERANCES[0] {
        let needed = TOLERANCES.iter().filter(|allowed| distance > **allowed);
        let own = needed.count().saturating_sub(1) as u8;
        let at = if stretch.depth < DEEPEST {
            farthest
        } else {
            from.midpoint(to)
        };
        return Some((at, own.min(level)));
    }
    let next = forced.partition_point(|at| *at <= from);
    let at = *forced.get(next).filter(|at| **at < to)?;
    Some((at, 0))
}

/// The points of a function that have to stay for straight lines between them to lie within `tolerance` of all of
/// them; `points` ascend in their first coordinate. Where two share it (a step) both stay.
pub(crate) fn profile(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    let Some((&first, rest)) = points.split_first() else {
        return kept;
    };
    kept.push(first);
    let (mut anchor, mut last) = (first, first);
    // Slopes from the anchor that pass all points since then closely enough.
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for &point in rest {
        let along = point[0] - anchor[0];
        let slope = (point[1] - anchor[1]) / along;
        // NaN, for a second point at the place of the anchor, is within nothing.
        let within = along > 0.0 && slope >= low && slope <= high;
        if !within {
            if last != anchor {
                kept.push(last);
            }
            (anchor, low, high) = (last, f64::NEG_INFINITY, f64::INFINITY);
        }
        let along = point[0] - anchor[0];
        if along > 0.0 {
            low = low.max((point[1] - tolerance - anchor[1]) / along);
            high = high.min((point[1] + tolerance - anchor[1]) / along);
        } else if point != anchor {
            kept.push(point);
            (anchor, low, high) = (point, f64::NEG_INFINITY, f64::INFINITY);
        }
        last = point;
    }
    if last != anchor {
        kept.push(last);
    }
    kept
}
