//! Places in other files than the checked one: an include, a catalog, a map, a library scenario.
//!
//! A result file speaks of one file only. So an issue about another one says the place at the
//! start of its `Locations` description, `PATH:ROW:COLUMN: text`, and carries it in a
//! `DomainSpecificInfo` named [`NAME`]; its `FileLocation` is the reference in the checked file.

use crate::xqar::{DomainInfo, InfoElement, Issue};

/// Name of the `DomainSpecificInfo`.
pub const NAME: &str = "qcbus.location";

/// A place in another file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OtherPlace {
    /// Path of the file.
    pub path: String,
    /// Line, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// The element or attribute there, if there is one.
    pub xpath: Option<String>,
}

impl OtherPlace {
    /// The description of a `Locations`: the place, then what is to be seen there.
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

    /// The place at the start of a `Locations` description, and the text behind it.
    pub fn from_description(description: &str) -> Option<(OtherPlace, &str)> {
        for (at, _) in description.match_indices(':') {
            let (path, rest) = (&description[..at], &description[at + 1..]);
            if let Some((row, column, text)) = numbers(rest).filter(|_| !path.is_empty()) {
                return Some((
                    OtherPlace {
                        path: path.to_owned(),
                        row,
                        column,
                        xpath: None,
                    },
                    text,
                ));
            }
        }
        None
    }

    /// The place for an issue's `domain_info`.
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

    /// The places that a `DomainSpecificInfo` holds; none when it is about something else.
    pub fn from_info(info: &DomainInfo) -> Vec<OtherPlace> {
        if info.name != NAME {
            return Vec::new();
        }
        info.content
            .iter()
            .filter(|e| e.name == "Location")
            .filter_map(from_element)
            .collect()
    }

    /// The places in other files that an issue carries, in order.
    pub fn of_issue(issue: &Issue) -> Vec<OtherPlace> {
        issue
            .domain_info
            .iter()
            .flat_map(OtherPlace::from_info)
            .collect()
    }
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

/// `ROW:COLUMN`, at the end or before `: ` and a text.
fn numbers(text: &str) -> Option<(u64, u64, &str)> {
    let (row, rest) = text.split_once(':')?;
    let end = rest
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(rest.len());
    let behind = &rest[end..];
    let text = if behind.is_empty() {
        behind
    } else {
        behind.strip_prefix(": ")?
    };
    Some((whole(row)?, whole(&rest[..end])?, text))
}

/// Digits only: `parse` would also take a sign.
fn whole(text: &str) -> Option<u64> {
    if text.bytes().all(|byte| byte.is_ascii_digit()) {
        text.parse().ok()
    } else {
        None
    }
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

    #[test]
    fn a_description_reads_back() {
        let description = place().describe("road 5: no lanes at 3:4");
        assert_eq!(
            description,
            "/maps/C:odd/town 1.xodr:12:7: road 5: no lanes at 3:4"
        );
        let (read, text) = OtherPlace::from_description(&description).unwrap();
        assert_eq!(
            (read.row, read.column, text),
            (12, 7, "road 5: no lanes at 3:4")
        );
        assert_eq!(read.path, place().path);
        let bare = place().describe("");
        assert_eq!(
            OtherPlace::from_description(&bare).map(|(_, text)| text),
            Some("")
        );
    }

    #[test]
    fn other_descriptions_are_no_places() {
        for text in [
            "",
            "the lane ends here",
            "a:b:c",
            ":1:2",
            "x:1:2x",
            "x:+1:2",
            "ratio 1:2",
        ] {
            assert_eq!(OtherPlace::from_description(text), None, "{text}");
        }
    }

    #[test]
    fn a_domain_specific_info_reads_back() {
        assert_eq!(OtherPlace::from_info(&place().to_info()), [place()]);
        let other = DomainInfo {
            name: String::from("else"),
            ..place().to_info()
        };
        assert_eq!(OtherPlace::from_info(&other), []);
    }
}
