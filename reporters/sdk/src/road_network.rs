//! The road network of a result.

use qcbus_document::{Document, FileKind};
use qcbus_ingest::modular::SearchPath;
use qcbus_ingest::references;
use qcbus_messages::path_text::{from_text, to_text};
use qcbus_messages::{DocumentRole, ResultMessage};

use crate::Sources;

/// Calls `look` with the path and the image of a result's road network: the checked file itself, or
/// the map of a scenario. It does not call `look` if there is no map or if the checked bytes are no
/// longer available.
pub fn road_network(
    result: &ResultMessage,
    sources: &dyn Sources,
    look: &mut dyn FnMut(&str, &[u8]),
) {
    let kind = FileKind::of_path(&from_text(&result.input));
    if kind == Some(FileKind::Xodr) {
        sources.image(&result.input, &mut |image| look(&result.input, image));
        return;
    }
    let mut maps = Vec::new();
    sources.image(&result.input, &mut |image| maps = maps_of(image));
    for map in maps {
        let mut found = false;
        sources.image(&map, &mut |image| {
            found = true;
            look(&map, image);
        });
        if found {
            return;
        }
    }
}

/// Returns the possible paths of a scenario's map, the most likely first.
fn maps_of(scenario: &[u8]) -> Vec<String> {
    let Ok(document) = Document::open(scenario) else {
        return Vec::new();
    };
    // Maps are never searched along the search path of scenarios.
    let found = references(&document, &SearchPath::default());
    let maps = found.into_iter().filter(|it| it.role == DocumentRole::Map);
    let candidates = maps.flat_map(|reference| reference.candidates);
    candidates.map(|path| to_text(&path)).collect()
}
