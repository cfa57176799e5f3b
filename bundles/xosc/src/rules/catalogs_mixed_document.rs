use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Elements that determine the form of a document.
const FORMS: &[(&[&str], &str)] = &[
    (&["Entities", "Storyboard"], "a scenario"),
    (&["Catalog"], "a catalog"),
    (&["ParameterValueDistribution"], "a distribution"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let root = scenario.root();
    let mut forms: Vec<_> = FORMS
        .iter()
        .filter_map(|(names, what)| {
            let first = root
                .children()
                .find(|child| names.contains(&child.name()))?;
            Some((first.node(), *what))
        })
        .collect();
    forms.sort_by_key(|(node, _)| node.offset());
    let mut forms = forms.into_iter();
    let Some((first, what)) = forms.next() else {
        return;
    };
    for (node, other) in forms {
        let text = format!(
            "`{}` makes the document {other}, but `{}` already makes it {what}; a document must be only one of \
             them",
            node.name(),
            first.name()
        );
        found
            .issue(node, text)
            .at(first, format!("the element that makes it {what}"));
    }
}
