//! Elements that a simulator does not support. These rules run only on request.

use crate::prelude::*;

/// Elements that a simulator ignores or reads differently from the standard.
pub(crate) struct Gap {
    /// Name of the elements.
    pub(crate) element: &'static str,
    /// Filter for the elements with this name.
    pub(crate) is_meant: fn(Node<'_>) -> bool,
    /// Description of the elements and of the behaviour of the simulator.
    pub(crate) text: &'static str,
}

/// Reports the gaps in a map: the first place of each and the number of further places.
pub(crate) fn report(map: &RoadMap<'_>, gaps: &[Gap], found: &mut Sink<'_>) {
    let Some(root) = map.root() else { return };
    for gap in gaps {
        let named = root.descendants_named(gap.element);
        let mut meant = named.filter(|node| (gap.is_meant)(*node) && !is_user_data(*node));
        let Some(first) = meant.next() else { continue };
        found.issue(first, format!("{}{}", gap.text, further(meant.count())));
    }
}

/// Returns a text with the number of further places.
pub(crate) fn further(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => " (once more in this file)".to_owned(),
        more => format!(" ({more} more times in this file)"),
    }
}

/// Accepts every element with the name.
pub(crate) fn any(_: Node<'_>) -> bool {
    true
}

/// Accepts the first `border` of a lane without `width`, because `width` takes precedence.
pub(crate) fn lane_border(border: Node<'_>) -> bool {
    let lane = border.parent().filter(|lane| lane.is("lane"));
    lane.is_some_and(|lane| lane.child("width").is_none() && lane.child("border") == Some(border))
}
