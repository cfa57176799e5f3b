use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Attributes with the id of a lane or a road.
const IDS: &[(&str, &str)] = &[
    ("LanePosition", "laneId"),
    ("LanePosition", "roadId"),
    ("RoadPosition", "roadId"),
    ("AbsoluteTargetLane", "value"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (name, attribute) in IDS {
        for element in scenario.elements_everywhere(name) {
            let Some(parameter) = element
                .written(attribute)
                .and_then(|it| it.trim().strip_prefix('$'))
            else {
                continue;
            };
            let Some((declaration, written)) = with_fraction(element, parameter) else {
                continue;
            };
            let (id, _) = written.split_once('.').unwrap_or((written, ""));
            let text = format!(
                "`${parameter}` is replaced by `{written}`, but ids of lanes and roads are compared as texts, and \
                 none is written like this; declare `{parameter}` as `int` with the value `{id}`"
            );
            found
                .about(element, attribute, text)
                .at(declaration, "the declaration");
        }
    }
}

/// Returns the declaration and the written value of a `double` that is written with a fraction of 0.
fn with_fraction<'d>(element: Element<'_, 'd>, parameter: &str) -> Option<(Node<'d>, &'d str)> {
    let declaration = element.parameter(parameter)?;
    let node = declaration.node;
    if declaration.data_type != Some(DataType::Double) || node.name() != "ParameterDeclaration" {
        return None;
    }
    let written = node.attr("value")?.trim();
    let (whole, fraction) = written.split_once('.')?;
    let is_whole = whole.parse::<i64>().is_ok() && fraction.bytes().all(|digit| digit == b'0');
    is_whole.then_some((node, written))
}
