//! Reading of result files: the current form, the form of 2023, and Python's order of elements.

use super::{
    Checker, CheckerBundle, DomainInfo, InfoElement, Issue, Level, Location, Locations,
    MAX_INFO_DEPTH, Metadata, Param, Results, Status, numbers, road,
};
use crate::location::turn_back;
use crate::pool::is_rule_uid;
use crate::xml::{self, Document, Element, Node};

/// A result file that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{row}:{column}: {text}")]
pub struct ReadError {
    /// Line, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// Description of the error.
    pub text: String,
}

/// Reads a result file. Unknown elements and attributes are left out, missing texts are empty, and
/// a missing level is an error. An issue without a number gets its rank among all issues.
///
/// In the form of 2023, a rule UID in brackets at the end of an issue's description becomes its
/// rule. [`super::write`] writes it there.
///
/// # Errors
/// The file is not well-formed XML or not a result file, or a number, level or status is invalid.
pub fn read(bytes: &[u8]) -> Result<Results, ReadError> {
    let document = xml::parse(bytes).map_err(|error| ReadError {
        row: error.row,
        column: error.column,
        text: error.text,
    })?;
    Reader {
        document: &document,
        issues: 0,
    }
    .results(&document.root)
}

struct Reader<'d> {
    document: &'d Document,
    /// Number of issues read so far.
    issues: u64,
}

impl Reader<'_> {
    fn results(&mut self, root: &Element) -> Result<Results, ReadError> {
        if root.local_name() != "CheckerResults" {
            let text = format!(
                "the root element must be `CheckerResults`, found `{}`",
                root.name
            );
            return Err(self.error(root.offset, text));
        }
        let bundles = named(root, "CheckerBundle").map(|element| self.bundle(element));
        Ok(Results {
            version: text(root, "version"),
            bundles: bundles.collect::<Result<_, _>>()?,
        })
    }

    fn bundle(&mut self, element: &Element) -> Result<CheckerBundle, ReadError> {
        let checkers = named(element, "Checker").map(|checker| self.checker(checker));
        Ok(CheckerBundle {
            checkers: checkers.collect::<Result<_, _>>()?,
            name: text(element, "name"),
            version: text(element, "version"),
            build_date: text(element, "build_date"),
            description: text(element, "description"),
            summary: text(element, "summary"),
            params: params(element),
        })
    }

    fn checker(&mut self, element: &Element) -> Result<Checker, ReadError> {
        let issues = named(element, "Issue").map(|issue| self.issue(issue));
        Ok(Checker {
            issues: issues.collect::<Result<_, _>>()?,
            id: text(element, "checkerId").into(),
            description: text(element, "description").into(),
            summary: text(element, "summary").into(),
            status: self.status(element)?,
            params: params(element),
            addressed_rules: named(element, "AddressedRule")
                .map(|r| text(r, "ruleUID").into())
                .collect(),
            metadata: named(element, "Metadata").map(metadata).collect(),
        })
    }

    fn status(&self, element: &Element) -> Result<Option<Status>, ReadError> {
        let Some(attribute) = element.attribute("status") else {
            return Ok(None);
        };
        let known = [Status::Completed, Status::Skipped, Status::Error];
        match attribute.value.trim() {
            "" => Ok(None),
            word => match known.into_iter().find(|status| status.as_str() == word) {
                Some(status) => Ok(Some(status)),
                None => Err(self.error(attribute.offset, format!("`{word}` is not a status"))),
            },
        }
    }

    fn issue(&mut self, element: &Element) -> Result<Issue, ReadError> {
        let rank = self.issues;
        self.issues += 1;
        let (description, rule_uid) = match element.value("ruleUID") {
            Some(uid) => (text(element, "description"), uid.to_owned()),
            None => split_rule(text(element, "description")),
        };
        let mut locations = named(element, "Locations")
            .map(|element| self.locations(element))
            .collect::<Result<Vec<_>, _>>()?;
        let listed = locations.len();
        let mut domain_info = Vec::new();
        for child in named(element, "DomainSpecificInfo") {
            let info = self.domain_info(child)?;
            if !turn_back(&info, &mut locations) && !road::from_info(&info, listed, &mut locations)
            {
                domain_info.push(info);
            }
        }
        Ok(Issue {
            id: element
                .value("issueId")
                .and_then(|id| id.trim().parse().ok())
                .unwrap_or(rank),
            description,
            level: self.level(element)?,
            rule_uid,
            locations,
            domain_info,
        })
    }

    fn level(&self, element: &Element) -> Result<Level, ReadError> {
        let Some(attribute) = element.attribute("level") else {
            return Ok(Level::Error);
        };
        let number = attribute.value.trim().parse().ok();
        number.and_then(Level::from_number).ok_or_else(|| {
            self.error(
                attribute.offset,
                format!("`{}` is not a level from 1 to 3", attribute.value),
            )
        })
    }

    fn locations(&self, element: &Element) -> Result<Locations, ReadError> {
        let mut places = Vec::new();
        for child in element.children() {
            places.extend(self.location(child)?);
        }
        Ok(Locations {
            description: text(element, "description"),
            elsewhere: None,
            places,
        })
    }

    fn location(&self, element: &Element) -> Result<Option<Location>, ReadError> {
        Ok(Some(match element.local_name() {
            "FileLocation" => Location::File {
                row: self.whole(element, "row")?.unwrap_or(0),
                column: self.whole(element, "column")?.unwrap_or(0),
                offset: self.whole(element, "offset")?,
            },
            "XMLLocation" => Location::Xml {
                xpath: self.required(element, "xpath")?.to_owned(),
            },
            // The angles h, p, r of the form of 2023 are left out, because locations have no
            // direction.
            "InertialLocation" => Location::Inertial {
                x: self.number(element, "x")?,
                y: self.number(element, "y")?,
                z: self.number(element, "z")?,
            },
            "RoadLocation" => Location::Road {
                road_id: self.required(element, "roadId")?.to_owned(),
                s: self.number(element, "s")?,
                t: self.number(element, "t")?,
            },
            "TimeLocation" => Location::Time {
                time: self.number(element, "time")?,
            },
            "MessageLocation" => Location::Message {
                index: self.whole(element, "index")?.unwrap_or(0),
                channel: element.value("channel").map(str::to_owned),
                field: element.value("field").map(str::to_owned),
                time: match element.attribute("time") {
                    Some(_) => Some(self.number(element, "time")?),
                    None => None,
                },
            },
            _ => return Ok(None),
        }))
    }

    fn domain_info(&self, element: &Element) -> Result<DomainInfo, ReadError> {
        let content = element.children().map(|child| self.info_element(child, 1));
        Ok(DomainInfo {
            content: content.collect::<Result<_, _>>()?,
            name: text(element, "name"),
        })
    }

    fn info_element(&self, element: &Element, depth: usize) -> Result<InfoElement, ReadError> {
        if depth > MAX_INFO_DEPTH {
            let text = format!("domain specific elements are nested deeper than {MAX_INFO_DEPTH}");
            return Err(self.error(element.offset, text));
        }
        let children = element
            .children()
            .map(|child| self.info_element(child, depth + 1));
        let attributes = element.attributes.iter();
        Ok(InfoElement {
            children: children.collect::<Result<_, _>>()?,
            name: element.name.clone(),
            attributes: attributes
                .map(|a| (a.name.clone(), a.value.clone()))
                .collect(),
            text: direct_text(element),
        })
    }

    fn required<'e>(&self, element: &'e Element, name: &str) -> Result<&'e str, ReadError> {
        element.value(name).ok_or_else(|| {
            self.error(
                element.offset,
                format!("`{}` has no attribute `{name}`", element.name),
            )
        })
    }

    fn number(&self, element: &Element, name: &str) -> Result<f64, ReadError> {
        let value = self.required(element, name)?;
        numbers::read(value).ok_or_else(|| {
            let offset = element.attribute(name).map_or(element.offset, |a| a.offset);
            self.error(offset, format!("`{value}` is not a number"))
        })
    }

    fn whole(&self, element: &Element, name: &str) -> Result<Option<u64>, ReadError> {
        let Some(attribute) = element.attribute(name) else {
            return Ok(None);
        };
        match attribute.value.trim() {
            // The tools of 2023 leave attributes empty when the value is unknown.
            "" => Ok(None),
            value => value.parse().map(Some).map_err(|_| {
                let text = format!("`{value}` is not an integer of at least 0");
                self.error(attribute.offset, text)
            }),
        }
    }

    fn error(&self, offset: usize, text: String) -> ReadError {
        let (row, column) = self.document.place(offset);
        ReadError { row, column, text }
    }
}

fn named<'e>(element: &'e Element, name: &'static str) -> impl Iterator<Item = &'e Element> {
    element
        .children()
        .filter(move |child| child.local_name() == name)
}

fn text(element: &Element, name: &str) -> String {
    element.value(name).unwrap_or_default().to_owned()
}

fn params(element: &Element) -> Vec<Param> {
    named(element, "Param")
        .map(|p| Param {
            name: text(p, "name"),
            value: text(p, "value"),
        })
        .collect()
}

fn metadata(element: &Element) -> Metadata {
    Metadata {
        key: text(element, "key"),
        value: text(element, "value"),
        description: text(element, "description"),
    }
}

/// Returns an element's text in one piece. White space between child elements is ignored.
fn direct_text(element: &Element) -> String {
    let texts = element.content.iter().filter_map(|node| match node {
        Node::Text(text) => Some(text.as_str()),
        Node::Element(_) => None,
    });
    if element.children().next().is_none() {
        return texts.collect();
    }
    texts.filter(|text| !text.trim().is_empty()).collect()
}

/// Splits ` [rule UID]` off the end of a description.
fn split_rule(description: String) -> (String, String) {
    let found = description
        .strip_suffix(']')
        .and_then(|rest| rest.rsplit_once(" ["))
        .filter(|(_, uid)| is_rule_uid(uid))
        .map(|(text, uid)| (text.to_owned(), uid.to_owned()));
    found.unwrap_or((description, String::new()))
}
