//! Basic requirements of both standards: four algorithms that the rules of each bundle use under
//! their own names.

use qcbus_document::{Document, FaultCode, Node};
use qcbus_formats::xqar::Level;

use crate::{Place, Sink, Version};

/// Reports the faults that ingest found in the file itself.
pub fn report_faults(document: &Document<'_>, found: &mut Sink<'_>) {
    for fault in document.faults() {
        found
            .issue((*document, fault.offset), fault.text)
            .level(fault_level(fault.code))
            .here(fault.code.as_str());
    }
}

/// Returns the level of a fault. A fault that makes the tree unreliable is an error. A wrong
/// encoding declaration is a warning, because readers that trust it see other characters. A correct
/// encoding other than UTF-8 is information.
fn fault_level(code: FaultCode) -> Level {
    match code {
        _ if code.makes_partial() => Level::Error,
        FaultCode::EncodingTranscoded => Level::Information,
        _ => Level::Warning,
    }
}

/// Checks that the root element has this name, whatever its namespace.
pub fn root_is(document: &Document<'_>, name: &str, found: &mut Sink<'_>) {
    match document.root() {
        Some(root) if root.is(name) => {}
        Some(root) => {
            let text = format!(
                "the root element is `{}`, but must be `{name}`",
                root.name()
            );
            found.issue(root, text).here("the root element");
        }
        None => {
            found.issue(
                (*document, 0),
                format!("there is no root element; it must be `{name}`"),
            );
        }
    }
}

/// Checks that the root has a child of this name.
pub fn has_header(document: &Document<'_>, header: &str, found: &mut Sink<'_>) {
    if let Some(root) = document.root()
        && root.child(header).is_none()
    {
        let text = format!(
            "the root element `{}` has no child `{header}`, but must have one",
            root.name()
        );
        found
            .issue(root, text)
            .here(&format!("no child `{header}`"));
    }
}

/// Checks that the header has `revMajor` and `revMinor`, each a whole number from 0 to 65535.
pub fn version_is_defined(document: &Document<'_>, header: &str, found: &mut Sink<'_>) {
    let Some(header) = document.root().and_then(|root| root.child(header)) else {
        return;
    };
    let name = header.name();
    let wrong = ["revMajor", "revMinor"].map(|attribute| match header.attr(attribute) {
        None => Some(format!("has no `{attribute}`")),
        Some(text) if revision(text).is_none() => Some(format!(
            "says `{attribute}=\"{text}\"`, which is not a whole number from 0 to 65535"
        )),
        Some(_) => None,
    });
    let wrong: Vec<String> = wrong.into_iter().flatten().collect();
    if !wrong.is_empty() {
        let text = format!(
            "the element `{name}` {}; both attributes must state the version of the standard",
            wrong.join(" and ")
        );
        found.issue(Place::Node(header), text);
    }
}

/// Returns the version in the header of this name, or `None` if it is missing.
pub fn version_of(document: &Document<'_>, header: &str) -> Option<Version> {
    let header: Node<'_> = document.root()?.child(header)?;
    Some(Version::new(
        revision(header.attr("revMajor")?)?,
        revision(header.attr("revMinor")?)?,
    ))
}

/// Parses a revision number as XML Schema's `unsignedShort`: `7`, `07`, `+7`, with white space
/// around it.
fn revision(text: &str) -> Option<u16> {
    let text = text.trim_matches([' ', '\t', '\r', '\n']);
    let digits = text.strip_prefix('+').unwrap_or(text);
    let plain = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| digits.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::revision;

    #[test]
    fn revisions_are_whole_numbers() {
        assert_eq!(["7", " 07\n", "+7"].map(revision), [Some(7); 3]);
        assert_eq!(
            ["", "-1", "1.0", "65536", "1_0", "+"].map(revision),
            [None; 6]
        );
    }
}
