//! A map that owns its image.

use std::fmt;

use qcbus_document::{Image, ImageError};
use self_cell::self_cell;

use crate::queries::map::RoadMap;

self_cell!(
    struct Cell {
        owner: Image,

        // The map is invariant in its lifetime, because its caches are behind locks.
        #[not_covariant]
        dependent: RoadMap,
    }
);

/// A [`RoadMap`] together with its image. It can be kept for any time, so its cached data about
/// roads is computed only once.
pub struct OwnedMap(Cell);

impl OwnedMap {
    /// Builds the map of an image.
    ///
    /// # Errors
    /// If the bytes are not a valid image.
    pub fn of(image: Image) -> Result<OwnedMap, ImageError> {
        Cell::try_new(image, |image| image.document().map(RoadMap::new)).map(OwnedMap)
    }

    /// Calls a function with the map. Borrowed data cannot leave the call.
    pub fn with<T>(&self, look: impl for<'a> FnOnce(&RoadMap<'a>) -> T) -> T {
        self.0.with_dependent(|_, map| look(map))
    }
}

impl fmt::Debug for OwnedMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let roads = self.with(|map| map.roads().len());
        f.debug_struct("OwnedMap").field("roads", &roads).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use qcbus_ingest::{Limits, prepare_bytes};

    use super::*;

    fn image(text: &str) -> Image {
        let prepared = prepare_bytes(
            Path::new("/a.xodr"),
            text.as_bytes().to_vec(),
            &Limits::default(),
        );
        Image::new(prepared.build())
    }

    #[test]
    fn map_outlives_its_creator_and_is_shared_between_threads() {
        let map = OwnedMap::of(image(
            "<OpenDRIVE><road id='1'/><road id='2'><signals><signal id='s'/></signals></road></OpenDRIVE>",
        ))
        .unwrap();
        let ask = || map.with(|map| (map.roads().len(), map.signals_with_id("s").count()));
        std::thread::scope(|scope| {
            let other = scope.spawn(ask);
            assert_eq!((ask(), other.join().unwrap()), ((2, 1), (2, 1)));
        });
        assert_eq!(format!("{map:?}"), "OwnedMap { roads: 2 }");
    }

    #[test]
    fn map_from_invalid_image_is_refused() {
        let map = OwnedMap::of(Image::new(*b"<OpenDRIVE/>"));
        assert!(map.is_err(), "{map:?}");
    }
}
