use crate::families::object_parts::{Stands, has_outline};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(root) = map.root() else { return };
    for markings in root.document().elements("markings") {
        let Some(parent) = markings.parent().filter(|parent| !parent.is("object")) else {
            continue;
        };
        let foreign = markings.ancestors().any(|above| above.is("userData"));
        let object = markings.ancestors().find(|above| above.is("object"));
        let place = match object {
            _ if foreign => continue,
            Some(object) if has_outline(object) => continue,
            Some(object) => object,
            None if parent.is("objects") => parent,
            None => continue,
        };
        let text = format!(
            "the markings are defined in `{}`; without an outline, they must be defined in the `object`",
            parent.name()
        );
        found.issue(markings, text).stands(map, place);
    }
}
