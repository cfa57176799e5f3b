use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Attributes that must be integers: ids of lanes and roads, and numbers of lanes and executions.
const INTEGERS: &[(&str, &str)] = &[
    ("LanePosition", "laneId"),
    ("LanePosition", "roadId"),
    ("RoadPosition", "roadId"),
    ("AbsoluteTargetLane", "value"),
    ("RelativeTargetLane", "value"),
    ("RelativeLanePosition", "dLane"),
    ("Event", "maximumExecutionCount"),
    ("ManeuverGroup", "maximumExecutionCount"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (name, attribute) in INTEGERS {
        for element in scenario.elements_everywhere(name) {
            let Some(parameter) = element
                .written(attribute)
                .and_then(|it| it.trim().strip_prefix('$'))
            else {
                continue;
            };
            let Some((declaration, written, value)) = written_as_double(element, parameter) else {
                continue;
            };
            let text = format!(
                "`${parameter}` is replaced by `{written}`, which readers do not take for the integer `{value}`; \
                 declare `{parameter}` as `int` with the value `{value}`"
            );
            found
                .about(element, attribute, text)
                .at(declaration, "the declaration");
        }
    }
}

/// Returns the declaration of a `double`, its text and the integer that this means. Returns `None`
/// if the text itself is an integer.
fn written_as_double<'d>(
    element: Element<'_, 'd>,
    parameter: &str,
) -> Option<(Node<'d>, &'d str, i64)> {
    let declaration = element.parameter(parameter)?;
    let node = declaration.node;
    if declaration.data_type != Some(DataType::Double) || node.name() != "ParameterDeclaration" {
        return None;
    }
    let written = node.attr("value")?.trim();
    let Declared::Value(value) = &declaration.declared else {
        return None;
    };
    let value = value
        .number()
        .filter(|value| value.fract() == 0.0 && value.abs() < 1e9)?;
    (written.parse::<i64>().is_err() && !written.contains('$')).then_some((
        node,
        written,
        value as i64,
    ))
}
