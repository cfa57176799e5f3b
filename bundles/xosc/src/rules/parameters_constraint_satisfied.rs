use crate::families::constraints;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for block in scenario.elements("ParameterDeclarations") {
        let declarations = block.parent().map_or(&[][..], Element::declarations);
        for declaration in declarations {
            check(scenario.element(declaration.node), declaration, found);
        }
    }
}

fn check(node: Element<'_, '_>, declaration: &Declaration<'_>, found: &mut Sink<'_>) {
    let (Some(data_type), Declared::Value(value)) = (declaration.data_type, &declaration.declared)
    else {
        return;
    };
    let Some(operand) = constraints::Operand::new(value, data_type) else {
        return;
    };
    let groups = constraints::groups(node, data_type);
    let mut violated = Vec::new();
    for group in &groups {
        match group.violated(&operand) {
            Ok(Some(constraint)) => violated.push((group, constraint)),
            // One satisfied group is enough. An unknown group may be satisfied.
            Ok(None) | Err(()) => return,
        }
    }
    let Some((first, rest)) = violated.split_first() else {
        return;
    };
    if violated
        .iter()
        .all(|(group, _)| group.contradiction(data_type).is_some())
    {
        // Another rule reports that no value satisfies them.
        return;
    }
    let others: Vec<String> = rest.iter().map(|(_, one)| one.shown()).collect();
    let text = if others.is_empty() {
        format!("violates its constraint {}", first.1.shown())
    } else {
        format!(
            "satisfies none of its constraint groups, but must satisfy at least one; it violates {} and {}",
            first.1.shown(),
            others.join(" and ")
        )
    };
    let text = format!(
        "the value `{}` of the parameter `{}` {text}",
        value.text(),
        declaration.name
    );
    found
        .about(node, "value", text)
        .at(first.1.element.node(), "the constraint");
}
