use crate::prelude::*;
use qcbus_document::FileKind;
use qcbus_messages::DocumentRole;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if found.subject().kind() == FileKind::Mosc {
        return;
    }
    if found.subject().is_expanded() {
        return must_be_expanded(found);
    }
    // The failed expansion is already reported.
    let missing = found.subject().missing();
    if missing.iter().any(|it| it.role == DocumentRole::Expanded) {
        return;
    }
    let references: Vec<_> = scenario.elements("ScenarioReference").collect();
    if let Some(first) = references.first() {
        let text = format!(
            "`ScenarioReference` belongs to modular scenarios, which must be expanded before a simulator can run \
             them; simulators do not know this element, so the {} without maneuvers",
            match references.len() {
                1 => "group is".to_owned(),
                many => format!("{many} groups like this one are"),
            }
        );
        found.issue(first.node(), text);
        return;
    }
    // Most files do not have the attribute at all, so the elements need not be visited.
    let mut names = scenario.document().names();
    if !names.any(|name| name == "parameterAttributes") {
        return;
    }
    let root = scenario.root();
    let offers = || {
        let all = std::iter::once(root).chain(root.descendants());
        all.filter_map(|element| element.attribute("parameterAttributes"))
    };
    if let Some(first) = offers().next() {
        let text = format!(
            "`parameterAttributes` belongs to modular scenarios and is not an attribute of the standard ({} in \
             this file); simulators that do not check the schema run the file as it is",
            offers().count()
        );
        found.issue(first, text).level(Level::Information);
    }
}

/// Reports that the expansion was checked and not the file itself.
fn must_be_expanded(found: &mut Sink<'_>) {
    let written = found.subject().written();
    let mut references = written.elements("ScenarioReference");
    if let Some(first) = references.next() {
        let text = "simulators do not know `ScenarioReference` and silently omit what it stands for; the checks \
                    used the plain scenario that `qcbus expand` creates from this file; run that scenario";
        found.issue(first, text).level(Level::Warning);
    }
}
