//! Numerical integration with a bounded number of function calls.

/// Nodes on (0, 1) of the eight-point Gauss-Legendre rule on [-1, 1]. The rule is symmetric.
const NODES: [f64; 4] = [
    0.183_434_642_495_649_8,
    0.525_532_409_916_329,
    0.796_666_477_413_626_7,
    0.960_289_856_497_536_3,
];

/// The weights that belong to [`NODES`].
const WEIGHTS: [f64; 4] = [
    0.362_683_783_378_362,
    0.313_706_645_877_887_3,
    0.222_381_034_453_374_5,
    0.101_228_536_290_376_3,
];

/// Maximum number of times that an interval is halved.
const MAX_DEPTH: u8 = 40;

/// Maximum number of intervals in total.
const MAX_INTERVALS: u32 = 128;

/// Computes the integral of `f` over `[from, to]` by one eight-point Gauss-Legendre rule. The rule
/// is exact for polynomials up to degree 15.
pub(crate) fn gauss8(from: f64, to: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut sum = 0.0;
    for (node, weight) in NODES.iter().zip(WEIGHTS) {
        sum += weight * (f(middle - half * node) + f(middle + half * node));
    }
    sum * half
}

/// Computes the integral of `f` over `[from, to]`. Intervals are halved until both halves agree
/// with the whole. The limit is `tolerance` (absolute, in units of the integral) or a relative
/// 1e-13.
///
/// Returns `None` if the ends or a value are not finite, or after 128 intervals without
/// convergence.
pub fn integrate(from: f64, to: f64, tolerance: f64, f: impl Fn(f64) -> f64) -> Option<f64> {
    if !from.is_finite() || !to.is_finite() {
        return None;
    }
    let mut total = 0.0;
    let mut looked_at = 0;
    let mut open = vec![(from, to, gauss8(from, to, &f), 0_u8)];
    while let Some((low, high, whole, depth)) = open.pop() {
        looked_at += 1;
        let middle = 0.5 * (low + high);
        let (left, right) = (gauss8(low, middle, &f), gauss8(middle, high, &f));
        let halves = left + right;
        if !halves.is_finite() || looked_at > MAX_INTERVALS {
            return None;
        }
        let settled = (halves - whole).abs() <= tolerance.max(1e-13 * halves.abs());
        if settled || depth == MAX_DEPTH {
            total += halves;
        } else {
            open.push((low, middle, left, depth + 1));
            open.push((middle, high, right, depth + 1));
        }
    }
    Some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_matches_known_integrals() {
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-11, "{a:?} {b}");
        close(integrate(0.0, 1.0, 1e-12, |x| x * x), 1.0 / 3.0);
        close(integrate(0.0, 3.0, 1e-12, f64::exp), 3.0_f64.exp() - 1.0);
        close(integrate(-1.0, 1.0, 1e-12, f64::abs), 1.0);
        close(integrate(0.0, 1.0, 1e-12, f64::sqrt), 2.0 / 3.0);
        close(integrate(2.0, 2.0, 1e-12, f64::exp), 0.0);
    }

    #[test]
    fn non_integrable_function_gives_none() {
        assert_eq!(integrate(0.0, 1.0, 1e-12, |_| f64::NAN), None);
        assert_eq!(integrate(0.0, f64::INFINITY, 1e-12, |x| x), None);
        assert_eq!(integrate(0.0, 1e6, 1e-12, |x| (x * x).sin()), None);
    }
}
