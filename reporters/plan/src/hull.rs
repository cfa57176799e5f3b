//! Outlines around points: convex hull and centroid.

/// Returns the convex hull, counter-clockwise (Andrew's monotone chain). It has fewer than three
/// points if all points are on a line.
pub(crate) fn hull(mut points: Vec<[i64; 2]>) -> Vec<[i64; 2]> {
    points.sort_unstable();
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut around = half(points.iter());
    let back = half(points.iter().rev());
    around.pop();
    around.extend(back);
    around.pop();
    around
}

fn half<'p>(points: impl Iterator<Item = &'p [i64; 2]>) -> Vec<[i64; 2]> {
    let mut chain: Vec<[i64; 2]> = Vec::new();
    for &point in points {
        while let [.., before, last] = chain[..] {
            if turn(before, last, point) > 0 {
                break;
            }
            chain.pop();
        }
        chain.push(point);
    }
    chain
}

/// Returns twice the area of a triangle, positive if it is counter-clockwise. The points of a plan
/// are too close together for an overflow.
fn turn([ax, ay]: [i64; 2], [bx, by]: [i64; 2], [cx, cy]: [i64; 2]) -> i64 {
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

/// Returns the centroid of the area within an outline, or of its points if the area is zero.
pub(crate) fn centroid(outline: &[[i64; 2]]) -> Option<[f64; 2]> {
    let &first = outline.first()?;
    let relative = |point: &[i64; 2]| [0, 1].map(|axis| (point[axis] - first[axis]) as f64);
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    let next = outline.iter().cycle().skip(1);
    for (one, next) in outline.iter().map(relative).zip(next.map(relative)) {
        let cross = one[0] * next[1] - next[0] * one[1];
        area += cross;
        x += cross * (one[0] + next[0]);
        y += cross * (one[1] + next[1]);
    }
    let (x, y) = if area == 0.0 {
        let count = outline.len() as f64;
        let sum = |axis: usize| {
            outline
                .iter()
                .map(|point| relative(point)[axis])
                .sum::<f64>()
        };
        (sum(0) / count, sum(1) / count)
    } else {
        (x / (3.0 * area), y / (3.0 * area))
    };
    Some([first[0] as f64 + x, first[1] as f64 + y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hull_of_square_is_its_corners() {
        let points = vec![[0, 0], [2, 2], [1, 1], [2, 0], [0, 2], [1, 0], [2, 2]];
        assert_eq!(hull(points), [[0, 0], [2, 0], [2, 2], [0, 2]]);
        assert_eq!(hull(vec![[1, 1], [1, 1]]), [[1, 1]]);
        assert_eq!(hull(vec![[0, 0], [1, 1], [2, 2]]), [[0, 0], [2, 2]]);
    }

    #[test]
    fn centroid_is_computed_from_the_area() {
        // An additional corner on one edge moves the mean of the points, but not the centroid of
        // the area.
        let square = [[0, 0], [4, 0], [4, 1], [4, 2], [4, 4], [0, 4]];
        assert_eq!(centroid(&square), Some([2.0, 2.0]));
        assert_eq!(centroid(&[[0, 0], [4, 2]]), Some([2.0, 1.0]));
        assert_eq!(centroid(&[]), None);
    }
}
