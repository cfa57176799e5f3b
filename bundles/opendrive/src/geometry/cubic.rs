//! Cubic polynomials `a + b·x + c·x² + d·x³`, the form of every profile in OpenDRIVE.

use super::finite;

/// A cubic polynomial of one variable.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cubic {
    /// The constant coefficient.
    pub a: f64,
    /// The linear coefficient.
    pub b: f64,
    /// The quadratic coefficient.
    pub c: f64,
    /// The cubic coefficient.
    pub d: f64,
}

/// The lowest value of a polynomial in an interval, with its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// Place of the lowest value.
    pub at: f64,
    /// The lowest value.
    pub value: f64,
}

impl Cubic {
    /// Creates the polynomial with these coefficients.
    pub fn new(a: f64, b: f64, c: f64, d: f64) -> Cubic {
        Cubic { a, b, c, d }
    }

    /// Creates the polynomial that is `value` everywhere.
    pub fn constant(value: f64) -> Cubic {
        Cubic::new(value, 0.0, 0.0, 0.0)
    }

    /// Returns the value at `x`. With extreme coefficients, it may be infinite or not a number.
    pub fn value(&self, x: f64) -> f64 {
        self.a + x * (self.b + x * (self.c + x * self.d))
    }

    /// Returns the value at `x` if it is finite.
    pub fn eval(&self, x: f64) -> Option<f64> {
        finite(self.value(x))
    }

    /// Returns the slope at `x`.
    pub fn slope(&self, x: f64) -> f64 {
        self.b + x * (2.0 * self.c + x * 3.0 * self.d)
    }

    /// Returns the second derivative at `x`.
    pub fn second_derivative(&self, x: f64) -> f64 {
        2.0 * self.c + 6.0 * self.d * x
    }

    /// Returns the curve with its origin at `offset`:
    /// `self.shifted(o).value(x) == self.value(o + x)`.
    pub fn shifted(&self, offset: f64) -> Cubic {
        Cubic {
            a: self.value(offset),
            b: self.slope(offset),
            c: self.second_derivative(offset) / 2.0,
            d: self.d,
        }
    }

    /// Returns the difference `self - other`, coefficient by coefficient.
    pub fn minus(&self, other: &Cubic) -> Cubic {
        Cubic::new(
            self.a - other.a,
            self.b - other.b,
            self.c - other.c,
            self.d - other.d,
        )
    }

    /// Returns the polynomial times `factor`.
    pub fn scaled(&self, factor: f64) -> Cubic {
        Cubic::new(
            self.a * factor,
            self.b * factor,
            self.c * factor,
            self.d * factor,
        )
    }

    /// Returns the lowest value over `[from, to]`. It lies at an end or where the slope vanishes.
    /// Returns `None` if the interval is empty or a value is not finite.
    pub fn minimum(&self, from: f64, to: f64) -> Option<Minimum> {
        let proper = from.is_finite() && to.is_finite() && from <= to;
        if !proper {
            return None;
        }
        let mut lowest = Minimum {
            at: from,
            value: self.eval(from)?,
        };
        let inner = self.stationary();
        for at in inner.into_iter().flatten().chain([to]) {
            if at > from && at <= to {
                let value = self.eval(at)?;
                if value < lowest.value {
                    lowest = Minimum { at, value };
                }
            }
        }
        Some(lowest)
    }

    /// Returns the highest value over `[from, to]`; see [`Cubic::minimum`].
    pub fn maximum(&self, from: f64, to: f64) -> Option<Minimum> {
        let lowest = self.scaled(-1.0).minimum(from, to)?;
        Some(Minimum {
            at: lowest.at,
            value: -lowest.value,
        })
    }

    /// Returns the places where the slope vanishes, at most two, in ascending order.
    pub fn stationary(&self) -> [Option<f64>; 2] {
        quadratic_roots(3.0 * self.d, 2.0 * self.c, self.b)
    }
}

/// Returns the real roots of `p·x² + q·x + r`, without cancellation; none for zero coefficients.
fn quadratic_roots(p: f64, q: f64, r: f64) -> [Option<f64>; 2] {
    if p == 0.0 {
        let root = if q == 0.0 { None } else { finite(-r / q) };
        return [root, None];
    }
    // Scaling keeps the discriminant from overflowing or vanishing.
    let scale = p.abs().max(q.abs()).max(r.abs());
    let (p, q, r) = (p / scale, q / scale, r / scale);
    let discriminant = q * q - 4.0 * p * r;
    if discriminant.is_nan() || discriminant < 0.0 {
        return [None, None];
    }
    let m = -0.5 * (q + discriminant.sqrt().copysign(q));
    let (one, other) = (finite(m / p), finite(r / m));
    match (one, other) {
        (Some(x), Some(y)) if y < x => [other, one],
        _ => [one, other],
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn minimum_between_interval_ends_is_found() {
        let parabola = Cubic::new(3.0, -2.0, 1.0, 0.0);
        let lowest = parabola.minimum(0.0, 5.0).unwrap();
        assert!((lowest.at - 1.0).abs() < 1e-12 && (lowest.value - 2.0).abs() < 1e-12);
        assert_eq!(parabola.minimum(2.0, 1.0), None);
        assert_eq!(parabola.minimum(0.0, f64::INFINITY), None);
        assert_eq!(Cubic::constant(4.0).minimum(0.0, 0.0).unwrap().value, 4.0);
    }

    proptest! {
        #[test]
        fn no_sample_lies_below_the_minimum(
            a in -10.0..10.0, b in -10.0..10.0, c in -10.0..10.0, d in -10.0..10.0,
            from in -5.0..5.0, span in 0.0..10.0, f in 0.0..1.0,
        ) {
            let cubic = Cubic::new(a, b, c, d);
            let lowest = cubic.minimum(from, from + span).unwrap();
            let highest = cubic.maximum(from, from + span).unwrap();
            let sample = cubic.value(from + f * span);
            prop_assert!(sample >= lowest.value - 1e-7);
            prop_assert!(sample <= highest.value + 1e-7);
        }

        #[test]
        fn shifted_cubic_is_same_curve(
            a in -10.0..10.0, b in -1.0..1.0, c in -1.0..1.0, d in -1.0..1.0,
            offset in -20.0..20.0, x in -20.0..20.0,
        ) {
            let cubic = Cubic::new(a, b, c, d);
            let direct = cubic.value(offset + x);
            prop_assert!((cubic.shifted(offset).value(x) - direct).abs() < 1e-8 * (1.0 + direct.abs()));
        }

        #[test]
        fn extreme_numbers_give_finite_minimum_or_none(
            a in any::<f64>(), b in any::<f64>(), c in any::<f64>(), d in any::<f64>(),
            from in any::<f64>(), to in any::<f64>(),
        ) {
            let cubic = Cubic::new(a, b, c, d);
            if let Some(lowest) = cubic.minimum(from, to) {
                prop_assert!(lowest.value.is_finite());
            }
        }
    }
}
