//! Lookup by ids. Ids are strings and not always unique.

use foldhash::{HashMap, HashMapExt as _};

/// Ids with their places; duplicates are kept in the order of their places.
#[derive(Debug, Default)]
pub(crate) struct IdIndex<'a> {
    /// Sorted by id, then by place.
    ids: Vec<(&'a str, u32)>,
    /// Position in `ids` of the first entry of each id.
    first: HashMap<&'a str, u32>,
}

impl<'a> IdIndex<'a> {
    /// Builds the index of these ids. Their places are counted from zero.
    pub(crate) fn new(ids: impl Iterator<Item = &'a str>) -> IdIndex<'a> {
        IdIndex::of(ids.zip(0..).collect())
    }

    /// Builds the index of these pairs of id and place.
    pub(crate) fn of(mut ids: Vec<(&'a str, u32)>) -> IdIndex<'a> {
        ids.sort_unstable();
        let mut first = HashMap::with_capacity(ids.len());
        for ((id, _), at) in ids.iter().zip(0..) {
            first.entry(*id).or_insert(at);
        }
        IdIndex { ids, first }
    }

    /// Returns the places of an id in ascending order.
    pub(crate) fn places(&self, id: &str) -> impl Iterator<Item = usize> {
        let from = self.first.get(id).map(|from| *from as usize);
        let rest = from.and_then(|from| self.ids.get(from..)).unwrap_or(&[]);
        // The search for further entries is lazy, so a lookup of the first entry only stays cheap.
        let same = rest
            .iter()
            .enumerate()
            .take_while(move |(at, (other, _))| *at == 0 || *other == rest[0].0);
        same.map(|(_, (_, place))| *place as usize)
    }
}
