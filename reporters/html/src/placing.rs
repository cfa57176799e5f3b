//! Places of findings on the plan of the road network.

use qcbus_document::Document;
use qcbus_messages::ResultMessage;
use qcbus_opendrive::RoadMap;
use qcbus_plan::{Locator, Plan, Said};
use qcbus_reporter_sdk::{IssueLocation, Sources, road_network};

use crate::result_data::{MapData, PlaceData};

/// The plan of a result's road network and the facts about it.
pub(crate) struct Drawn {
    /// The plan in the form that the page embeds.
    pub(crate) plan: Vec<u8>,
    /// Facts about the road network.
    pub(crate) map: MapData,
}

/// Draws the road network of a result and sets the point of each place on it. `places` are the
/// places of the findings in their order.
pub(crate) fn draw(
    result: &ResultMessage,
    sources: &dyn Sources,
    shown: &dyn Fn(&str) -> String,
    places: &mut [(IssueLocation, &mut PlaceData)],
) -> Option<Drawn> {
    let mut drawn = None;
    road_network(result, sources, &mut |path, image| {
        let Ok(document) = Document::open(image) else {
            return;
        };
        let map = RoadMap::new(document);
        if map.roads().is_empty() {
            return;
        }
        let locator = Locator::new(&map);
        for (place, data) in places.iter_mut() {
            // Places in other files are not related to elements of the map, but they may name a
            // road.
            let of_map = place.path.as_deref().unwrap_or(&result.input) == path;
            let said = Said {
                xpath: place.xpath.as_deref().filter(|_| of_map),
                road: place.road.as_ref().map(|(id, s, t)| (id.as_str(), *s, *t)),
                position: place.inertial.map(|(x, y, _)| (x, y)),
            };
            data.put(locator.locate(&said));
        }
        let plan = Plan::of(&map);
        drawn = Some(Drawn {
            map: MapData {
                path: shown(path),
                own: path == result.input,
                cuts: plan.cuts().to_vec(),
            },
            plan: plan.bytes(),
        });
    });
    drawn
}
