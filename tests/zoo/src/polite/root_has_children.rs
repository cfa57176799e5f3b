use qcbus_document::Document;
use qcbus_formats::xqar::Level;
use qcbus_sdk::{Rule, Sink};

pub const RULE: Rule<Document> = Rule {
    level: Level::Warning,
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
