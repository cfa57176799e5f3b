use qcbus_document::Document;
use qcbus_formats::xqar::Level;
use qcbus_sdk::{Rule, Sink};

pub const RULE: Rule<Document> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let nodes = document
        .root()
        .into_iter()
        .flat_map(|root| root.descendants());
    for attribute in nodes.flat_map(|node| node.attributes()) {
        let (name, value) = (attribute.name(), attribute.value());
        if !value.is_empty() && value.trim().is_empty() {
            found.issue(
                attribute,
                format!("`{name}` has nothing but blanks as its value"),
            );
        }
    }
}
