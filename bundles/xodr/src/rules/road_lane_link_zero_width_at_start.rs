use crate::families::zero_width::{self, ZERO_WIDTH};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[ZERO_WIDTH],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    zero_width::has_no_links(map, ContactPoint::Start, found);
}
