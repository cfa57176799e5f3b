use std::collections::HashMap;

use crate::assembly::{Assembly, Modular};
use crate::families::copies::{Taken, WrittenAt, WrittenIn, parameter_of, short_name};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_openscenario::expr;
use qcbus_openscenario::{Scenario, bare};

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let Some(scenario) = assembly.declaring() else {
        return;
    };
    let origins = WrittenIn::of(assembly);
    let mut finds = Finds::default();
    // Each parameter is reported once, even if many values need it.
    let mut first: HashMap<(usize, &str), (Spot<'_>, String)> = HashMap::new();
    for taken in assembly.taken() {
        for (attribute, value) in taken.values().filter(|(_, value)| value.contains('$')) {
            if is_name(attribute) {
                continue;
            }
            let missing = names(value);
            let missing = missing
                .into_iter()
                .filter(|name| !is_declared(name, attribute, &taken, &scenario));
            for name in missing {
                if let Some(origin) = origins.of_attribute(&taken, attribute) {
                    let text = given(origin, name, attribute, &scenario);
                    finds.value(origin, attribute, text);
                    continue;
                }
                let piece = taken.copy.piece;
                // Names in the document live longer than names in the copy.
                let own = names(attribute.value())
                    .into_iter()
                    .find(|own| *own == name);
                let Some(own) = own else { continue };
                let (target, text) = first
                    .entry((piece, own))
                    .or_insert_with(|| (attribute.into(), brought(&taken, attribute, own)))
                    .clone();
                finds.brought(
                    taken.at(),
                    target,
                    "the value that needs the parameter",
                    text,
                );
            }
        }
    }
    finds.say(found);
}

/// Returns the parameters that a value needs. Another rule reports parameters within longer texts,
/// which are not replaced.
fn names(value: &str) -> Vec<&str> {
    match value.trim_start().starts_with("${") {
        true => expr::names(value)
            .into_iter()
            .map(|(name, _)| name)
            .collect(),
        false => parameter_of(value).into_iter().collect(),
    }
}

/// Checks whether the attribute is a declared or assigned name, even with the `$` of old files.
fn is_name(attribute: Attribute<'_>) -> bool {
    let declares = matches!(
        attribute.node().name(),
        "ParameterDeclaration" | "VariableDeclaration" | "MonitorDeclaration"
    );
    (attribute.is("name") && declares) || attribute.is("parameterRef")
}

/// Checks whether a parameter is declared in the group around the value or around the group.
fn is_declared<'d>(
    name: &str,
    attribute: Attribute<'d>,
    taken: &Taken<'_, 'd>,
    scenario: &Scenario<'d>,
) -> bool {
    let node = attribute.node();
    let around = std::iter::once(node).chain(node.ancestors());
    let group = taken.copy.group;
    let within = around.take_while(|node| group.parent() != Some(*node));
    within
        .into_iter()
        .any(|holder| declaration(holder, name).is_some())
        || scenario
            .element(taken.reference.group)
            .parameter(name)
            .is_some()
}

/// Returns the declaration of a parameter in an element.
fn declaration<'d>(holder: Node<'d>, name: &str) -> Option<Node<'d>> {
    let block = holder.child("ParameterDeclarations")?;
    let mut all = block.children_named("ParameterDeclaration");
    all.find(|one| bare(one.attr("name").unwrap_or("")) == name)
}

fn brought(taken: &Taken<'_, '_>, attribute: Attribute<'_>, name: &str) -> String {
    let group = taken.copy.group;
    let declared = group
        .ancestors()
        .find_map(|holder| declaration(holder, name));
    let file = short_name(group.document());
    let start = format!(
        "the group `{}` needs the parameter `{name}` (`{}` of `{}`), which this scenario does not declare",
        taken.own_name(),
        attribute.name(),
        attribute.node().name()
    );
    match declared {
        Some(declared) => format!(
            "{start}; the declaration in `{file}` ({} `{}`) is not taken over: declare `{name}` here, or do not \
             use it there",
            declared.attr("parameterType").unwrap_or("untyped"),
            declared.attr("value").unwrap_or("")
        ),
        None => format!(
            "{start}, and neither does `{file}`: declare `{name}` here, or do not use it there"
        ),
    }
}

fn given(
    origin: WrittenAt<'_>,
    name: &str,
    target: Attribute<'_>,
    scenario: &Scenario<'_>,
) -> String {
    let who = match origin {
        WrittenAt::Key(key, _) => format!("the value of the key `{key}`"),
        WrittenAt::Actor(_) => "the actor".to_owned(),
    };
    let names = scenario.root().parameter_names().take(500);
    let near = closest(name, names).map_or_else(String::new, |near| format!("; `${near}` is"));
    format!(
        "{who} needs the parameter `{name}`, which is not declared at `{}` of `{}`{near}",
        target.name(),
        target.node().name()
    )
}
