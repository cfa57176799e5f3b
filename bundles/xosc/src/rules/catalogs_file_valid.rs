use crate::prelude::*;
use qcbus_messages::DocumentRole;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(_: &Scenario<'_>, found: &mut Sink<'_>) {
    // The bus reports files that cannot be read at all.
    let subject = found.subject();
    for linked in subject.with_role(DocumentRole::Catalog) {
        let document = &linked.document;
        let Some((level, what)) = fault(document) else {
            continue;
        };
        let name = linked.path.rsplit('/').next().unwrap_or("");
        let text = format!("the file `{name}` is in a directory of catalogs, but {what}");
        found.issue((*document, 0), text).level(level);
    }
}

fn fault(document: &Document<'_>) -> Option<(Level, String)> {
    let root = document.root()?;
    if !root.name().eq_ignore_ascii_case("OpenSCENARIO") {
        let what = format!("its root element is `{}`, not `OpenSCENARIO`", root.name());
        return Some((Level::Warning, what));
    }
    match Form::of(document) {
        Form::Catalog => {
            let nameless = root.children_named("Catalog").any(|catalog| {
                catalog
                    .attr("name")
                    .is_none_or(|name| name.trim().is_empty())
            });
            nameless.then(|| {
                let what = "its `Catalog` has no name, so no scenario can refer to it";
                (Level::Warning, what.to_owned())
            })
        }
        // Scenarios in the directory of their catalogs are harmless.
        Form::Scenario => Some((Level::Information, "it is a scenario".to_owned())),
        Form::Distribution => {
            let what = "it is a distribution of parameter values";
            Some((Level::Information, what.to_owned()))
        }
        Form::Unclear => Some((Level::Warning, "it has no `Catalog`".to_owned())),
    }
}
