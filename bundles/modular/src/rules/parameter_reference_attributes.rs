use crate::assembly::{Assembly, Modular};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for document in assembly.scenarios() {
        let all = document.elements("ParameterReference");
        for node in all.filter(|node| is_of_reference(*node)) {
            missing(node, found);
            for attribute in node.attributes() {
                further(attribute, found);
            }
        }
    }
}

fn is_of_reference(node: Node<'_>) -> bool {
    let parent = node.parent();
    parent.is_some_and(|it| it.is("ManeuverGroupReference") || it.is("ScenarioReference"))
}

fn missing(node: Node<'_>, found: &mut Sink<'_>) {
    let text = match (node.attr("key"), node.attr("value")) {
        (Some(_), Some(_)) => return,
        (Some(key), None) => format!(
            "`ParameterReference` has no `value`, so the attribute that its key `{key}` matches keeps its value"
        ),
        (None, Some(value)) => {
            format!("`ParameterReference` has no `key`, so its value `{value}` is not used")
        }
        (None, None) => {
            "`ParameterReference` has neither `key` nor `value`, and has no effect".to_owned()
        }
    };
    found.issue(node, text);
}

fn further(attribute: Attribute<'_>, found: &mut Sink<'_>) {
    let name = attribute.name();
    if matches!(name, "key" | "value") || name.starts_with("xmlns") {
        return;
    }
    // The reference tool stores attributes in the order of their names.
    let effect = match name < "value" {
        true => {
            ": the reference tool takes the first two attributes in alphabetical order as key and value, and \
             loses the value"
        }
        false => " and is ignored",
    };
    let text = format!(
        "`ParameterReference` has only the attributes `key` and `value`, but `{name}` is neither{effect}"
    );
    found.issue(Place::Attribute(attribute), text);
}
