use crate::families::spawn;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.1,
    "m",
    "largest overlap of two bounding boxes that still counts as touching",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let bodies = spawn::bodies(scenario);
    for (one, other) in spawn::overlapping(&bodies, tolerance) {
        let text = format!(
            "`{}` starts within `{}`; their bounding boxes overlap, so the run starts with a collision",
            one.name, other.name
        );
        found.about(one.position, "", text).at(
            other.position.node(),
            format!("the start position of `{}`", other.name),
        );
    }
}
