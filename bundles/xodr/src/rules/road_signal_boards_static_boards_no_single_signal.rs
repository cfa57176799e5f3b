use crate::families::boards::carriers;
use crate::families::object_parts::Stands;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.8.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // Beside a display, a single sign is allowed.
    for carrier in carriers(map).filter(|carrier| carrier.variable.is_none()) {
        let boards: Vec<Node<'_>> = carrier.node.children_named("staticBoard").collect();
        let signs: usize = boards
            .iter()
            .map(|board| board.children_named("sign").count())
            .sum();
        let Some(first) = boards.first() else {
            continue;
        };
        let (level, text) = match signs {
            0 => (Level::Warning, "there is no `sign` on the static board"),
            1 => (
                Level::Error,
                "there is a single `sign` on the static board; it must be a separate `signal`, because boards \
                 are for several signs",
            ),
            _ => continue,
        };
        found
            .issue(*first, text)
            .level(level)
            .stands(map, carrier.node);
    }
}
