//! Things that are valid from a start up to the next one's start.

use crate::station::Station;

/// Something with a start; NaN when that is missing.
pub(crate) trait Starts {
    /// Where it starts.
    fn start(&self) -> f64;
}

/// Items in document order that are looked up in order of their starts.
#[derive(Debug, Clone)]
pub(crate) struct Steps<T> {
    items: Box<[T]>,
    /// Places in `items` in ascending order of start; empty when they are written so.
    order: Vec<u32>,
    /// Where the items start, but for rounding; empty when `order` is.
    starts: Vec<f64>,
    /// An item has no start: nobody can say where which item is valid.
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

/// How far before its forerunner, in metres, an item may start and still count as one that starts at the
/// same place: who rounds differently at two places means one, and of those the item listed later counts.
const ROUNDING: f64 = 1e-6;

/// Starts in ascending order, those as equal that are no farther than rounding before the one listed ahead.
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
        // Without spare room: a map of 100 MB has a million of them.
        Steps {
            items: items.into_boxed_slice(),
            order,
            starts,
            unplaced,
        }
    }

    /// All items in document order.
    #[inline]
    pub(crate) fn items(&self) -> &[T] {
        &self.items
    }

    /// All items in document order, to complete them; their starts must stay.
    pub(crate) fn items_mut(&mut self) -> &mut [T] {
        &mut self.items
    }

    /// How many items have a rank: all, or none when a start is missing.
    #[inline]
    pub(crate) fn ranks(&self) -> usize {
        if self.unplaced { 0 } else { self.items.len() }
    }

    /// The place in document order of the item with this rank.
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

    /// The item with this rank in ascending order of start; those with equal starts as written.
    #[inline]
    pub(crate) fn ranked(&self, rank: usize) -> Option<&T> {
        self.items.get(self.index(rank)?)
    }

    /// The items in ascending order of start; none when a start is missing.
    #[inline]
    pub(crate) fn in_order(&self) -> impl DoubleEndedIterator<Item = &T> {
        (0..self.ranks()).filter_map(|rank| self.ranked(rank))
    }

    /// The rank of the last item that has started; `None` before the first one, and when a start
    /// is missing.
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

    /// Whether nothing is said about the station: there are no items, or the first starts later.
    #[inline]
    pub(crate) fn silent_at(&self, station: Station) -> bool {
        !self.unplaced && station.x().is_finite() && self.rank_at(station).is_none()
    }
}
