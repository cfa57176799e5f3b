use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.0.0..1.1.0",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // If the schema allows no expression here, the rule about the schema reports it.
    if scenario
        .written_expressions()
        .any(|attribute| is_foreign(scenario, attribute))
    {
        return;
    }
    let mut expressions = scenario.written_expressions();
    let Some(first) = expressions.next() else {
        return;
    };
    let others = expressions.count();
    let rest = match others {
        0 => String::new(),
        1 => "; there is one more expression".to_owned(),
        _ => format!("; there are {others} more expressions"),
    };
    let text = format!(
        "{}: the file has version 1.0, which has no expressions; they were added in 1.1{rest}",
        values::written(first)
    );
    let finding = found.issue(first, text);
    if let Some(header) = scenario.root().child("FileHeader") {
        finding.at(
            Place::attribute_or_node(header.node(), "revMinor"),
            "the version",
        );
    }
}

/// Checks whether the schema requires a value that no expression can be.
fn is_foreign<'d>(scenario: &Scenario<'d>, attribute: Attribute<'d>) -> bool {
    let element = scenario.element(attribute.node());
    let value = element.value_type(attribute.name());
    let data_type = value.and_then(|value| DataType::of_schema(value.name()?));
    data_type.is_some_and(|data_type| data_type != DataType::String)
}
