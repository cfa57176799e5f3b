//! Domain specific facts: elements defined by third parties, written so that no reader refuses the
//! file because of them.

use super::super::{DomainInfo, InfoElement, MAX_INFO_DEPTH};
use crate::markup::Markup;
use crate::xml::{is_name_char, is_name_start};

/// Namespaces that must not be bound to a prefix (Namespaces in XML 1.0, section 3).
const RESERVED: [&str; 2] = [
    "http://www.w3.org/XML/1998/namespace",
    "http://www.w3.org/2000/xmlns/",
];

/// Writes a `DomainSpecificInfo`.
pub(super) fn write(out: &mut Markup, info: &DomainInfo) {
    let attributes = [("name", info.name.as_str())];
    if info.content.is_empty() {
        out.empty("DomainSpecificInfo", &attributes);
        return;
    }
    out.open("DomainSpecificInfo", &attributes);
    for element in &info.content {
        out.indent();
        write_element(out, element, &mut Vec::new(), 1);
        out.raw("\n");
    }
    out.close("DomainSpecificInfo");
}

/// Writes an element in one line, because added white space would change its content.
fn write_element<'e>(
    out: &mut Markup,
    element: &'e InfoElement,
    prefixes: &mut Vec<&'e str>,
    depth: usize,
) {
    let declared = prefixes.len();
    prefixes.extend(element.attributes.iter().filter_map(declaration));
    let name = mend(&element.name, prefixes, false);
    let mut attributes: Vec<(String, &str)> = Vec::with_capacity(element.attributes.len());
    for attribute in &element.attributes {
        let name = mend(&attribute.0, prefixes, declaration(attribute).is_some());
        if !attributes.iter().any(|(earlier, _)| *earlier == name) {
            attributes.push((name, &attribute.1));
        }
    }
    let attributes: Vec<(&str, &str)> = attributes.iter().map(|(n, v)| (n.as_str(), *v)).collect();
    out.tag(&name, &attributes);
    // Trees that were read or decoded are never deeper.
    let children = if depth < MAX_INFO_DEPTH {
        &element.children[..]
    } else {
        &[]
    };
    let layout = !children.is_empty() && element.text.trim().is_empty();
    let text = if layout { "" } else { element.text.as_str() };
    if children.is_empty() && text.is_empty() {
        out.raw("/>");
    } else {
        out.raw(">");
        out.characters(text);
        for child in children {
            write_element(out, child, prefixes, depth + 1);
        }
        out.end_tag(&name);
    }
    prefixes.truncate(declared);
}

/// Returns the prefix that an attribute declares.
fn declaration((name, value): &(String, String)) -> Option<&str> {
    let prefix = name.strip_prefix("xmlns:")?;
    let usable = is_plain_name(prefix) && prefix != "xml" && prefix != "xmlns";
    (usable && !value.trim().is_empty() && !RESERVED.contains(&value.trim())).then_some(prefix)
}

fn is_plain_name(text: &str) -> bool {
    crate::xml::is_name(text) && !text.contains(':')
}

/// Returns a valid name with a declared prefix or none unchanged. Otherwise it replaces invalid
/// characters by underscores.
fn mend(name: &str, prefixes: &[&str], declares: bool) -> String {
    let parts = name.split_once(':');
    let good = match parts {
        None => is_plain_name(name),
        Some((prefix, local)) => {
            is_plain_name(local) && (declares || prefix == "xml" || prefixes.contains(&prefix))
        }
    };
    if good {
        return name.to_owned();
    }
    let mut mended: String = name
        .chars()
        .map(|c| if c != ':' && is_name_char(c) { c } else { '_' })
        .collect();
    if !mended.starts_with(|c| is_name_start(c) && c != ':') {
        mended.insert(0, '_');
    }
    mended
}
