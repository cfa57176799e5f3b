//! Finding things by their ids, which are strings and not always unique.

use foldhash::{HashMap, HashMapExt as _};

/// Ids with their places; duplicates are kept in the order of their places.
#[derive(Debug, Default)]
pub(crate) struct IdIndex<'a> {
    /// In order of id, then of place.
    ids: Vec<(&'a str, u32)>,
    /// Where in `ids` those begin that are this id.
    first: HashMap<&'a str, u32>,
}

impl<'a> IdIndex<'a> {
    /// The index of these ids, whose places are counted from zero.
    pub(crate) fn new(ids: impl Iterator<Item = &'a str>) -> IdIndex<'a> {
        IdIndex::of(ids.zip(0..).collect())
    }

    /// The index of these pairs of id and place.
    pub(crate) fn of(mut ids: Vec<(&'a str, u32)>) -> IdIndex<'a> {
        ids.sort_unstable();
        let mut first = HashMap::with_capacity(ids.len());
        for ((id, _), at) in ids.iter().zip(0..) {
            first.entry(*id).or_insert(at);
        }
        IdIndex { ids, first }
    }

    /// The places of an id, ascending.
    pub(crate) fn places(&self, id: &str) -> impl Iterator<Item = usize> {
        let from = self.first.get(id).map(|from| *from as usize);
        let rest = from.and_then(|from| self.ids.get(from..)).unwrap_or(&[]);
        // Whoever asks for the first one only does not pay for a search of the others.
        let same = rest
            .iter()
            .enumerate()
            .take_while(move |(at, (other, _))| *at == 0 || *other == rest[0].0);
        same.map(|(_, (_, place))| *place as usize)
    }

    /// The ids that occur more than once, each with all its places, in order of id.
    pub(crate) fn duplicates(&self) -> impl Iterator<Item = &[(&'a str, u32)]> {
        self.ids
            .chunk_by(|(one, _), (next, _)| one == next)
            .filter(|same| same.len() > 1)
    }
}
