//! Checks that records are in ascending order of their starts.

use super::shown::{beside, number};
use crate::prelude::*;
use qcbus_sdk::fault_of;

/// Maximum difference between two starts that count as equal.
pub(crate) const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "starts whose difference is at most this value count as equal",
);

/// A list of equally named records.
pub(crate) struct List<'m> {
    /// Name of the attribute that gives the start of a record.
    pub start: &'static str,
    /// Id of the road.
    pub road: &'m str,
    /// Origin of the starts, in metres along the road.
    pub from: Option<f64>,
    /// UID of the findings, unless it is the first UID of the rule.
    pub uid: Option<&'static str>,
}

/// Severity of a record that starts where the previous one starts. `None` means no finding.
pub(crate) type Equal = fn(Node<'_>, Node<'_>) -> Option<Level>;

/// Severity for records of which the earlier one never applies.
pub(crate) const VOID: Equal = |_, _| Some(Level::Warning);

/// Severity for records that some readers treat as overridden and others as parallel.
pub(crate) const PARALLEL: Equal = |_, _| Some(Level::Information);

impl List<'_> {
    /// Reports records that start before the previous record in the list or at the same place.
    /// Records without a readable start are skipped.
    pub fn check<'a>(
        &self,
        records: impl Iterator<Item = Node<'a>>,
        equal: Equal,
        found: &mut Sink<'_>,
    ) {
        let start = |node: &Node<'a>| node.f64(self.start).ok().filter(|start| start.is_finite());
        // Nearly all lists have at most one record, so there is nothing to compare.
        let mut records = records.peekable();
        let Some(first) = records.next() else { return };
        if records.peek().is_none() {
            return;
        }
        let records = std::iter::once(first).chain(records);
        self.check_starts(
            records.filter_map(|node| Some((node, start(&node)?))),
            equal,
            found,
        );
    }

    /// Does the work of [`List::check`] for records with their starts.
    fn check_starts<'a>(
        &self,
        records: impl Iterator<Item = (Node<'a>, f64)>,
        equal: Equal,
        found: &mut Sink<'_>,
    ) {
        let tolerance = found.number(&TOLERANCE);
        let mut last: Option<(Node<'a>, f64)> = None;
        for (node, start) in records {
            if let Some((before, ahead)) = last {
                if start < ahead - tolerance {
                    self.descends((node, start), (before, ahead), found);
                } else if start <= ahead + tolerance
                    && let Some(level) = equal(before, node)
                {
                    self.repeats((node, start), before, level, found);
                }
            }
            last = Some((node, start));
        }
    }

    fn descends(
        &self,
        (node, start): (Node<'_>, f64),
        (before, ahead): (Node<'_>, f64),
        found: &mut Sink<'_>,
    ) {
        let (name, by) = (node.name(), self.start);
        let text = format!(
            "this `{name}` has {by} = {}, but the previous one has {by} = {}; `{name}` elements must be listed \
             in ascending order of `{by}`",
            beside(start, ahead),
            number(ahead)
        );
        let finding = found
            .issue(Place::attribute_or_node(node, by), text)
            .fault(order_of(node));
        let finding = match self.from {
            Some(from) => finding.road(self.road, from + start, 0.0),
            None => finding,
        };
        let finding = finding.at(before, "the previous one");
        if let Some(uid) = self.uid {
            finding.uid(uid);
        }
    }

    fn repeats(
        &self,
        (node, start): (Node<'_>, f64),
        before: Node<'_>,
        level: Level,
        found: &mut Sink<'_>,
    ) {
        let (name, by) = (node.name(), self.start);
        let text = format!(
            "this `{name}` has {by} = {} like the previous one, which therefore never applies; each must start \
             after the previous one",
            number(start)
        );
        let finding = found
            .issue(Place::attribute_or_node(node, by), text)
            .level(level)
            .fault(order_of(node));
        let finding = match self.from {
            Some(from) => finding.road(self.road, from + start, 0.0),
            None => finding,
        };
        let finding = finding.at(before, "the one that never applies");
        if let Some(uid) = self.uid {
            finding.uid(uid);
        }
    }
}

/// Returns the name of the fault that the elements of one name in a parent are in a wrong order.
fn order_of(node: Node<'_>) -> String {
    let parent = node.parent().map(fault_of).unwrap_or_default();
    format!("order of {} in {parent}", node.name())
}

/// Returns the list of a road's own records, which start at `@s`.
pub(crate) fn along_road(road: &str) -> List<'_> {
    List {
        start: "s",
        road,
        from: Some(0.0),
        uid: None,
    }
}

/// Returns the children with this name of an element that may be missing.
pub(crate) fn children<'a>(
    parent: Option<Node<'a>>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a>> {
    parent
        .into_iter()
        .flat_map(move |parent| parent.children_named(name))
}

/// Checks the records with this name in every lane.
pub(crate) fn lane_records(
    part: MapPart<'_, '_>,
    element: &str,
    equal: Equal,
    found: &mut Sink<'_>,
) {
    lane_records_under(part, element, None, equal, found);
}

/// Works like [`lane_records`], but gives the findings the UID `uid` if there is one.
pub(crate) fn lane_records_under(
    part: MapPart<'_, '_>,
    element: &str,
    uid: Option<&'static str>,
    equal: Equal,
    found: &mut Sink<'_>,
) {
    // If the whole file has fewer than two of these elements, no lane has two.
    let several = |root: Node<'_>| root.document().elements(element).nth(1).is_some();
    if !part.map().root().is_some_and(several) {
        return;
    }
    for lane in part.lanes() {
        let list = List {
            start: "sOffset",
            road: lane.at.road.id(),
            from: lane.at.s(),
            uid,
        };
        list.check(lane.elements(element), equal, found);
    }
}
