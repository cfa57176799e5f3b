//! The Fresnel integrals, to double precision.

use std::f64::consts::PI;

/// Below this argument, the power series loses at most two digits to cancellation.
const SERIES_LIMIT: f64 = 1.7;

/// Above this argument, both integrals are 1/2 to the last digit: they oscillate by `1/(π·x)`.
const SETTLED: f64 = 1e17;

/// Computes the Fresnel integrals `C(x) = ∫₀ˣ cos(π·t²/2) dt` and `S(x) = ∫₀ˣ sin(π·t²/2) dt` as
/// `(C, S)`; both tend to ±1/2. Returns `None` if `x` is not finite.
///
/// Small arguments use the power series. Others use the complementary error function on the
/// diagonal of the complex plane. Its continued fraction is from Abramowitz and Stegun, 7.3.11,
/// 7.3.13, 7.3.22 and 7.1.14.
pub fn fresnel(x: f64) -> Option<(f64, f64)> {
    if !x.is_finite() {
        return None;
    }
    let size = x.abs();
    let (c, s) = if size < SERIES_LIMIT {
        series(size)
    } else if size > SETTLED {
        (0.5, 0.5)
    } else {
        continued_fraction(size)
    };
    Some((c.copysign(x), s.copysign(x)))
}

/// Sums the power series of both integrals, which share their terms: `xᵏ·(π·x²/2)ⁿ / n!`.
fn series(x: f64) -> (f64, f64) {
    let step = 0.5 * PI * x * x;
    let (mut c, mut s) = (0.0, 0.0);
    let mut term = x;
    for n in 0..40_u32 {
        let part = term / f64::from(2 * n + 1);
        match n % 4 {
            0 => c += part,
            1 => s += part,
            2 => c -= part,
            _ => s -= part,
        }
        term *= step / f64::from(n + 1);
    }
    (c, s)
}

/// Computes `C + i·S = (1+i)/2 · erf(z)` with `z = √π/2·(1-i)·x`, where `z² = -i·π·x²/2`. The
/// continued fraction of `erfc(z)` is evaluated from its tail.
fn continued_fraction(x: f64) -> (f64, f64) {
    const TERMS: u32 = 90;
    let double_square = -PI * x * x; // 2·z², purely imaginary
    let (mut re, mut im) = (f64::from(4 * TERMS + 1), double_square);
    for n in (1..=TERMS).rev() {
        let numerator = f64::from((2 * n - 1) * (2 * n));
        let norm = re * re + im * im;
        let head = f64::from(4 * n - 3);
        (re, im) = (
            head - numerator * re / norm,
            double_square + numerator * im / norm,
        );
    }
    // erfc(z) = e^(-z²)/√π · 2z / (re + i·im), and 2z/√π = (1-i)·x.
    let norm = re * re + im * im;
    let (mut p, mut q) = (x * (re - im) / norm, -x * (re + im) / norm);
    let (sin, cos) = quarter_phase(x);
    (p, q) = (p * cos - q * sin, p * sin + q * cos);
    // (1+i)/2 · (1 - erfc)
    (0.5 * (1.0 - p + q), 0.5 * (1.0 - p - q))
}

/// Returns the sine and cosine of `π·x²/2`. The square is reduced before the multiplication.
fn quarter_phase(x: f64) -> (f64, f64) {
    let square = x * x;
    let error = x.mul_add(x, -square);
    (0.5 * PI * (square % 4.0 + error)).sin_cos()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::quadrature::integrate;

    /// Checks values to 16 digits from tables of the integrals.
    #[test]
    fn fresnel_integrals_match_known_values() {
        let table = [
            (0.0, 0.0, 0.0),
            (0.5, 0.492_344_225_871_445_6, 0.064_732_432_859_999_29),
            (1.0, 0.779_893_400_376_822_8, 0.438_259_147_390_354_8),
            (1.5, 0.445_261_176_039_821_7, 0.697_504_960_082_093),
            (2.0, 0.488_253_406_075_340_8, 0.343_415_678_363_698_3),
            (5.0, 0.563_631_188_704_012_3, 0.499_191_381_917_116_9),
        ];
        for (x, c, s) in table {
            let (got_c, got_s) = fresnel(x).unwrap();
            assert!(
                (got_c - c).abs() < 4e-15 && (got_s - s).abs() < 4e-15,
                "{x}: {got_c} {got_s}"
            );
            let (minus_c, minus_s) = fresnel(-x).unwrap();
            assert_eq!((minus_c, minus_s), (-got_c, -got_s));
        }
    }

    #[test]
    fn fresnel_handles_extreme_arguments() {
        assert_eq!(fresnel(f64::NAN), None);
        assert_eq!(fresnel(f64::INFINITY), None);
        let (c, s) = fresnel(1e300).unwrap();
        assert!((c - 0.5).abs() < 1e-12 && (s - 0.5).abs() < 1e-12);
        assert_eq!(fresnel(1e-300), Some((1e-300, 0.0)));
    }

    proptest! {
        #[test]
        fn fresnel_agrees_with_quadrature(x in -7.0..7.0_f64) {
            let c = integrate(0.0, x, 1e-15, |t| (0.5 * PI * t * t).cos()).unwrap();
            let s = integrate(0.0, x, 1e-15, |t| (0.5 * PI * t * t).sin()).unwrap();
            let (got_c, got_s) = fresnel(x).unwrap();
            prop_assert!((got_c - c).abs() < 1e-13, "{got_c} {c}");
            prop_assert!((got_s - s).abs() < 1e-13, "{got_s} {s}");
        }
    }
}
