//! A `DomainSpecificInfo` as XML text, the form that ASAM's report uses.

use qcbus_formats::xqar::{DomainInfo, InfoElement};

/// Returns the XML text on one line.
pub(crate) fn text(info: &DomainInfo) -> String {
    let mut out = String::from("<DomainSpecificInfo name=\"");
    escape(&info.name, &mut out);
    out.push_str("\">");
    for child in &info.content {
        element(child, &mut out);
    }
    out.push_str("</DomainSpecificInfo>");
    out
}

fn element(element: &InfoElement, out: &mut String) {
    out.push('<');
    out.push_str(&element.name);
    for (name, value) in &element.attributes {
        out.push(' ');
        out.push_str(name);
        out.push_str("=\"");
        escape(value, out);
        out.push('"');
    }
    if element.text.is_empty() && element.children.is_empty() {
        out.push_str("/>");
        return;
    }
    out.push('>');
    escape(&element.text, out);
    for child in &element.children {
        self::element(child, out);
    }
    out.push_str("</");
    out.push_str(&element.name);
    out.push('>');
}

fn escape(text: &str, out: &mut String) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // A reader would otherwise convert these characters to spaces in attributes.
            '\t' => out.push_str("&#9;"),
            '\n' => out.push_str("&#10;"),
            '\r' => out.push_str("&#13;"),
            c => out.push(c),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn xml_special_characters_are_escaped() {
        let info = DomainInfo {
            name: "a\"b".into(),
            content: vec![InfoElement {
                name: "Road".into(),
                attributes: vec![("id".into(), "<5>\n".into())],
                text: "x & y".into(),
                children: vec![InfoElement {
                    name: "End".into(),
                    ..InfoElement::default()
                }],
            }],
        };
        assert_eq!(
            text(&info),
            "<DomainSpecificInfo name=\"a&quot;b\"><Road id=\"&lt;5&gt;&#10;\">x &amp; y<End/>\
             </Road></DomainSpecificInfo>"
        );
    }
}
