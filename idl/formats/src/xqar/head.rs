//! Reading of a result's input file without parsing the whole result.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::config::INPUT_PARAMS;

/// Returns the first checked file in a result: the parameter `InputFile` of a bundle. `head` is the
/// beginning of a result. Returns `None` if it is no result or lacks the parameter.
pub fn input_file(head: &[u8]) -> Option<String> {
    let mut reader = Reader::from_reader(head);
    let mut in_results = false;
    loop {
        let element = match reader.read_event().ok()? {
            Event::Start(element) | Event::Empty(element) => element,
            Event::Eof => return None,
            _ => continue,
        };
        let name = element.local_name();
        if !in_results && name.as_ref() != "CheckerResults" {
            return None;
        }
        in_results = true;
        let is_input = |it: &String| it == INPUT_PARAMS[0];
        if name.as_ref() == "Param" && attribute(&element, "name").as_ref().is_some_and(is_input) {
            return attribute(&element, "value").filter(|it| !it.is_empty());
        }
    }
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let attribute = element.try_get_attribute(name).ok()??;
    attribute
        .normalized_value(XmlVersion::Implicit1_0)
        .ok()
        .map(|it| it.into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xqar::{CheckerBundle, Dialect, Param, Results, write};

    #[test]
    fn checked_file_is_found_in_head_of_result() {
        let value = "/a <b> & \"c\".xodr".to_owned();
        let results = Results {
            version: "1.0.0".into(),
            bundles: vec![CheckerBundle {
                params: vec![Param {
                    name: "InputFile".into(),
                    value: value.clone(),
                }],
                ..CheckerBundle::default()
            }],
        };
        for dialect in [Dialect::Current, Dialect::Qc4Openx] {
            let text = write(&results, dialect);
            assert_eq!(input_file(text.as_bytes()), Some(value.clone()));
            let end = text.find("CheckerBundle").unwrap();
            assert_eq!(input_file(&text.as_bytes()[..end]), None);
        }
        assert_eq!(
            input_file(b"<Config><Param name=\"InputFile\" value=\"a\"/></Config>"),
            None
        );
        assert_eq!(input_file(b"no result"), None);
    }
}
