//! Places of findings on the plan of the road network.

use qcbus_document::Document;
use qcbus_messages::ResultMessage;
use qcbus_opendrive::RoadMap;
use qcbus_plan::{Locator, Plan, Said};
use qcbus_reporter_sdk::{IssueLocation, Sources, road_network};

use crate::result_data::{MapData, PlaceData};
use crate::scene::Scene;

/// The plan of a result's road network and the facts about it.
pub(crate) struct Drawn {
    /// The plan in the form that the page embeds.
    pub(crate) plan: Vec<u8>,
    /// Facts about the road network.
    pub(crate) map: MapData,
}

/// Draws the road network of a result and sets the point of each place on it. `places` are the
/// places of the findings in their order. `scene` is the scenario of the result, if it has one.
pub(crate) fn draw(
    result: &ResultMessage,
    sources: &dyn Sources,
    scene: Option<&Scene>,
    shown: &dyn Fn(&str) -> String,
    places: &mut [(IssueLocation, &mut PlaceData)],
) -> Option<Drawn> {
    if let Some(scene) = scene {
        let (path, roads) = scene.map()?;
        return roads.with(|map| drawn(result, map, path, shown, places));
    }
    let mut found = None;
    road_network(result, sources, &mut |path, image| {
        let Ok(document) = Document::open(image) else {
            return;
        };
        found = drawn(result, &RoadMap::new(document), path, shown, places);
    });
    found
}

fn drawn(
    result: &ResultMessage,
    map: &RoadMap<'_>,
    path: &str,
    shown: &dyn Fn(&str) -> String,
    places: &mut [(IssueLocation, &mut PlaceData)],
) -> Option<Drawn> {
    if map.roads().is_empty() {
        return None;
    }
    let locator = Locator::new(map);
    for (place, data) in places.iter_mut() {
        // Places in other files are not related to elements of the map, but they may name a road.
        let of_map = place.path.as_deref().unwrap_or(&result.input) == path;
        let said = Said {
            xpath: place.xpath.as_deref().filter(|_| of_map),
            road: place.road.as_ref().map(|(id, s, t)| (id.as_str(), *s, *t)),
            position: place.inertial.map(|(x, y, _)| (x, y)),
        };
        data.put(locator.locate(&said));
    }
    let plan = Plan::of(map);
    Some(Drawn {
        map: MapData {
            path: shown(path),
            own: path == result.input,
            cuts: plan.cuts().to_vec(),
        },
        plan: plan.bytes(),
    })
}
