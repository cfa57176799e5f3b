use crate::families::corner_references::{Path, markings};
use crate::families::object_parts::Stands;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for marking in markings(map).filter(|marking| marking.outline.is_some()) {
        let Some(path) = marking.path() else { continue };
        let [(_, first), .., (last, end)] = path.steps.as_slice() else {
            continue;
        };
        let encloses = first == end;
        if encloses && path.is_closed() == Some(false) {
            let text = "the marking ends at the point where it starts, but its outline is not closed; only a \
                        closed outline can be enclosed";
            found
                .issue(*last, text)
                .stands(map, marking.object)
                .at(path.outline, "the open outline");
        }
        let names_all = path.points.len() > 2 && path.steps.len() == path.points.len();
        if !encloses && names_all && path.is_closed() == Some(true) && each_once(&path) {
            let text = "the marking refers to each point of its closed outline once and leaves the last side \
                        open; to enclose the outline, it must end with the `cornerReference` with which it \
                        starts";
            found
                .issue(marking.node, text)
                .level(Level::Information)
                .stands(map, marking.object);
        }
    }
}

fn each_once(path: &Path<'_>) -> bool {
    let mut seen: Vec<usize> = path.steps.iter().map(|(_, index)| *index).collect();
    seen.sort_unstable();
    seen.dedup();
    seen.len() == path.points.len()
}
