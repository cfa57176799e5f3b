//! Finding things by their ids, which are strings and not always unique.

/// Ids in order, each with its place; duplicates are kept in the order of their places.
#[derive(Debug, Default)]
pub(crate) struct IdIndex<'a> {
    ids: Vec<(&'a str, u32)>,
}

impl<'a> IdIndex<'a> {
    /// The index of these ids, whose places are counted from zero.
    pub(crate) fn new(ids: impl Iterator<Item = &'a str>) -> IdIndex<'a> {
        IdIndex::of(ids.zip(0..).collect())
    }

    /// The index of these pairs of id and place.
    pub(crate) fn of(mut ids: Vec<(&'a str, u32)>) -> IdIndex<'a> {
        ids.sort_unstable();
        IdIndex { ids }
    }

    /// The places of an id, ascending.
    pub(crate) fn places(&self, id: &str) -> impl Iterator<Item = usize> {
        let from = self.ids.partition_point(|(other, _)| *other < id);
        let rest = self.ids.get(from..).unwrap_or(&[]);
        let count = rest.partition_point(|(other, _)| *other == id);
        rest[..count].iter().map(|(_, place)| *place as usize)
    }

    /// The ids that occur more than once, each with all its places, in order of id.
    pub(crate) fn duplicates(&self) -> impl Iterator<Item = &[(&'a str, u32)]> {
        self.ids
            .chunk_by(|(one, _), (next, _)| one == next)
            .filter(|same| same.len() > 1)
    }
}
