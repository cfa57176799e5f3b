use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[WHEELBASE, WHEEL],
    run,
    ..Rule::after(READABLE)
};

const WHEELBASE: Param = Param::number(
    "wheelbase",
    0.3,
    "m",
    "smallest plausible distance of the front axle of a car, van, truck or bus in front of the rear axle",
);
const WHEEL: Param = Param::number(
    "wheel",
    3.0,
    "m",
    "largest plausible diameter of a wheel; a larger one is considered a mistake",
);

/// Vehicles with separate front and rear axles.
const TWO_AXLED: [&str; 4] = ["car", "van", "truck", "bus"];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let (least, most) = (found.number(&WHEELBASE), found.number(&WHEEL));
    for vehicle in scenario.elements_everywhere("Vehicle") {
        let Some(axles) = vehicle.child("Axles") else {
            continue;
        };
        let category = vehicle.word("vehicleCategory");
        if category.is_some_and(|category| TWO_AXLED.contains(&&*category)) {
            wheelbase(axles, least, found);
        }
        for axle in axles.children() {
            let Some(diameter) = axle.number("wheelDiameter").filter(|one| *one > most) else {
                continue;
            };
            let text = format!(
                "the wheels have a diameter of {diameter} m; no wheel of a road vehicle has more than {most} m"
            );
            found.about(axle, "wheelDiameter", text);
        }
    }
}

fn wheelbase(axles: Element<'_, '_>, least: f64, found: &mut Sink<'_>) {
    let (Some(front), Some(rear)) = (axles.child("FrontAxle"), axles.child("RearAxle")) else {
        return;
    };
    let (Some(x), Some(rear_x)) = (front.number("positionX"), rear.number("positionX")) else {
        return;
    };
    // The rule about ranges reports a front axle at a negative x.
    if x - rear_x >= least || x < 0.0 {
        return;
    }
    let text = if x <= rear_x {
        format!("the front axle at x = {x} m is not in front of the rear axle at x = {rear_x} m")
    } else {
        format!(
            "the front axle is only {:.2} m in front of the rear axle; steering models divide by this distance",
            x - rear_x
        )
    };
    found
        .about(front, "positionX", text)
        .at(rear.node(), "the rear axle");
}
