//! Things that are valid from a start up to the next one's start.

/// Places that differ by less than this, in metres, are the same place: exporters write `1e-12`
/// for the start and `24.999999999999996` for 25.
const SAME_PLACE: f64 = 1e-9;

/// A place along s or t, approached from above (what starts there is already valid) or from
/// below (what starts there is not valid yet).
///
/// A plain number is the usual case: `profile.at(12.5)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    x: f64,
    below: bool,
}

impl Place {
    /// At `x`: what starts at `x` is valid.
    #[inline]
    pub fn at(x: f64) -> Place {
        Place { x, below: false }
    }

    /// Just before `x`: what ends at `x` is still valid.
    #[inline]
    pub fn before(x: f64) -> Place {
        Place { x, below: true }
    }

    /// The coordinate.
    #[inline]
    pub fn x(self) -> f64 {
        self.x
    }

    /// The same place seen from an origin that lies `by` further back.
    #[inline]
    pub fn shifted(self, by: f64) -> Place {
        Place {
            x: self.x + by,
            ..self
        }
    }

    /// Whether something that starts at `start` is valid here.
    #[inline]
    pub fn is_after(self, start: f64) -> bool {
        start <= self.horizon()
    }

    /// Up to which start something is valid here.
    #[inline]
    fn horizon(self) -> f64 {
        if self.below {
            self.x - SAME_PLACE
        } else {
            self.x + SAME_PLACE
        }
    }
}

impl From<f64> for Place {
    fn from(x: f64) -> Place {
        Place::at(x)
    }
}

/// Something with a start; NaN when that is missing.
pub(crate) trait Starts {
    /// Where it starts.
    fn start(&self) -> f64;
}

/// Items in document order that are looked up in order of their starts.
#[derive(Debug, Clone)]
pub(crate) struct Steps<T> {
    items: Vec<T>,
    /// Places in `items` in ascending order of start; empty when they are written so.
    order: Vec<u32>,
    /// An item has no start: nobody can say where which item is valid.
    unplaced: bool,
}

impl<T> Default for Steps<T> {
    fn default() -> Steps<T> {
        Steps {
            items: Vec::new(),
            order: Vec::new(),
            unplaced: false,
        }
    }
}

impl<T: Starts> Steps<T> {
    pub(crate) fn new(items: Vec<T>) -> Steps<T> {
        let unplaced = items.iter().any(|item| item.start().is_nan());
        let mut order = Vec::new();
        if !unplaced && !items.is_sorted_by(|one, next| one.start() <= next.start()) {
            order.extend(0..u32::try_from(items.len()).unwrap_or(u32::MAX));
            let start = |at: &u32| items[*at as usize].start();
            order.sort_by(|one, next| start(one).total_cmp(&start(next)));
        }
        Steps {
            items,
            order,
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
    pub(crate) fn rank_at(&self, place: Place) -> Option<usize> {
        if self.unplaced || !place.x.is_finite() {
            return None;
        }
        let started = if self.order.is_empty() {
            self.items
                .partition_point(|item| place.is_after(item.start()))
        } else {
            let start = |at: &u32| self.items[*at as usize].start();
            self.order.partition_point(|at| place.is_after(start(at)))
        };
        started.checked_sub(1)
    }

    /// Whether nothing is said about the place: there are no items, or the first starts later.
    #[inline]
    pub(crate) fn silent_at(&self, place: Place) -> bool {
        !self.unplaced && place.x.is_finite() && self.rank_at(place).is_none()
    }
}
