//! Items that are valid from their start to the start of the next item.

use crate::types::station::Station;

/// An item with a start. A missing start is NaN.
pub(crate) trait Starts {
    /// Returns the start of the item.
    fn start(&self) -> f64;
}

/// Items in document order with a lookup by start.
#[derive(Debug, Clone)]
pub(crate) struct Steps<T> {
    items: Box<[T]>,
    /// Places in `items` in ascending order of start. Empty if the items are already sorted.
    order: Vec<u32>,
    /// Starts of the items, corrected for rounding. Empty if `order` is empty.
    starts: Vec<f64>,
    /// Whether an item has no start, so that the valid items are unknown.
    unplaced: bool,
}

impl<T> Default for Steps<T> {
    fn default() -> Steps<T> {
        Steps {
            items: Box::default(),
            order: Vec::new(),
            starts: Vec::new(),
            unplaced: false,
        }
    }
}

/// Tolerance in metres for an item that starts before the item listed ahead. Both count as starting
/// at the same place, because of different rounding. The item listed later is valid.
const ROUNDING: f64 = 1e-6;

/// Returns the starts. A start slightly before the previous one becomes equal to that one.
fn rounded<T: Starts>(items: &[T]) -> Vec<f64> {
    let mut starts: Vec<f64> = items.iter().map(Starts::start).collect();
    let mut last = f64::NEG_INFINITY;
    for start in &mut starts {
        if *start < last && last - *start <= ROUNDING {
            *start = last;
        }
        last = *start;
    }
    starts
}

impl<T: Starts> Steps<T> {
    pub(crate) fn new(items: Vec<T>) -> Steps<T> {
        let unplaced = items.iter().any(|item| item.start().is_nan());
        let (mut order, mut starts) = (Vec::new(), Vec::new());
        if !unplaced && !items.is_sorted_by(|one, next| one.start() <= next.start()) {
            order.extend(0..u32::try_from(items.len()).unwrap_or(u32::MAX));
            starts = rounded(&items);
            let start = |at: &u32| starts[*at as usize];
            order.sort_by(|one, next| start(one).total_cmp(&start(next)));
        }
        // The boxed slice has no spare capacity, because a map of 100 MB has a million of them.
        Steps {
            items: items.into_boxed_slice(),
            order,
            starts,
            unplaced,
        }
    }

    /// Returns all items in document order.
    #[inline]
    pub(crate) fn items(&self) -> &[T] {
        &self.items
    }

    /// Returns all items in document order for completion. Their starts must not change.
    pub(crate) fn items_mut(&mut self) -> &mut [T] {
        &mut self.items
    }

    /// Returns the number of items with a rank: all, or none if a start is missing.
    #[inline]
    pub(crate) fn ranks(&self) -> usize {
        if self.unplaced { 0 } else { self.items.len() }
    }

    /// Returns the place in document order of the item with this rank.
    #[inline]
    pub(crate) fn index(&self, rank: usize) -> Option<usize> {
        if rank >= self.ranks() {
            None
        } else if self.order.is_empty() {
            Some(rank)
        } else {
            Some(*self.order.get(rank)? as usize)
        }
    }

    /// Returns the item with this rank in order of start. Equal starts keep their order.
    #[inline]
    pub(crate) fn ranked(&self, rank: usize) -> Option<&T> {
        self.items.get(self.index(rank)?)
    }

    /// Returns the items in ascending order of start. Returns none if a start is missing.
    #[inline]
    pub(crate) fn in_order(&self) -> impl DoubleEndedIterator<Item = &T> {
        (0..self.ranks()).filter_map(|rank| self.ranked(rank))
    }

    /// Returns the rank of the last item that has started. Returns `None` before the first item, or
    /// if a start is missing.
    #[inline]
    pub(crate) fn rank_at(&self, station: Station) -> Option<usize> {
        if self.unplaced || !station.x().is_finite() {
            return None;
        }
        let started = if self.order.is_empty() {
            self.items
                .partition_point(|item| station.is_after(item.start()))
        } else {
            let start = |at: &u32| self.starts[*at as usize];
            self.order.partition_point(|at| station.is_after(start(at)))
        };
        started.checked_sub(1)
    }

    /// Checks whether no item covers the station: there are none, or the first starts later.
    #[inline]
    pub(crate) fn silent_at(&self, station: Station) -> bool {
        !self.unplaced && station.x().is_finite() && self.rank_at(station).is_none()
    }
}
