use qcbus_document::Document;
use qcbus_formats::xqar::Level;
use qcbus_sdk::{Rule, Sink};

pub static RULE: Rule<Document> = Rule {
    id: "check_polite_root_has_children",
    uids: &["example.org:xodr:1.0.0:polite.root_has_children"],
    level: Level::Warning,
    page: include_str!("root_has_children.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    if let Some(root) = document.root()
        && root.children().next().is_none()
    {
        found.issue(root, format!("the root element `{}` is empty", root.name()));
    }
}
