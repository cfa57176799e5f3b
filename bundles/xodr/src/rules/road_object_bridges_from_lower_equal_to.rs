use crate::families::lane_ranges;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "no known reader uses the validity of a bridge",
    )),
    versions: "1.7.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    lane_ranges::lower_comes_first(map, &["bridge", "signal", "sign", "displayArea"], found);
}
