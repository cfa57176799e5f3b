use crate::families::distributions::{self, SOURCES};
use crate::families::references::hint;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(target) = distributions::target(scenario, found.subject()) else {
        return;
    };
    for (element, attribute) in SOURCES {
        for source in scenario.elements(element) {
            let Some(name) = distributions::parameter_name(source, attribute) else {
                continue;
            };
            let place = Place::attribute_or_node(source.node(), attribute);
            if distributions::declaration(&target, name).is_some() {
                if source.written(attribute) != Some(name) {
                    let text = format!(
                        "the parameter `{name}` is named here and must not have a `$` before its name"
                    );
                    found.issue(place, text).level(Level::Warning);
                }
                continue;
            }
            let names = target.root().declarations().iter().map(|one| one.name);
            let further_in = target
                .elements("ParameterDeclaration")
                .find(|one| one.written("name").is_some_and(|own| bare(own) == name));
            let why = match further_in {
                Some(_) => {
                    "; a parameter that is declared further inside cannot be set from outside"
                        .to_owned()
                }
                None => hint(name, names),
            };
            let text = format!("the scenario itself declares no parameter `{name}`{why}");
            let finding = found.issue(place, text);
            match further_in {
                Some(one) => finding.at(one.node(), "the declaration further inside"),
                None => finding.at(target.root().node(), "the scenario"),
            };
        }
    }
}
