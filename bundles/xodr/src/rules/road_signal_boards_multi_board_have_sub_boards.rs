use crate::families::boards::carriers;
use crate::families::object_parts::{Stands, named};
use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for carrier in carriers(map).filter(|carrier| carrier.is_called("multiBoard")) {
        let missing = match (carrier.fixed, carrier.variable) {
            (Some(_), Some(_)) => continue,
            (Some(_), None) => "no `vmsBoard`",
            (None, Some(_)) => "no `staticBoard`",
            (None, None) => "neither a `staticBoard` nor a `vmsBoard`",
        };
        let text = format!(
            "{} is a `multiBoard`, but has {missing}; it must have at least one of each",
            named(carrier.node)
        );
        found
            .issue(carrier.node, text)
            .stands(map, carrier.node)
            .fault(fault_of(carrier.node));
    }
}
