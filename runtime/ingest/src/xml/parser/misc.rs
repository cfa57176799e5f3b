//! Handles markup without content: comments, processing instructions, the XML declaration, DOCTYPE.

use qcbus_document::FaultCode;

use super::{File, Parser, Stop, shown};
use crate::xml::chars::name_with_colon;
use crate::xml::sink::Sink;
use crate::xml::tag::AttributeScanner;

impl<'t, S: Sink> Parser<'_, 't, S> {
    pub(super) fn comment(&mut self, file: File<'t>, from: usize, to: usize) -> Result<(), Stop> {
        const HEAD: usize = "<!--".len();
        const TAIL: usize = "-->".len();
        let content = &file.text[from + HEAD..to - TAIL];
        let at = content
            .find("--")
            .or_else(|| content.ends_with('-').then(|| content.len() - 1));
        let Some(at) = at else { return Ok(()) };
        let text = "-- within a comment; XML allows it only at the end";
        self.fault(file, FaultCode::BadComment, from + HEAD + at, text)
    }

    pub(super) fn instruction(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
    ) -> Result<(), Stop> {
        let content = &file.text[from + 2..to - 2];
        let target = content
            .split([' ', '\t', '\n', '\r'])
            .next()
            .unwrap_or(content);
        if target.eq_ignore_ascii_case("xml") {
            let text = format!("<?{target}?> is reserved; write an XML declaration as <?xml …?>");
            return self.fault(file, FaultCode::BadDeclaration, from, &text);
        }
        if name_with_colon(target).is_none() {
            let text = format!(
                "{:?} is not a valid name for a processing instruction",
                shown(target)
            );
            return self.fault(file, FaultCode::BadName, from, &text);
        }
        Ok(())
    }

    pub(super) fn declaration(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
        first: bool,
    ) -> Result<(), Stop> {
        if !first {
            let text = "the XML declaration is not at the very start of the file";
            return self.fault(file, FaultCode::BadDeclaration, from, text);
        }
        match declaration_trouble(file.text, from + "<?xml".len(), to - "?>".len()) {
            Some((at, text)) => self.fault(file, FaultCode::BadDeclaration, at, &text),
            None => Ok(()),
        }
    }

    /// Handles a document type declaration. A declaration with only the name of the root is
    /// harmless, and tools write it. A declaration that defines or refers to something is refused.
    pub(super) fn doctype(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
        seen_root: bool,
    ) -> Result<(), Stop> {
        let first = !std::mem::replace(&mut self.seen_doctype, true);
        if first && !seen_root && self.stack.len() == file.floor && is_bare(&file.text[from..to]) {
            return Ok(());
        }
        if std::mem::replace(&mut self.refused_doctype, true) {
            return Ok(());
        }
        let text = "a DOCTYPE is refused: it can load files and expand without limit; it and its entities are \
                    not read";
        self.fault(file, FaultCode::Doctype, from, text)
    }
}

/// Checks whether a document type declaration has only a name: no subset, and no reference to one.
fn is_bare(declaration: &str) -> bool {
    let inside = declaration
        .strip_prefix("<!DOCTYPE")
        .and_then(|rest| rest.strip_suffix('>'))
        .filter(|inside| inside.starts_with([' ', '\t', '\n', '\r']));
    inside.is_some_and(|inside| {
        name_with_colon(inside.trim_matches([' ', '\t', '\n', '\r'])).is_some()
    })
}

/// Returns the fault inside an XML declaration, or `None`. It must contain `version`, `encoding`,
/// `standalone` in this order. Only the first is required.
fn declaration_trouble(text: &str, from: usize, to: usize) -> Option<(usize, String)> {
    let mut expected: &[&str] = &["version", "encoding", "standalone"];
    for attribute in AttributeScanner::new(text, from..to) {
        let attribute = match attribute {
            Ok(attribute) => attribute,
            Err(fault) => {
                return Some((
                    fault.offset,
                    format!("in the XML declaration: {}", fault.text),
                ));
            }
        };
        let (name, value) = (
            &text[attribute.name.clone()],
            &text[attribute.value.clone()],
        );
        let at = attribute.name.start;
        if attribute.missing_space {
            return Some((at, format!("no space before {name} in the XML declaration")));
        }
        let Some(place) = expected.iter().position(|&known| known == name) else {
            let text = format!(
                "{:?} is not allowed here in the XML declaration",
                shown(name)
            );
            return Some((at, text));
        };
        if place > 0 && expected[0] == "version" {
            return Some((
                at,
                "the XML declaration must begin with version".to_string(),
            ));
        }
        expected = &expected[place + 1..];
        let sound = match name {
            // In the fifth edition, every version with the prefix `1.` is read as 1.0.
            "version" => value.strip_prefix("1.").is_some_and(is_digits),
            "standalone" => matches!(value, "yes" | "no"),
            _ => value.starts_with(|c: char| c.is_ascii_alphabetic()),
        };
        if !sound {
            let text = format!(
                "{:?} is not a valid {name} for an XML declaration",
                shown(value)
            );
            return Some((at, text));
        }
    }
    (expected.len() == 3).then(|| (from, "the XML declaration has no version".to_string()))
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}
