//! What a simulator does not have. Such rules run only where they are asked for.

use qcbus_document::Node;
use qcbus_opendrive::{RoadMap, is_user_data};
use qcbus_sdk::Sink;

/// Elements that a simulator reads otherwise than the standard, or not at all.
pub(crate) struct Gap {
    /// The name of the element.
    pub(crate) element: &'static str,
    /// Which of that name it is about.
    pub(crate) is_meant: fn(Node<'_>) -> bool,
    /// What they are, and what the simulator does with them.
    pub(crate) text: &'static str,
}

/// Says the gaps that a map runs into: the first place of each, and how many more there are.
pub(crate) fn report(map: &RoadMap<'_>, gaps: &[Gap], found: &mut Sink<'_>) {
    let Some(root) = map.root() else { return };
    for gap in gaps {
        let named = root.descendants_named(gap.element);
        let mut meant = named.filter(|node| (gap.is_meant)(*node) && !is_user_data(*node));
        let Some(first) = meant.next() else { continue };
        found.issue(first, format!("{}{}", gap.text, further(meant.count())));
    }
}

/// How many more there are.
pub(crate) fn further(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => " (once more in this file)".to_owned(),
        more => format!(" ({more} times more in this file)"),
    }
}

/// Every one of its name.
pub(crate) fn any(_: Node<'_>) -> bool {
    true
}

/// A `border` of a lane that has no `width`, which would win.
pub(crate) fn lane_border(border: Node<'_>) -> bool {
    let lane = border.parent().filter(|lane| lane.is("lane"));
    lane.is_some_and(|lane| lane.child("width").is_none() && lane.child("border") == Some(border))
}
