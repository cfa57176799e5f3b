//! A `DomainSpecificInfo` as XML text, the form that ASAM's report uses.

use qcbus_formats::markup::Markup;
use qcbus_formats::xqar::{DomainInfo, InfoElement};

/// Returns the XML text on one line.
pub(crate) fn text(info: &DomainInfo) -> String {
    let mut out = Markup::default();
    out.tag("DomainSpecificInfo", &[("name", &info.name)]);
    out.raw(">");
    for child in &info.content {
        element(child, &mut out);
    }
    out.end_tag("DomainSpecificInfo");
    out.finish()
}

fn element(element: &InfoElement, out: &mut Markup) {
    let attributes = element.attributes.iter();
    let attributes: Vec<(&str, &str)> = attributes.map(|(n, v)| (&**n, &**v)).collect();
    out.tag(&element.name, &attributes);
    if element.text.is_empty() && element.children.is_empty() {
        out.raw("/>");
        return;
    }
    out.raw(">");
    // White space is written by number, so that the text stays on one line.
    out.escape(&element.text, true);
    for child in &element.children {
        self::element(child, out);
    }
    out.end_tag(&element.name);
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
