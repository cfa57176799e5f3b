use crate::families::object_parts::{Stands, is_blank, named, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

/// Deprecated types, with the first version of the deprecation and the replacement.
const DEPRECATED: [(&str, Version, &str); 13] = [
    ("bike", Version::new(1, 5), ""),
    ("bus", Version::new(1, 5), ""),
    ("car", Version::new(1, 5), ""),
    ("motorbike", Version::new(1, 5), ""),
    ("pedestrian", Version::new(1, 5), ""),
    ("trailer", Version::new(1, 5), ""),
    ("train", Version::new(1, 5), ""),
    ("tram", Version::new(1, 5), ""),
    ("wind", Version::new(1, 5), "pole"),
    ("patch", Version::new(1, 8), "roadSurface"),
    ("railing", Version::new(1, 8), "barrier"),
    ("soundBarrier", Version::new(1, 8), "barrier"),
    ("streetLamp", Version::new(1, 8), "pole"),
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        let place = Place::attribute_or_node(object, "type");
        if is_blank(object, "type") {
            let text = format!("{} has no `type`, but must have one", named(object));
            found.issue(place, text).stands(map, object);
            continue;
        }
        let kind = object.attr("type").unwrap_or_default();
        let version = found.version();
        let known = DEPRECATED
            .iter()
            .find(|(name, since, _)| *name == kind && version.is_some_and(|v| v >= *since));
        if let Some((_, since, instead)) = known {
            let advice = match *instead {
                "" => "such things are not road objects".to_owned(),
                instead => format!("use `{instead}` instead"),
            };
            let text =
                format!("the object type `{kind}` has been deprecated since {since}; {advice}");
            found
                .issue(place, text)
                .level(Level::Information)
                .stands(map, object);
        }
    }
}
