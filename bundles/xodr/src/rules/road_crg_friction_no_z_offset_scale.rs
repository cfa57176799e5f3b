use crate::families::crg::{self, purpose, records};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for record in records(map).filter(|record| purpose(*record) == "friction") {
        let attributes = [("zOffset", 0.0), ("zScale", 1.0)];
        crg::must_not_have(
            record,
            &attributes,
            "the purpose `friction`",
            None,
            Level::Warning,
            found,
        );
    }
}
