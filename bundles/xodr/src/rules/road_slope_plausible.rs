use crate::families::on_road::OnRoad;
use crate::families::written_numbers::brief;
use crate::prelude::*;

const SLOPE: Param = Param::number(
    "slope",
    0.35,
    "",
    "steepest plausible slope of a road, as rise over run",
);
const BANKING: Param = Param::number("banking", 0.8, "rad", "largest plausible superelevation");
const OVERTURNED: Param = Param::number(
    "overturned",
    1.6,
    "rad",
    "from this superelevation on, a road is upside down, which is an error",
);
const CROSSFALL: Param = Param::number(
    "crossfall",
    0.5,
    "",
    "steepest plausible crossfall of a strip of road surface, as rise over run",
);
const LENGTH: Param = Param::number(
    "length",
    2.0,
    "m",
    "smallest length over which a steep road is reported",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[SLOPE, BANKING, OVERTURNED, CROSSFALL, LENGTH],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let most = found.number(&SLOPE);
        let slope = |stretch: &Stretch<'_, '_>, ds: f64| stretch.cubic.slope(ds);
        if let Some((stretch, ds, slope)) = worst(road.elevation(), road, slope, most, found) {
            let text = format!(
                "road `{}` {} by {} % over {:.1} m; slopes are written as rise over run (0.05 for 5 %), and more \
                 than {:.0} % is implausible",
                road.id(),
                if slope > 0.0 { "climbs" } else { "falls" },
                brief(100.0 * slope.abs(), 0),
                stretch.length(),
                100.0 * most
            );
            let s = stretch.from + ds;
            found.issue(stretch.record.node(), text).on(road, s, 0.0);
        }
        let most = found.number(&BANKING);
        let roll = &road.lateral().superelevation;
        let value = |stretch: &Stretch<'_, '_>, ds: f64| stretch.cubic.value(ds);
        if let Some((stretch, ds, value)) = worst(roll, road, value, most, found) {
            let text = format!(
                "road `{}` has a superelevation of {} rad, which is {}°; superelevation is in radians, and more \
                 than {most} rad ({:.0}°) is implausible",
                road.id(),
                brief(value, 3),
                brief(value.abs().to_degrees(), 0),
                most.to_degrees()
            );
            let level = match value.abs() >= found.number(&OVERTURNED) {
                true => Level::Error,
                false => Level::Warning,
            };
            let s = stretch.from + ds;
            let finding = found.issue(stretch.record.node(), text).level(level);
            finding.on(road, s, 0.0);
        }
        crossfall(road, found);
    }
}

/// Reports strips of road surface with a steep crossfall at their start.
fn crossfall(road: &Road<'_>, found: &mut Sink<'_>) {
    let Some(surface) = &road.lateral().cross_section_surface else {
        return;
    };
    let most = found.number(&CROSSFALL);
    for strip in &surface.strips {
        let [_, linear, ..] = &strip.coefficients;
        let value = |stretch: &Stretch<'_, '_>, ds: f64| stretch.cubic.value(ds);
        let Some((stretch, ds, value)) = worst(linear, road, value, most, found) else {
            continue;
        };
        let text = format!(
            "strip `{}` of road `{}` has a crossfall of {} %; it is written as rise over run (0.025 for 2.5 %), \
             and more than {:.0} % is implausible",
            strip.id.unwrap_or_default(),
            road.id(),
            brief(100.0 * value.abs(), 0),
            100.0 * most
        );
        let s = stretch.from + ds;
        found.issue(stretch.record.node(), text).on(road, s, 0.0);
    }
}

/// Returns the stretch of a profile with the largest value above `most`, its distance from the
/// start, and the value. Only inner positions count: a steep end is a step, not a slope.
fn worst<'p, 'a>(
    profile: &'p Profile<'a>,
    road: &Road<'a>,
    measure: impl Fn(&Stretch<'p, 'a>, f64) -> f64,
    most: f64,
    found: &Sink<'_>,
) -> Option<(Stretch<'p, 'a>, f64, f64)> {
    let mut worst: Option<(Stretch<'p, 'a>, f64, f64)> = None;
    for stretch in profile.stretches(road.length()?) {
        let length = stretch.length();
        if length < found.number(&LENGTH) {
            continue;
        }
        for share in [0.25, 0.5, 0.75] {
            let ds = share * length;
            let value = measure(&stretch, ds);
            let so_far = worst.as_ref().map_or(most, |worst| worst.2.abs());
            if value.is_finite() && value.abs() > so_far {
                worst = Some((stretch, ds, value));
            }
        }
    }
    worst
}
