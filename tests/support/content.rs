//! Files with known verdicts: the oracle.

use qcbus_messages::Verdict;

use super::dice::Dice;

/// Content of a file. The number makes the bytes of every file unique.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content {
    /// A short straight road without faults.
    Good(u64),
    /// A road network without a header.
    NoHeader(u64),
    /// A road network whose header has no version.
    NoVersion(u64),
    /// A file that is not a road network.
    WrongRoot(u64),
    /// The first bytes of a file.
    Torn(Vec<u8>),
    /// A road with the word that `judges_strictly` rejects, without other faults.
    Marked(u64),
    /// A road, and another one included from a part.
    Including(u64, String),
    /// A road that other files include, with or without the word. It is not checked itself.
    Part(u64, Mark),
    /// A good map that the scenarios here cannot use, because its road has another id.
    Elsewhere(u64),
    /// A catalog, with or without the word.
    Catalog(u64, Mark),
    /// A good catalog that lacks the vehicle of the scenarios.
    OtherCatalog(u64),
    /// A scenario on a map. Its vehicles come from the catalogs in [`CATALOGS`].
    Scenario(u64, String),
}

/// Whether a file contains the word that `judges_strictly` rejects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Without the word.
    Clean,
    /// With the word.
    Marked,
}

/// Word that `judges_strictly` rejects.
const MARK: &str = "forbidden";
/// Directory of the catalogs with the vehicles of the scenarios.
pub const CATALOGS: &str = "catalogs";
/// Only file in that directory.
pub const CATALOG: &str = "catalogs/vehicles.xosc";

impl Content {
    /// Returns a map that depends on no other file. Every second one is good.
    pub fn any(dice: &mut Dice) -> Content {
        let number = dice.roll() >> 8;
        match dice.below(8) {
            0..4 => Content::Good(number),
            4 => Content::NoHeader(number),
            5 => Content::NoVersion(number),
            6 => Content::WrongRoot(number),
            _ => Content::Good(number).torn(dice),
        }
    }

    /// Returns the part that remains when writing stops in the middle.
    pub fn torn(&self, dice: &mut Dice) -> Content {
        let bytes = self.bytes();
        // The last tag is never included, so that no part is complete.
        let end = bytes
            .iter()
            .rposition(|byte| *byte == b'<')
            .unwrap_or(bytes.len());
        let text = &bytes[..end];
        let end = dice.below(u64::try_from(text.len()).unwrap().max(1));
        Content::Torn(text[..usize::try_from(end).unwrap()].to_vec())
    }

    /// Returns a road that includes its plan view from `view.xml`, and the content of that file.
    pub fn road_in_two_parts() -> (String, String) {
        let whole = String::from_utf8(Content::Good(1).bytes()).unwrap();
        let (begin, end) = (
            whole.find("<planView>").unwrap(),
            whole.find("<lanes>").unwrap(),
        );
        let (before, view, after) = (&whole[..begin], &whole[begin..end], &whole[end..]);
        (
            format!("{before}<include file=\"view.xml\"/>{after}"),
            format!("<road>{view}</road>"),
        )
    }

    /// Returns a map that lacks the colour of a road mark. Its schema demands the colour, and
    /// readers pass over it.
    pub fn colourless_road_mark() -> Vec<u8> {
        let whole = String::from_utf8(Content::Good(1).bytes()).unwrap();
        let mark = "<roadMark sOffset=\"0\" type=\"solid\"/></lane></right>";
        whole.replace("</lane></right>", mark).into_bytes()
    }

    /// Returns the bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let text = match self {
            Content::Good(number) => road(HEADER, &name(*number, Mark::Clean), ""),
            Content::NoHeader(number) => road("", &name(*number, Mark::Clean), ""),
            Content::NoVersion(number) => {
                let header = "<header name=\"nameless\"/>";
                road(header, &name(*number, Mark::Clean), "")
            }
            Content::WrongRoot(number) => format!("{XML}<Kitchen sink=\"{number}\"/>\n"),
            Content::Torn(bytes) => return bytes.clone(),
            Content::Marked(number) => road(HEADER, &name(*number, Mark::Marked), ""),
            Content::Including(number, part) => {
                let include = format!("<include file=\"{part}\"/>\n");
                road(HEADER, &name(*number, Mark::Clean), &include)
            }
            Content::Part(number, mark) => {
                let road = one_road(2, 200, &name(*number, *mark));
                format!("{XML}<OpenDRIVE>\n{road}</OpenDRIVE>\n")
            }
            Content::Elsewhere(number) => {
                let road = one_road(9, 0, &name(*number, Mark::Clean));
                format!("{XML}<OpenDRIVE>\n{HEADER}\n{road}</OpenDRIVE>\n")
            }
            Content::Catalog(number, mark) => CATALOG_TEXT.replace("NUMBER", &name(*number, *mark)),
            Content::OtherCatalog(number) => CATALOG_TEXT
                .replace("NUMBER", &number.to_string())
                .replace("delivery_van", "sold_van"),
            Content::Scenario(number, map) => SCENARIO_TEXT
                .replace("NUMBER", &number.to_string())
                .replace("MAP", map),
        };
        text.into_bytes()
    }

    /// Returns the expected verdict, independent of its parts.
    pub fn verdict(&self) -> Verdict {
        if self.checker().is_none() {
            Verdict::Accepted
        } else {
            Verdict::Rejected
        }
    }

    /// Returns the checker that must find the fault, or its suffix. Each standard has its own.
    pub fn checker(&self) -> Option<&'static str> {
        match self {
            Content::NoHeader(_) => Some("check_asam_xodr_xml_fileheader_is_present"),
            Content::NoVersion(_) => Some("check_asam_xodr_xml_version_is_defined"),
            Content::WrongRoot(_) => Some("check_asam_xodr_xml_root_tag_is_opendrive"),
            Content::Torn(_) => Some("xml_valid_xml_document"),
            Content::Good(_)
            | Content::Including(..)
            | Content::Scenario(..)
            | Content::Elsewhere(_)
            | Content::OtherCatalog(_) => None,
            Content::Marked(_) => Some(STRICT),
            Content::Part(_, mark) | Content::Catalog(_, mark) => match mark {
                Mark::Clean => None,
                Mark::Marked => Some(STRICT),
            },
        }
    }

    /// Returns the checker, or its suffix, that finds a fault in files that refer to this.
    pub fn spoils(&self) -> Option<&'static str> {
        match self {
            Content::Marked(_)
            | Content::Part(_, Mark::Marked)
            | Content::Catalog(_, Mark::Marked) => Some(STRICT),
            Content::Elsewhere(_) => Some("reference_control_road_lane_exists"),
            Content::OtherCatalog(_) => Some("reference_control_catalog_reference_resolvability"),
            _ => None,
        }
    }

    /// Returns the names of the files that the verdict depends on. These may depend on further
    /// files.
    pub fn parts(&self) -> Vec<String> {
        match self {
            Content::Including(_, part) => vec![part.clone()],
            Content::Scenario(_, map) => vec![map.clone(), CATALOG.to_owned()],
            _ => Vec::new(),
        }
    }

    /// Returns the names of the files that it rests on. Their verdicts are part of its own.
    pub fn rests_on(&self) -> Vec<String> {
        match self {
            Content::Scenario(..) => self.parts(),
            _ => Vec::new(),
        }
    }

    /// Returns the standard bundle that is required for a file of this name.
    pub fn bundle(name: &str) -> &'static str {
        if name.ends_with(".xosc") {
            "xoscBundle"
        } else {
            "xodrBundle"
        }
    }
}

/// Checker of `judges_strictly` that finds the word.
pub const STRICT: &str = "check_zoo_0";

const XML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
const HEADER: &str = "<header revMajor=\"1\" revMinor=\"8\"/>";
const CATALOG_TEXT: &str = include_str!("catalog.xml");
const SCENARIO_TEXT: &str = include_str!("scenario.xml");

/// Returns a unique name, with or without the word.
fn name(number: u64, mark: Mark) -> String {
    match mark {
        Mark::Clean => format!("n{number}"),
        Mark::Marked => format!("n{number} {MARK}"),
    }
}

fn road(header: &str, name: &str, more: &str) -> String {
    let road = one_road(1, 0, name);
    format!("{XML}<OpenDRIVE>\n{header}\n{road}{more}</OpenDRIVE>\n")
}

fn one_road(id: u64, x: u64, name: &str) -> String {
    format!(
        "<road id=\"{id}\" name=\"{name}\" length=\"100\" junction=\"-1\">\n\
         <planView><geometry s=\"0\" x=\"{x}\" y=\"0\" hdg=\"0\" length=\"100\"><line/></geometry></planView>\n\
         <lanes><laneSection s=\"0\">\n\
         <center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\n\
         <right><lane id=\"-1\" type=\"driving\" level=\"false\">\
         <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right>\n\
         </laneSection></lanes>\n</road>\n"
    )
}
