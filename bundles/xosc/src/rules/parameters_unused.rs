use crate::families::declared;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};
use qcbus_openscenario::identifier;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

/// Elements that refer to a parameter by its name.
const USES: &[&str] = &["ParameterAction", "ParameterCondition"];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() == Form::Scenario && !scenario.storyboard().is_complete() {
        // A file that could not be read may use it.
        return;
    }
    let used = used(scenario);
    let referred = declared::PARAMETERS.names(scenario, USES);
    let mut dangling = declared::PARAMETERS.dangling(scenario, USES);
    for fault in scenario.faults_of(&[ValueFaultKind::Undeclared]) {
        dangling.add(&fault.name);
    }
    for block in scenario.elements("ParameterDeclarations") {
        let Some(holder) = block.parent() else {
            continue;
        };
        let at_top = holder == scenario.root();
        for declaration in holder.declarations() {
            let known = used.contains(&declaration.node.index())
                || (at_top && referred.contains(declaration.name));
            if !known && !dangling.may_mean(declaration.name) {
                let text = format!(
                    "the parameter `{}` is declared but never used within `{}`",
                    declaration.name,
                    holder.name()
                );
                found.issue(declaration.node, text);
            }
        }
    }
}

/// Returns the declarations that a `$name` leads to, at any position of a value.
fn used(scenario: &Scenario<'_>) -> HashSet<u32> {
    let mut used = HashSet::new();
    for attribute in scenario.with_dollar() {
        let element = scenario.element(attribute.node());
        for behind in attribute.value().split('$').skip(1) {
            if let Some(declaration) = element.parameter(identifier(behind)) {
                used.insert(declaration.node.index());
            }
        }
    }
    used
}
