use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::report_faults(document, found);
}
