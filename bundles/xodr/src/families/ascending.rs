//! Records in ascending order of where they start.

use qcbus_document::Node;
use qcbus_opendrive::MapPart;
use qcbus_sdk::{Level, Param, Place, Sink};

use super::shown::{beside, number};

/// What still counts as the same place.
pub(crate) const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "starts that differ by no more than this count as equal",
);

/// A list of equally named records.
pub(crate) struct List<'m> {
    /// The attribute that says where a record starts.
    pub start: &'static str,
    /// The road.
    pub road: &'m str,
    /// What the starts are counted from, in metres along the road.
    pub from: Option<f64>,
    /// The UID of its findings, if it is not the rule's first.
    pub uid: Option<&'static str>,
}

/// What it means that a record starts where the one before it does: how severe that is, or
/// nothing to be said.
pub(crate) type Equal = fn(Node<'_>, Node<'_>) -> Option<Level>;

/// The earlier record never applies.
pub(crate) const VOID: Equal = |_, _| Some(Level::Warning);

/// Some readers take the earlier record for void, others for parallel.
pub(crate) const PARALLEL: Equal = |_, _| Some(Level::Information);

impl List<'_> {
    /// Reports records that start before the one listed ahead of them, and those that start at
    /// the same place. Records whose start cannot be read are passed over.
    pub fn check<'a>(
        &self,
        records: impl Iterator<Item = Node<'a>>,
        equal: Equal,
        found: &mut Sink<'_>,
    ) {
        let start = |node: &Node<'a>| node.f64(self.start).ok().filter(|start| start.is_finite());
        // Nothing to compare: so it is with nearly all lists.
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

    /// [`List::check`] of records with their starts.
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
            "this `{name}` has {by} = {}, but the one listed before it has {by} = {}; `{name}` elements must be listed in \
             ascending order of `{by}`",
            beside(start, ahead),
            number(ahead)
        );
        let finding = found.issue(Place::attribute_or_node(node, by), text);
        let finding = match self.from {
            Some(from) => finding.road(self.road, from + start, 0.0),
            None => finding,
        };
        let finding = finding.at(before, "the one listed before it");
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
            "this `{name}` has {by} = {} like the one listed before it, which therefore never \
             applies; each must start after the one before",
            number(start)
        );
        let finding = found
            .issue(Place::attribute_or_node(node, by), text)
            .level(level);
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

/// The list of a road's own records, which start at `@s`.
pub(crate) fn along_road(road: &str) -> List<'_> {
    List {
        start: "s",
        road,
        from: Some(0.0),
        uid: None,
    }
}

/// The children of this name of an element that may be missing.
pub(crate) fn children<'a>(
    parent: Option<Node<'a>>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a>> {
    parent
        .into_iter()
        .flat_map(move |parent| parent.children_named(name))
}

/// Checks the records of this name in every lane.
pub(crate) fn lane_records(
    part: MapPart<'_, '_>,
    element: &str,
    equal: Equal,
    found: &mut Sink<'_>,
) {
    lane_records_under(part, element, None, equal, found);
}

/// [`lane_records`], whose findings bear `uid` if it is given.
pub(crate) fn lane_records_under(
    part: MapPart<'_, '_>,
    element: &str,
    uid: Option<&'static str>,
    equal: Equal,
    found: &mut Sink<'_>,
) {
    // No lane has two of them if the whole file has not.
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
