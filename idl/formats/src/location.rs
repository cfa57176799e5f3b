//! Locations in other files than the checked one: an include, a catalog, a map, a library scenario.
//!
//! In qcbus such a location is [`Locations::elsewhere`]. A result file has no element for it. Its
//! `Locations` description starts with the place instead, `PATH:ROW:COLUMN: text`. A
//! `DomainSpecificInfo` named [`NAME`] also contains it. The `FileLocation` is the reference in the
//! checked file. The reader converts both back.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::xqar::{DomainInfo, InfoElement, Issue, Locations};

/// Name of the `DomainSpecificInfo`.
pub const NAME: &str = "qcbus.location";

/// A place in another file.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OtherPlace {
    /// Path of the file.
    pub path: String,
    /// Line, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// The element or attribute at that place, if there is one.
    pub xpath: Option<String>,
}

impl OtherPlace {
    /// Returns the description of a `Locations`: the place, then the explanation.
    pub fn describe(&self, text: &str) -> String {
        let OtherPlace {
            path, row, column, ..
        } = self;
        if text.is_empty() {
            format!("{path}:{row}:{column}")
        } else {
            format!("{path}:{row}:{column}: {text}")
        }
    }

    /// Returns the text after this place at the start of a description, or `None` without it.
    fn behind<'t>(&self, description: &'t str) -> Option<&'t str> {
        let rest = description.strip_prefix(&self.describe(""))?;
        if rest.is_empty() {
            Some(rest)
        } else {
            rest.strip_prefix(": ")
        }
    }

    /// Converts the place to its form in a result file.
    pub fn to_info(&self) -> DomainInfo {
        let mut attributes = vec![
            (String::from("path"), self.path.clone()),
            (String::from("row"), self.row.to_string()),
            (String::from("column"), self.column.to_string()),
        ];
        attributes.extend(
            self.xpath
                .iter()
                .map(|xpath| (String::from("xpath"), xpath.clone())),
        );
        let element = InfoElement {
            name: String::from("Location"),
            attributes,
            ..InfoElement::default()
        };
        DomainInfo {
            name: NAME.to_owned(),
            content: vec![element],
        }
    }

    /// Returns the place in a `DomainSpecificInfo`, if it contains exactly one place.
    pub fn from_info(info: &DomainInfo) -> Option<OtherPlace> {
        let place = from_element(info.content.first()?)?;
        (place.to_info() == *info).then_some(place)
    }
}

impl Locations {
    /// Returns the description for a result file. It includes the place when that is in another
    /// file.
    pub fn written(&self) -> Cow<'_, str> {
        match &self.elsewhere {
            Some(place) => Cow::Owned(place.describe(&self.description)),
            None => Cow::Borrowed(&self.description),
        }
    }
}

impl Issue {
    /// Returns the facts for a result file. The places in other files come first.
    pub fn written_info(&self) -> impl Iterator<Item = Cow<'_, DomainInfo>> {
        let places = self.locations.iter().filter_map(|it| it.elsewhere.as_ref());
        let places = places.map(|place| Cow::Owned(place.to_info()));
        places.chain(self.domain_info.iter().map(Cow::Borrowed))
    }
}

/// Converts a fact of a result file back to a place. Returns `false` when it is another fact, or no
/// description contains the place.
pub(crate) fn turn_back(info: &DomainInfo, locations: &mut [Locations]) -> bool {
    let Some(place) = OtherPlace::from_info(info) else {
        return false;
    };
    let here = locations.iter_mut().filter(|it| it.elsewhere.is_none());
    for locations in here {
        if let Some(text) = place.behind(&locations.description) {
            locations.description = text.to_owned();
            locations.elsewhere = Some(place);
            return true;
        }
    }
    false
}

fn from_element(element: &InfoElement) -> Option<OtherPlace> {
    let value = |name: &str| {
        element
            .attributes
            .iter()
            .find(|(key, _)| key == name)
            .map(|(_, value)| value.as_str())
    };
    Some(OtherPlace {
        path: value("path")?.to_owned(),
        row: value("row")?.parse().ok()?,
        column: value("column")?.parse().ok()?,
        xpath: value("xpath").map(str::to_owned),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> OtherPlace {
        OtherPlace {
            path: String::from("/maps/C:odd/town 1.xodr"),
            row: 12,
            column: 7,
            xpath: Some(String::from("/OpenDRIVE/road[@id='5']")),
        }
    }

    fn described(description: &str) -> Locations {
        Locations {
            description: description.to_owned(),
            ..Locations::default()
        }
    }

    #[test]
    fn written_location_is_parsed_back() {
        let told = Locations {
            elsewhere: Some(place()),
            ..described("road 5: no lanes at 3:4")
        };
        let written = "/maps/C:odd/town 1.xodr:12:7: road 5: no lanes at 3:4";
        assert_eq!(told.written(), written);
        let mut read = [described("here"), described(written)];
        assert!(turn_back(&place().to_info(), &mut read));
        assert_eq!(read, [described("here"), told]);
        let mut bare = [described(&place().describe(""))];
        assert!(turn_back(&place().to_info(), &mut bare));
        assert_eq!(bare[0].description, "");
    }

    #[test]
    fn other_descriptions_are_not_parsed_as_places() {
        let path = place().path;
        for text in [
            "",
            "the lane ends here",
            &format!("{path}:12:71: x"),
            &format!("{path}:12:7x"),
        ] {
            let mut read = [described(text)];
            assert!(!turn_back(&place().to_info(), &mut read), "{text}");
        }
    }

    #[test]
    fn domain_specific_info_reads_back() {
        assert_eq!(OtherPlace::from_info(&place().to_info()), Some(place()));
        let other = DomainInfo {
            name: String::from("else"),
            ..place().to_info()
        };
        assert_eq!(OtherPlace::from_info(&other), None);
    }
}
