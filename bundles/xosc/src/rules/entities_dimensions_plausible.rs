use crate::families::actions::stated;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[LENGTH, ACROSS],
    run,
    ..Rule::after(READABLE)
};

const LENGTH: Param = Param::number(
    "length",
    100.0,
    "m",
    "largest plausible length of a road vehicle or a pedestrian; a larger one is considered a mistake",
);
const ACROSS: Param = Param::number(
    "across",
    15.0,
    "m",
    "largest plausible width or height of a road vehicle or a pedestrian; a larger one is considered a mistake",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let (length, across) = (found.number(&LENGTH), found.number(&ACROSS));
    for size in scenario.elements_everywhere("Dimensions") {
        let object = size.ancestors().nth(1);
        let Some(object) = object.filter(|object| is_road_user(*object)) else {
            continue;
        };
        for (name, most) in [("length", length), ("width", across), ("height", across)] {
            too_large(object, size, name, most, found);
        }
    }
}

/// Checks whether an object moves on roads and has an ordinary size.
fn is_road_user(object: Element<'_, '_>) -> bool {
    match object.name() {
        "Pedestrian" => true,
        "Vehicle" => {
            let category = object.word("vehicleCategory");
            category.is_some_and(|category| !matches!(&*category, "train" | "tram"))
        }
        _ => false,
    }
}

fn too_large(
    object: Element<'_, '_>,
    element: Element<'_, '_>,
    attribute: &str,
    most: f64,
    found: &mut Sink<'_>,
) {
    let Some(value) = element.number(attribute).filter(|value| *value > most) else {
        return;
    };
    let text = format!(
        "the `{attribute}` of the `{}` `{}` is {} m, more than {most} m; lengths are in metres",
        object.name(),
        object.text("name").unwrap_or_default(),
        stated(element, attribute, value)
    );
    found.about(element, attribute, text);
}
