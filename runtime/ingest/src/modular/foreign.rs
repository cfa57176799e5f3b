//! Reports content of a reference that is not allowed there. Most cases are misspelt names.

use qcbus_document::Node;
use qcbus_formats::distance::did_you_mean;

use super::OFFERS;
use super::problem::{Problem, Problems, Spot, What};

/// Allowed content of the elements of a reference: name, attributes, children.
const KNOWN: [(&str, &[&str], &[&str]); 2] = [
    (
        "ScenarioReference",
        &["scenarioFileName"],
        &["ManeuverGroupReference", "ParameterReference"],
    ),
    (
        "ManeuverGroupReference",
        &["maneuverGroupName"],
        &["ParameterReference"],
    ),
];

/// Reports the parts of a reference that are never read. The intent of an unknown element is
/// unknown, so it prevents the expansion. In this case `true` is returned.
pub(super) fn say<'d>(reference: Node<'d>, problems: &mut Problems<'d>) -> bool {
    let before = problems.list.len();
    for element in std::iter::once(reference).chain(reference.descendants()) {
        let known = KNOWN.iter().find(|(name, ..)| element.is(name));
        let Some((_, attributes, children)) = known else {
            // The content of an unknown element is also unknown. A `ParameterReference` has its own
            // rule.
            if element.is("ParameterReference") {
                say_children(element, &[], problems);
            }
            continue;
        };
        say_children(element, children, problems);
        for attribute in element.attributes() {
            let name = attribute.name();
            let is_known =
                attributes.contains(&name) || name == OFFERS || name.starts_with("xmlns");
            if !is_known {
                let text = format!(
                    "`{}` must not have the attribute `{name}`; it is ignored{}",
                    element.name(),
                    did_you_mean(name, attributes.iter().copied())
                );
                push(
                    What::ForeignAttribute,
                    Spot::Attribute(attribute),
                    text,
                    problems,
                );
            }
        }
        if !element.text().trim().is_empty() {
            let text = format!("`{}` must not contain text; it is ignored", element.name());
            push(What::ForeignAttribute, Spot::Node(element), text, problems);
        }
    }
    let said = problems.list.get(before..).unwrap_or(&[]);
    said.iter().any(|it| it.what == What::ForeignElement)
}

fn say_children<'d>(element: Node<'d>, children: &[&str], problems: &mut Problems<'d>) {
    for child in element
        .children()
        .filter(|child| !children.contains(&child.name()))
    {
        let (own, name) = (element.name(), child.name());
        let text = match children {
            [] => format!("`{own}` must be empty; its element `{name}` is ignored"),
            _ => format!(
                "`{own}` must not contain `{name}`; its meaning is lost{}",
                did_you_mean(name, children.iter().copied())
            ),
        };
        push(What::ForeignElement, Spot::Node(child), text, problems);
    }
}

fn push<'d>(what: What, at: Spot<'d>, text: String, problems: &mut Problems<'d>) {
    problems.push(Problem {
        what,
        at,
        target: None,
        text,
    });
}
