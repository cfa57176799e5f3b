use crate::families::{catalogs, values};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _, HashSet};
use qcbus_openscenario::identifier;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Catalog {
        return without_value(scenario, found);
    }
    values::report(scenario, &[ValueFaultKind::Undeclared], found);
    let mut uses = HashMap::new();
    for (attribute, name) in scenario.parameter_uses() {
        let element = scenario.element(attribute.node());
        if let Some(declaration) = element.parameter(name) {
            uses.entry(declaration.node.index()).or_insert(attribute);
        }
    }
    for fault in values::faults(scenario, &[ValueFaultKind::Declared]) {
        if !values::is_empty_default(scenario, fault) {
            continue;
        }
        let declaration = fault.attribute.node();
        let text = format!(
            "the parameter `{}` has no default; `value` is empty, but must be a value of type `{}`",
            declaration.attr("name").unwrap_or(""),
            declaration.attr("parameterType").unwrap_or("")
        );
        let finding = found.issue(fault.attribute, text);
        if let Some(used) = uses.get(&declaration.index()) {
            finding.at(*used, "its first use");
        }
    }
}

/// Reports parameters of entries that have an empty default, are used, and are not assigned by a
/// reference.
fn without_value(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut said: HashSet<Node<'_>> = HashSet::default();
    for (reference, _) in catalogs::references(scenario) {
        let Some(entry) = scenario.entry(reference) else {
            continue;
        };
        for declaration in entry.declarations() {
            let default = declaration.node.attr("value");
            let is_empty = default.is_some_and(|value| value.trim().is_empty());
            let is_text = declaration
                .data_type
                .is_none_or(|data_type| data_type == DataType::String);
            let is_open = declaration.declared == Declared::Faulty && is_empty && !is_text;
            // An assigned value that does not fit is reported at the assignment.
            if !is_open || assigns(reference, declaration.name) || !said.insert(declaration.node) {
                continue;
            }
            let Some(used) = first_use(entry.node(), declaration.name) else {
                continue;
            };
            let text = format!(
                "the parameter `{}` of the catalog entry `{}` is used, but has no default and no assigned value; \
                 its value must be of type `{}`",
                declaration.name,
                reference.text("entryName").unwrap_or_default(),
                declaration.node.attr("parameterType").unwrap_or("")
            );
            found
                .about(reference, "", text)
                .at(declaration.node, "the declaration")
                .at(used, "its first use");
        }
    }
}

fn assigns(reference: Element<'_, '_>, name: &str) -> bool {
    let mut assignments = reference.assignments();
    assignments.any(|assignment| bare(assignment.written("parameterRef").unwrap_or("")) == name)
}

/// Returns the first attribute in an entry that contains a parameter.
fn first_use<'d>(entry: Node<'d>, name: &str) -> Option<Attribute<'d>> {
    let uses = |text: &str| text.split('$').skip(1).any(|rest| identifier(rest) == name);
    let all = std::iter::once(entry).chain(entry.descendants());
    let mut attributes = all.flat_map(|node| node.attributes());
    attributes.find(|attribute| uses(attribute.value()))
}
