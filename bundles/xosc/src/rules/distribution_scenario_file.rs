use crate::families::catalogs;
use crate::prelude::*;
use qcbus_messages::DocumentRole;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let block = scenario.root().child("ParameterValueDistribution");
    let Some(file) = block.and_then(|block| block.child("ScenarioFile")) else {
        return;
    };
    let (subject, node) = (found.subject(), file.node());
    let Some(path) = file.text("filepath") else {
        return;
    };
    // The bus reports a missing file.
    if catalogs::missing(subject, node).is_some() {
        return;
    }
    let place = Place::attribute_or_node(node, "filepath");
    let mut linked = subject.with_role(DocumentRole::Scenario);
    let Some(linked) = linked.next() else {
        let own = subject.root();
        if name_of(own.path()) == name_of(&path) && own.path().contains('/') {
            let text = "the distribution refers to itself as the scenario whose parameters it sets";
            found.issue(place, text);
        }
        return;
    };
    let what = match (linked.document.root(), Form::of(&linked.document)) {
        (None, _) | (_, Form::Scenario) => return,
        (_, Form::Catalog) => "a catalog".to_owned(),
        (_, Form::Distribution) => "itself a distribution".to_owned(),
        (Some(root), Form::Unclear) => format!("a `{}` without a storyboard", root.name()),
    };
    let text = format!("`{path}` is {what}, but a distribution sets the parameters of a scenario");
    found.issue(place, text);
}

fn name_of(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}
