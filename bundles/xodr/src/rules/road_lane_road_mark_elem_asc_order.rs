use crate::families::ascending::{self, Equal};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[ascending::TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    ascending::lane_records(map.part(part), "roadMark", MARKS, found);
}

/// Severity of two lines at one place. Copies and contradicting types, such as solid and broken,
/// are a warning. Types may differ if the file defines the positions of the lines.
const MARKS: Equal = |before, mark| match contradict(before, mark) || is_copy(before, mark) {
    true => Some(Level::Warning),
    false => ascending::PARALLEL(before, mark),
};

/// Checks whether a line is an exact copy of the previous one, with all attributes.
fn is_copy(before: Node<'_>, mark: Node<'_>) -> bool {
    let plain = |mark: Node<'_>| mark.children().next().is_none();
    let said = |mark: Node<'_>| mark.attributes().count();
    let is_line = mark.attr("type").is_some_and(|kind| kind != "none");
    let mut attributes = mark.attributes();
    is_line
        && plain(before)
        && plain(mark)
        && said(before) == said(mark)
        && attributes.all(|one| before.attr(one.name()) == Some(one.value()))
}

fn contradict(before: Node<'_>, mark: Node<'_>) -> bool {
    let line = |mark: Node<'_>| {
        mark.attr("type")
            .filter(|kind| *kind != "none")
            .map(str::to_owned)
    };
    let is_drawn =
        |mark: Node<'_>| mark.child("type").is_some() || mark.child("explicit").is_some();
    let differ = line(before)
        .zip(line(mark))
        .is_some_and(|(one, other)| one != other);
    differ && !is_drawn(before) && !is_drawn(mark)
}
