//! Search for the part of the model that reads an element.

use qcbus_document::Node;
use qcbus_opendrive::{Junction, LaneRef, Object, Road, SectionRef, Signal};

use super::Locator;

impl<'m, 'a> Locator<'m, 'a> {
    /// Returns the junction of this element.
    pub(super) fn junction_at(&self, node: Node<'a>) -> Option<&'m Junction<'a>> {
        let junctions = self.map.junctions();
        let found = junctions.binary_search_by(|junction| junction.node().cmp(&node));
        junctions.get(found.ok()?)
    }

    /// Returns the signal of this element and its index in the list of signals.
    pub(super) fn signal_at(&self, node: Node<'a>) -> Option<(usize, Signal<'a>)> {
        let all = self.signals.get_or_init(|| {
            let signals = self.map.signals();
            signals.map(|(_, signal)| signal.node()).collect()
        });
        let place = all.binary_search(&node).ok()?;
        Some((place, Signal::of(node)))
    }

    /// Returns the object of this element and its index in the list of objects.
    pub(super) fn object_at(&self, node: Node<'a>) -> Option<(usize, Object<'a>)> {
        let all = self.objects.get_or_init(|| {
            let objects = self.map.objects();
            objects.map(|(_, object)| object.node()).collect()
        });
        let place = all.binary_search(&node).ok()?;
        Some((place, Object::of(node)))
    }
}

/// Returns the lane section of this element and its index among the sections of the road.
pub(super) fn section_at<'m, 'a>(
    road: &'m Road<'a>,
    node: Node<'a>,
) -> Option<(usize, SectionRef<'m, 'a>)> {
    let mut before = 0;
    for layer in road.layers() {
        let get = |at| layer.section(road, at);
        let found = search(layer.section_count(), get, |section| section.node(), node);
        if let Some((at, section)) = found {
            return Some((before + at, section));
        }
        before += layer.section_count();
    }
    None
}

/// Returns the lane of this element.
pub(super) fn lane_at<'m, 'a>(
    section: SectionRef<'m, 'a>,
    node: Node<'a>,
) -> Option<LaneRef<'m, 'a>> {
    let count = section.lanes().size_hint().1?;
    let found = search(count, |at| section.lane_at(at), |lane| lane.node(), node);
    found.map(|(_, lane)| lane)
}

/// Finds the item of an element among items in document order.
fn search<'a, T: Copy>(
    count: usize,
    get: impl Fn(usize) -> Option<T>,
    node_of: impl Fn(T) -> Node<'a>,
    node: Node<'a>,
) -> Option<(usize, T)> {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low.midpoint(high);
        let item = get(middle)?;
        match node_of(item).cmp(&node) {
            std::cmp::Ordering::Less => low = middle + 1,
            std::cmp::Ordering::Greater => high = middle,
            std::cmp::Ordering::Equal => return Some((middle, item)),
        }
    }
    None
}
