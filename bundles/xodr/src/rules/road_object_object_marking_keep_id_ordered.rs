use crate::families::corner_references::{Path, markings};
use crate::families::object_parts::Stands;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for marking in markings(map) {
        let Some(path) = marking.path() else { continue };
        let may_wrap = path.is_closed() != Some(false);
        let Some(at) = out_of_order(&path, may_wrap) else {
            continue;
        };
        let (Some((before, _)), Some((reference, _))) =
            (path.steps.get(at - 1), path.steps.get(at))
        else {
            continue;
        };
        let id = |node: &Node<'_>| node.attr("id").unwrap_or_default().to_owned();
        let text = format!(
            "the marking refers to point `{}` after point `{}`; references must follow the order of the \
             outline's points",
            id(reference),
            id(before)
        );
        found
            .issue(*reference, text)
            .stands(map, marking.object)
            .at(*before, "the reference before it");
    }
}

/// Returns the first reference that steps back. On a closed outline one step back may cross the
/// closing side, if the marking does not pass its own start.
fn out_of_order(path: &Path<'_>, may_wrap: bool) -> Option<usize> {
    let start = path.steps.first()?.1;
    let mut wrapped = false;
    for (at, pair) in path.steps.windows(2).enumerate() {
        let (before, here) = (pair[0].1, pair[1].1);
        let wraps = here <= before;
        let closes = at + 2 == path.steps.len() && here == start;
        if wraps && (wrapped || !may_wrap) && !closes {
            return Some(at + 1);
        }
        wrapped |= wraps;
        if wrapped && here > start {
            return Some(at + 1);
        }
    }
    None
}
