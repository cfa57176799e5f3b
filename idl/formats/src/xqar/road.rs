//! Road positions in the current form, which has no element for them. They are stored in a
//! `DomainSpecificInfo` named `qcbus.road` with one `Road` for each.
//!
//! `locations` is the number of the issue's `Locations` that the position belongs to, from 1. A
//! place with only road positions has no `Locations` element, because readers refuse one without a
//! place they know. Its description is stored in the `Road` instead.

use super::numbers;
use super::{DomainInfo, InfoElement, Issue, Location, Locations};

/// Name of the `DomainSpecificInfo`.
pub(super) const NAME: &str = "qcbus.road";

/// Checks whether a place has at least one road position and nothing else.
pub(super) fn only_roads(place: &Locations) -> bool {
    !place.places.is_empty()
        && place
            .places
            .iter()
            .all(|p| matches!(p, Location::Road { .. }))
}

/// Returns the road positions of an issue, if it has any.
pub(super) fn to_info(issue: &Issue) -> Option<DomainInfo> {
    let mut content = Vec::new();
    let mut written = 0;
    for place in &issue.locations {
        let apart = only_roads(place);
        written += usize::from(!apart);
        let mut first = true;
        for location in &place.places {
            let Location::Road { road_id, s, t } = location else {
                continue;
            };
            let mut attributes = vec![
                (String::from("roadId"), road_id.clone()),
                (String::from("s"), numbers::write(*s)),
                (String::from("t"), numbers::write(*t)),
            ];
            if !apart {
                attributes.push((String::from("locations"), written.to_string()));
            } else if first {
                attributes.push((String::from("description"), place.written().into_owned()));
            }
            first = false;
            content.push(InfoElement {
                name: String::from("Road"),
                attributes,
                ..InfoElement::default()
            });
        }
    }
    (!content.is_empty()).then(|| DomainInfo {
        name: NAME.to_owned(),
        content,
    })
}

/// Adds the positions to their places; only the first `listed` places can be referenced. Returns
/// `false` and changes nothing if this is not the output of [`to_info`].
pub(super) fn from_info(info: &DomainInfo, listed: usize, places: &mut Vec<Locations>) -> bool {
    let Some(roads) = info
        .content
        .iter()
        .map(|road| parse(road, listed))
        .collect()
    else {
        return false;
    };
    let roads: Vec<(Location, Target)> = roads;
    if info.name != NAME || roads.is_empty() || matches!(roads[0].1, Target::SamePlace) {
        return false;
    }
    for (road, target) in roads {
        match target {
            Target::Listed(index) => places[index].places.push(road),
            Target::NewPlace(description) => {
                places.push(Locations {
                    description,
                    elsewhere: None,
                    places: vec![road],
                });
            }
            Target::SamePlace => {
                if let Some(place) = places.last_mut() {
                    place.places.push(road);
                }
            }
        }
    }
    true
}

/// Target place of a position.
enum Target {
    /// The `Locations` of this index.
    Listed(usize),
    /// A new place with this description.
    NewPlace(String),
    /// The new place of the previous position.
    SamePlace,
}

fn parse(road: &InfoElement, listed: usize) -> Option<(Location, Target)> {
    if road.name != "Road" || !road.children.is_empty() || !road.text.is_empty() {
        return None;
    }
    let value = |name: &str| {
        road.attributes
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, v)| v)
    };
    let location = Location::Road {
        road_id: value("roadId")?.clone(),
        s: numbers::read(value("s")?)?,
        t: numbers::read(value("t")?)?,
    };
    let target = match (value("locations"), value("description")) {
        (Some(number), None) => {
            let index = number.parse::<usize>().ok()?.checked_sub(1)?;
            (index < listed).then_some(Target::Listed(index))?
        }
        (None, Some(description)) => Target::NewPlace(description.clone()),
        (None, None) => Target::SamePlace,
        (Some(_), Some(_)) => return None,
    };
    Some((location, target))
}
