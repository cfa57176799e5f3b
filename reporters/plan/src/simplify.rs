//! Simplification of lines to fewer points, by level of detail.

use crate::origin::{Segment, Spot};

/// Maximum distance, in centimetres, of a line from the sampled one, for the levels of detail from
/// fine to coarse. The finest level allows 2 cm, of which the samples themselves use
/// [`SAMPLED`](crate::sample::SAMPLED).
const TOLERANCES: [f64; 3] = [2.0 - crate::sample::SAMPLED, 25.0, 200.0];

/// The coarsest level.
const COARSEST: u8 = 2;

/// From this depth, a line is halved and not split at its farthest point. Otherwise a line that
/// loses one point at a time would take quadratic time.
const DEEPEST: u32 = 48;

/// A point of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vertex {
    /// Position in centimetres from the origin.
    pub(crate) at: [i64; 2],
    /// Station along the road, in metres.
    pub(crate) s: f64,
    /// Coarsest level of detail that still contains the point.
    pub(crate) level: u8,
}

/// A stretch of the line between two kept points.
struct Stretch {
    from: usize,
    to: usize,
    /// Level of the coarser neighbours and maximum level between them. So every level keeps the
    /// points of the coarser ones.
    level: u8,
    depth: u32,
}

/// Returns the coarsest level that needs each point, `None` for no level (Ramer, Douglas and
/// Peucker, on a stack). Distances are measured from lines between rounded points, so rounding uses
/// no tolerance. The first point, the last point and those in `forced` (ascending) stay.
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
        open.extend(
            [(stretch.from, at), (at, stretch.to)].map(|(from, to)| Stretch {
                from,
                to,
                level,
                depth,
            }),
        );
    }
    levels
}

/// Returns the point at which a stretch must be split, with its level.
fn split(points: &[Spot], forced: &[usize], stretch: &Stretch) -> Option<(usize, u8)> {
    let &Stretch {
        from, to, level, ..
    } = stretch;
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
    let chord = Segment::between(rounded(from), rounded(to));
    let (mut farthest, mut square) = (from + 1, -1.0);
    for (at, point) in points.iter().enumerate().take(to).skip(from + 1) {
        let off = chord.square(*point);
        if off > square {
            (farthest, square) = (at, off);
        }
    }
    let exceeds = |allowed: &&f64| square > *allowed * *allowed;
    let needed = TOLERANCES.iter().filter(exceeds).count();
    if let Some(own) = needed.checked_sub(1) {
        let at = if stretch.depth < DEEPEST {
            farthest
        } else {
            from.midpoint(to)
        };
        return Some((at, (own as u8).min(level)));
    }
    let next = forced.partition_point(|at| *at <= from);
    let at = *forced.get(next).filter(|at| **at < to)?;
    Some((at, 0))
}

/// Returns the points of a function that must stay. Straight lines between them are within
/// `tolerance` of all points. `points` ascend in their first coordinate. Where two share it (a
/// step), both stay.
pub(crate) fn profile(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    let Some((&first, rest)) = points.split_first() else {
        return kept;
    };
    kept.push(first);
    let (mut anchor, mut last) = (first, first);
    // Range of slopes from the anchor that are close enough to all points since then.
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for &point in rest {
        let along = point[0] - anchor[0];
        let slope = (point[1] - anchor[1]) / along;
        // A second point at the place of the anchor gives NaN, which fails every comparison.
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn off(points: &[Spot], levels: &[Option<u8>], level: u8) -> f64 {
        let kept: Vec<usize> = (0..points.len())
            .filter(|at| levels[*at] >= Some(level))
            .collect();
        let mut farthest: f64 = 0.0;
        for pair in kept.windows(2) {
            let segment = Segment::between(points[pair[0]], points[pair[1]]);
            let inside = points[pair[0]..=pair[1]].iter();
            farthest = inside
                .map(|at| segment.square(*at))
                .fold(farthest, f64::max);
        }
        farthest.sqrt()
    }

    #[test]
    fn forced_points_stay_on_finest_level() {
        let points: Vec<Spot> = (0..10)
            .map(|x| Spot {
                x: f64::from(x),
                y: 0.0,
            })
            .collect();
        let mut expected = [None; 10];
        (expected[0], expected[9]) = (Some(2), Some(2));
        assert_eq!(levels(&points, &[]), expected);
        expected[4] = Some(0);
        assert_eq!(levels(&points, &[0, 4, 9]), expected);
        assert_eq!(levels(&points[..1], &[0]), [Some(2)]);
        assert_eq!(levels(&[], &[]), []);
    }

    #[test]
    fn worst_case_line_is_simplified_without_quadratic_time() {
        // The farthest point is always the next one. At this length, quadratic time would take
        // hours.
        let point = |at: u32| Spot {
            x: f64::from(at),
            y: 1e9
                * (-f64::from(at) / 10_000.0).exp()
                * if at.is_multiple_of(2) { 1.0 } else { -1.0 },
        };
        let points: Vec<Spot> = (0..100_000).map(point).collect();
        let levels = levels(&points, &[]);
        assert!(off(&points, &levels, 0) <= 3.0);
    }

    proptest! {
        #[test]
        fn every_level_stays_within_its_tolerance(
            steps in prop::collection::vec((-300.0..300.0_f64, -300.0..300.0_f64), 2..200),
        ) {
            let mut at = Spot { x: 0.0, y: 0.0 };
            let walk = steps.into_iter().map(|(x, y)| {
                at = Spot { x: at.x + x, y: at.y + y };
                at
            });
            let points: Vec<Spot> = walk.collect();
            let levels = levels(&points, &[]);
            for (level, allowed) in TOLERANCES.into_iter().enumerate() {
                // The distances are measured from rounded ends, which may be up to half a diagonal
                // away.
                prop_assert!(off(&points, &levels, level as u8) <= allowed + 0.71);
            }
        }

        #[test]
        fn profiles_stay_within_their_tolerance(
            values in prop::collection::vec((0_u8..3, -5.0..5.0_f64), 1..100),
        ) {
            let mut along = 0.0;
            let points = values.into_iter().map(|(step, value)| {
                along += f64::from(step);
                [along, value]
            });
            let points: Vec<[f64; 2]> = points.collect();
            let kept = profile(&points, 1.0);
            prop_assert_eq!((kept[0], kept.last()), (points[0], points.last()));
            for [along, value] in points {
                let near = kept.windows(2).chain([&[kept[0], kept[0]][..]]).any(|pair| {
                    let [from, to] = [pair[0], pair[1]];
                    let length = to[0] - from[0];
                    let share = if length > 0.0 { (along - from[0]) / length } else { 0.0 };
                    let inside = (from[0]..=to[0]).contains(&along);
                    let drawn = from[1] + share * (to[1] - from[1]);
                    let between = (from[1].min(to[1])..=from[1].max(to[1])).contains(&value);
                    inside && ((drawn - value).abs() <= 1.0 + 1e-9 || length == 0.0 && between)
                });
                prop_assert!(near, "{along}, {value} in {kept:?}");
            }
        }
    }
}
