//! Properties of every curve, whatever its numbers.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use qcbus_opendrive::geometry::{
    Cubic, Curve, ParamPoly3, ParamRange, Placed, Point, Poly3, Spiral, heading_difference,
    wrap_angle,
};

fn placed(curve: Curve, length: f64) -> Placed {
    Placed {
        origin: Point { x: 3.0, y: -7.0 },
        hdg: 0.7,
        length,
        curve,
    }
}

/// Generates curves of ordinary roads: radii above 5 m, lengths up to 100 m.
fn ordinary() -> impl Strategy<Value = Placed> {
    let curvature = -0.2..0.2_f64;
    let spiral = (curvature.clone(), curvature.clone(), 1.0..100.0_f64);
    let cubic = (-0.01..0.01_f64, -0.0005..0.0005_f64);
    prop_oneof![
        (1.0..100.0_f64).prop_map(|length| placed(Curve::Line, length)),
        (curvature, 1.0..100.0_f64)
            .prop_map(|(curvature, length)| placed(Curve::Arc { curvature }, length)),
        spiral.prop_map(|(start, to, length)| {
            let rate = (to - start) / length;
            placed(Curve::Spiral(Spiral { start, rate }), length)
        }),
        (cubic.clone(), 1.0..40.0_f64).prop_map(|((c, d), length)| {
            placed(
                Curve::Poly3(Poly3 {
                    v: Cubic::new(0.0, 0.0, c, d),
                }),
                length,
            )
        }),
        (cubic.clone(), cubic, 1.0..40.0_f64).prop_map(|((cu, du), (cv, dv), length)| {
            let (u, v) = (
                Cubic::new(0.0, 1.0, cu / 10.0, du / 10.0),
                Cubic::new(0.0, 0.0, cv, dv),
            );
            placed(
                Curve::ParamPoly3(ParamPoly3 {
                    u,
                    v,
                    range: ParamRange::ArcLength,
                }),
                length,
            )
        }),
    ]
}

proptest! {
    #[test]
    fn heading_is_direction_of_curve(curve in ordinary(), share in 0.01..0.99_f64) {
        let ds = share * curve.length;
        let (before, here, after) = (curve.point(ds - 1e-5), curve.pose(ds), curve.point(ds + 1e-5));
        let (before, here, after) = (before.unwrap(), here.unwrap(), after.unwrap());
        let numeric = (after.y - before.y).atan2(after.x - before.x);
        prop_assert!(heading_difference(numeric, here.hdg).unwrap() < 1e-5, "{here:?} {numeric}");
    }

    #[test]
    fn curvature_is_turn_per_metre(curve in ordinary(), share in 0.01..0.99_f64) {
        let ds = share * curve.length;
        let (before, here, after) = (curve.pose(ds - 1e-4).unwrap(), curve.pose(ds).unwrap(), curve.pose(ds + 1e-4).unwrap());
        let metres = before.point().distance(after.point());
        let turn = wrap_angle(after.hdg - before.hdg).unwrap();
        prop_assert!((turn / metres - here.curvature).abs() < 1e-5, "{here:?} {}", turn / metres);
    }

    #[test]
    fn lines_arcs_and_spirals_advance_one_metre_per_metre(curve in ordinary(), share in 0.0..0.99_f64) {
        prop_assume!(!matches!(curve.curve, Curve::ParamPoly3(_)));
        let ds = share * curve.length;
        let step = curve.point(ds).unwrap().distance(curve.point(ds + 1e-4).unwrap());
        prop_assert!((step - 1e-4).abs() < 1e-8, "{step}");
    }

    #[test]
    fn spiral_of_equal_curvatures_is_arc(curvature in -0.5..0.5_f64, length in 0.1..200.0_f64, share in 0.0..1.0_f64) {
        let spiral = placed(Curve::Spiral(Spiral::between(curvature, curvature, length).unwrap()), length);
        let arc = placed(Curve::Arc { curvature }, length);
        let (one, other) = (spiral.pose(share * length).unwrap(), arc.pose(share * length).unwrap());
        prop_assert!(one.point().distance(other.point()) < 1e-9, "{one:?} {other:?}");
        prop_assert!((one.hdg - other.hdg).abs() < 1e-12);
    }

    #[test]
    fn spiral_forth_and_back_ends_at_its_start(from in -0.2..0.2_f64, to in -0.2..0.2_f64, length in 1.0..100.0_f64) {
        let there = placed(Curve::Spiral(Spiral::between(from, to, length).unwrap()), length);
        let end = there.pose(length).unwrap();
        let curve = Curve::Spiral(Spiral::between(-to, -from, length).unwrap());
        let back = Placed { origin: end.point(), hdg: end.hdg + PI, length, curve }.pose(length).unwrap();
        prop_assert!(back.point().distance(there.origin) < 1e-9);
        prop_assert!(heading_difference(back.hdg, there.hdg + PI).unwrap() < 1e-12);
    }

    #[test]
    fn straight_parametric_curve_has_expected_length(bu in -3.0..3.0_f64, bv in -3.0..3.0_f64, length in 0.1..50.0_f64) {
        prop_assume!(bu.hypot(bv) > 1e-3);
        let (u, v) = (Cubic::new(0.0, bu, 0.0, 0.0), Cubic::new(0.0, bv, 0.0, 0.0));
        let long = Curve::ParamPoly3(ParamPoly3 { u, v, range: ParamRange::ArcLength });
        let short = Curve::ParamPoly3(ParamPoly3 { u, v, range: ParamRange::Normalized });
        prop_assert!((long.true_length(length).unwrap() - length * bu.hypot(bv)).abs() < 1e-9);
        prop_assert!((short.true_length(length).unwrap() - bu.hypot(bv)).abs() < 1e-9);
        let (one, other) = (placed(long, 1.0).pose(0.5).unwrap(), placed(short, 1.0).pose(0.5).unwrap());
        prop_assert!(one.point().distance(other.point()) < 1e-12);
        prop_assert!(one.curvature.abs() < 1e-12);
    }

    #[test]
    fn poly3_parameter_gives_requested_arc_length(c in -0.05..0.05_f64, d in -0.001..0.001_f64, ds in 0.0..60.0_f64) {
        let curve = Poly3 { v: Cubic::new(0.0, 0.0, c, d) };
        let u = curve.parameter(ds).unwrap();
        prop_assert!((curve.arc_length(u).unwrap() - ds).abs() < 1e-8);
    }

    #[test]
    fn extreme_numbers_give_finite_results_or_none(
        numbers in proptest::array::uniform12(hostile()), normalized in any::<bool>(),
    ) {
        let [a, b, c, d, e, f, g, h, x, hdg, length, ds] = numbers;
        let range = if normalized { ParamRange::Normalized } else { ParamRange::ArcLength };
        let (u, v) = (Cubic::new(a, b, c, d), Cubic::new(e, f, g, h));
        let spiral = Spiral::between(a, b, length).map(Curve::Spiral);
        let curves = [
            Some(Curve::Line),
            Some(Curve::Arc { curvature: a }),
            spiral,
            Some(Curve::Poly3(Poly3 { v: u })),
            Some(Curve::ParamPoly3(ParamPoly3 { u, v, range })),
        ];
        for curve in curves.into_iter().flatten() {
            let placed = Placed { origin: Point { x, y: -x }, hdg, length, curve };
            for ds in [ds, 0.0, length] {
                if let Some(pose) = placed.pose(ds) {
                    prop_assert!(pose.finite().is_some());
                }
                prop_assert!(placed.point(ds).is_none_or(|point| point.x.is_finite() && point.y.is_finite()));
            }
            prop_assert!(curve.true_length(length).is_none_or(f64::is_finite));
        }
    }
}

/// Generates numbers that break careless code, besides plain ones.
fn hostile() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::sample::select(vec![
            0.0,
            -0.0,
            1.0,
            -1.0,
            1e-300,
            -1e-300,
            5e-324,
            1e308,
            -1e308,
            f64::MAX,
            f64::MIN,
            1e16,
            1e9,
            -1e9,
            1e-9,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            PI,
        ]),
        any::<f64>(),
        -100.0..100.0_f64,
    ]
}

#[test]
fn full_circle_ends_at_its_start() {
    for radius in [0.5, 10.0, 1e6] {
        let length = TAU * radius;
        let circle = placed(
            Curve::Arc {
                curvature: 1.0 / radius,
            },
            length,
        );
        let (start, end) = (circle.pose(0.0).unwrap(), circle.pose(length).unwrap());
        assert!(start.point().distance(end.point()) < 1e-9 * radius);
        assert!((end.hdg - start.hdg - TAU).abs() < 1e-12);
        let across = circle.point(length / 2.0).unwrap();
        assert!((across.distance(start.point()) - 2.0 * radius).abs() < 1e-9 * radius);
    }
}

#[test]
fn parabola_has_textbook_length() {
    // v = u²/2 from 0 to 1: (√2 + asinh 1) / 2.
    let curve = Poly3 {
        v: Cubic::new(0.0, 0.0, 0.5, 0.0),
    };
    let textbook = (2.0_f64.sqrt() + 1.0_f64.asinh()) / 2.0;
    assert!((curve.arc_length(1.0).unwrap() - textbook).abs() < 1e-12);
}

#[test]
fn vanishing_curvature_gives_straight_line() {
    let straight = placed(Curve::Line, 50.0).point(50.0).unwrap();
    for curvature in [0.0, 1e-300, 1e-18, -1e-15] {
        let arc = placed(Curve::Arc { curvature }, 50.0).point(50.0).unwrap();
        assert!(arc.distance(straight) < 1e-11, "{curvature}");
        let spiral = Spiral::between(0.0, curvature, 50.0).unwrap();
        let spiral = placed(Curve::Spiral(spiral), 50.0).point(50.0).unwrap();
        assert!(spiral.distance(straight) < 1e-11, "{curvature}");
    }
}

#[test]
fn stationary_curve_has_point_but_no_pose() {
    let still = Cubic::constant(2.0);
    let curve = ParamPoly3 {
        u: still,
        v: still,
        range: ParamRange::Normalized,
    };
    assert_eq!(curve.pose(0.5), None);
    assert_eq!(curve.point(0.5), Some(Point { x: 2.0, y: 2.0 }));
    assert_eq!(curve.arc_length(0.0, 1.0), Some(0.0));
}
