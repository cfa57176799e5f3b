//! Files whose verdict is known: the oracle.

use qcbus_messages::Verdict;

use super::dice::Dice;

/// What a file contains. The number makes the bytes of every file differ from all others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content {
    /// A short straight road: nothing wrong with it.
    Good(u64),
    /// A road network without a header.
    NoHeader(u64),
    /// A header that does not say which version it is.
    NoVersion(u64),
    /// Something else than a road network.
    WrongRoot(u64),
    /// The first bytes of something.
    Torn(Vec<u8>),
}

impl Content {
    /// One of them; every second one is good.
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

    /// What is left of it when writing stops in the middle.
    pub fn torn(&self, dice: &mut Dice) -> Content {
        let bytes = self.bytes();
        // Without its last tag, so that no part is a whole.
        let end = bytes
            .iter()
            .rposition(|byte| *byte == b'<')
            .unwrap_or(bytes.len());
        let text = &bytes[..end];
        let end = dice.below(u64::try_from(text.len()).unwrap().max(1));
        Content::Torn(text[..usize::try_from(end).unwrap()].to_vec())
    }

    /// The bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let text = match self {
            Content::Good(number) => road(HEADER, *number),
            Content::NoHeader(number) => road("", *number),
            Content::NoVersion(number) => road("<header name=\"nameless\"/>", *number),
            Content::WrongRoot(number) => format!("{XML}<Kitchen sink=\"{number}\"/>\n"),
            Content::Torn(bytes) => return bytes.clone(),
        };
        text.into_bytes()
    }

    /// What must be found.
    pub fn verdict(&self) -> Verdict {
        match self {
            Content::Good(_) => Verdict::Accepted,
            _ => Verdict::Rejected,
        }
    }

    /// The checker that must find it.
    pub fn checker(&self) -> Option<&'static str> {
        match self {
            Content::Good(_) => None,
            Content::NoHeader(_) => Some("check_asam_xodr_xml_fileheader_is_present"),
            Content::NoVersion(_) => Some("check_asam_xodr_xml_version_is_defined"),
            Content::WrongRoot(_) => Some("check_asam_xodr_xml_root_tag_is_opendrive"),
            Content::Torn(_) => Some("check_asam_xodr_xml_valid_xml_document"),
        }
    }
}

const XML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
const HEADER: &str = "<header revMajor=\"1\" revMinor=\"8\"/>";

fn road(header: &str, number: u64) -> String {
    format!(
        "{XML}<OpenDRIVE>\n{header}\n<road id=\"1\" name=\"n{number}\" length=\"100\" junction=\"-1\">\n\
         <planView><geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"100\"><line/></geometry></planView>\n\
         <lanes><laneSection s=\"0\">\n\
         <center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\n\
         <right><lane id=\"-1\" type=\"driving\" level=\"false\">\
         <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right>\n\
         </laneSection></lanes>\n</road>\n</OpenDRIVE>\n"
    )
}
