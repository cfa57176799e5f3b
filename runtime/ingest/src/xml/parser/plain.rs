//! Reads plain tags without a call of quick-xml for each. Nearly all tags in a file are plain.

use super::{File, Open, Parser, Stop, narrow};
use crate::xml::plain::{PlainTag, end_tag, skip_indent, start_tag};
use crate::xml::sink::Sink;
use crate::xml::tag::RawAttribute;

impl<'t, S: Sink> Parser<'_, 't, S> {
    /// Reads plain tags with only white space between them, from `at` on and within the root
    /// element. Returns the position after the last one. The text after it is still unread.
    pub(super) fn plain_tags(&mut self, file: File<'t>, mut at: usize) -> Result<usize, Stop> {
        let text = file.text.as_bytes();
        let mut attributes = std::mem::take(&mut self.attributes);
        let depth = usize::from(self.input.limits.max_depth);
        // In a started run of character data, white space belongs to the run.
        while !self.run.active && self.stack.len() > file.floor {
            let from = skip_indent(text, at);
            if text.get(from) != Some(&b'<') {
                break;
            }
            if text.get(from + 1) == Some(&b'/') {
                let name = self.stack.last().map_or("", |open| open.name);
                let Some(end) = end_tag(text, from, name) else {
                    break;
                };
                self.close(file, end)?;
                at = end;
                continue;
            }
            if self.stack.len() >= depth {
                break;
            }
            let Some(tag) = start_tag(text, from, &mut attributes) else {
                break;
            };
            self.plain_start(file, from, &tag, &attributes)?;
            at = tag.end;
        }
        self.attributes = attributes;
        Ok(at)
    }

    #[inline]
    fn plain_start(
        &mut self,
        file: File<'t>,
        from: usize,
        tag: &PlainTag,
        attributes: &[RawAttribute],
    ) -> Result<(), Stop> {
        let name = &file.text[from + 1..tag.name_end];
        self.sink.open(name, file.start + narrow(from))?;
        let prefixes = self.prefixes.mark();
        let (mut seen, mut alike, mut colon) = ([0u64; 4], false, false);
        for attribute in attributes {
            let name = &file.text[attribute.name.clone()];
            if attribute.colon {
                colon |= !self.prefixes.declare(name);
            }
            let mark = mark_of(name.as_bytes());
            let (word, bit) = (&mut seen[usize::from(mark / 64)], 1 << (mark % 64));
            alike |= *word & bit != 0;
            *word |= bit;
            self.attribute(file, name, attribute, false)?;
        }
        if alike || colon {
            self.names.clear();
            let names = attributes.iter().map(|it| &file.text[it.name.clone()]);
            self.names.extend(names);
            self.check_duplicates(file)?;
        }
        if colon {
            self.check_prefixes(file)?;
        }
        if tag.colon {
            self.check_prefix(file, from + 1, name)?;
        }
        let include = (self.splices && name == "include").then_some((file.number, from));
        let open = Open {
            name,
            at: from,
            transparent: false,
            prefixes,
            include,
        };
        if tag.empty {
            return self.end(file, &open, tag.end);
        }
        self.stack.push(open);
        Ok(())
    }
}

/// Returns a small hash of a name. Names with different hashes differ, and most names in one tag
/// have different hashes.
#[inline]
fn mark_of(name: &[u8]) -> u8 {
    let (first, last) = (name.first().copied(), name.last().copied());
    let (first, last) = (first.unwrap_or(0), last.unwrap_or(0));
    let sum = first.wrapping_mul(37).wrapping_add(last.wrapping_mul(11));
    sum.wrapping_add((name.len() as u8).wrapping_mul(101))
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::limits::Limits;
    use crate::text_fault::TextFault;
    use crate::xml::parser::{Input, SourceText, Splice, SpliceKey, parse_by};
    use crate::xml::sink::Halt;

    /// Records all events as text.
    #[derive(Default, Debug, PartialEq)]
    struct Record(Vec<String>);

    impl Record {
        fn push(&mut self, event: String) -> Result<(), Halt> {
            self.0.push(event);
            Ok(())
        }
    }

    impl Sink for Record {
        fn open(&mut self, name: &str, offset: u32) -> Result<(), Halt> {
            self.push(format!("open {name} {offset}"))
        }

        fn attribute(
            &mut self,
            name: &str,
            name_at: u32,
            value_at: u32,
            len: u32,
            resolved: Option<&str>,
        ) -> Result<(), Halt> {
            self.push(format!("{name} {name_at} {value_at} {len} {resolved:?}"))
        }

        fn text(&mut self, start: u32, stop: u32, resolved: Option<&str>) -> Result<(), Halt> {
            self.push(format!("text {start} {stop} {resolved:?}"))
        }

        fn close(&mut self, stop: u32) -> Result<(), Halt> {
            self.push(format!("close {stop}"))
        }
    }

    fn read(texts: &[&str], limits: &Limits, plainly: bool) -> (Record, Vec<TextFault>) {
        let mut start = 0;
        let place = |text| {
            let place = SourceText {
                path: "",
                text,
                start,
            };
            start += narrow(text.len()) + 1;
            place
        };
        let included = texts[0].match_indices("<include");
        let splices: HashMap<SpliceKey, Splice> =
            included.map(|(at, _)| ((0, at), Splice::File(1))).collect();
        let input = Input {
            texts: texts.iter().copied().map(place).collect(),
            splices: &splices,
            limits,
        };
        let mut record = Record::default();
        let mut parser = Parser::new(&input, &mut record);
        parser.plainly = plainly;
        let Ok(faults) = parse_by(parser) else {
            unreachable!("the record takes everything");
        };
        (record, faults)
    }

    /// Checks that both ways of reading give the same result: nodes, values, faults, places.
    fn both_agree(text: &str, limits: &Limits) {
        let part = "<road a='1'><x/> <y b=\"&lt;\"></y>t<z/></road>";
        let texts = [text, part];
        let plain = read(&texts, limits, true);
        assert_eq!(plain, read(&texts, limits, false), "{text:?}");
    }

    #[test]
    fn fast_path_agrees_on_every_tag_spelling() {
        let tags = [
            "<b/>",
            "<b />",
            "<b\n/>",
            "<b></b>",
            "<b ></b >",
            "<b / >",
            "<b/></b>",
            "<b>",
            "</b>",
            "</ b>",
            "<b",
            "<b a",
            "<b a=",
            "<b a='",
            "<b a='1",
            "<b a='1'",
            "<b a='1'/",
            "<",
            "</",
            "</b",
            "<1/>",
            "<:/>",
            "<b a='1'c='2'/>",
            "<b a ='1'/>",
            "<b a= '1'/>",
            "<b a='1' a='2'/>",
            "<b a='>' c='/>'/>",
            "<b a='<'/>",
            "<b a='&amp;'/>",
            "<b a='&x;'/>",
            "<b a='\t'/>",
            "<b a='\u{1}'/>",
            "<b a='\u{7f}ü'/>",
            "<ü/>",
            "<b ü='1'/>",
            "<b\u{b}/>",
            "<b a='1'\u{b}/>",
            "<x:b/>",
            "<b x:a='1'/>",
            "<b a=\"'\" c='\"'/>",
            "<x:b xmlns:x='u' x:a='1'/>",
            "<b xmlns:x='u'><x:c/></b><x:d/>",
            "<b a='12345678901234567&lt;1'/>",
            "<b a='1234567\"' c=\"1234567'\"/>",
            "<b xmlns:x='u' xmlns:x='v'/>",
            "<b>&amp; <c/></b>",
            "<b><![CDATA[x]]> <c/></b>",
            "<b>t <c/></b>",
            "\u{FEFF}<b/>",
            "<b/>\u{FEFF}",
            "<include file='p'/>",
            "<include file='p'> </include>",
            "<b a1='' b1='' c1='' d1='' e1='' f1='' g1='' h1='' i1='' j1='' k1='' l1='' m1='' n1='' a1=''/>",
        ];
        for tag in tags {
            for text in [
                format!("<OpenDRIVE><road>{tag}</road></OpenDRIVE>"),
                format!("<OpenDRIVE><road> {tag} <c/></road></OpenDRIVE>"),
                format!("<OpenDRIVE><road>{tag}"),
                tag.to_string(),
            ] {
                both_agree(&text, &Limits::default());
            }
        }
    }

    #[test]
    fn fast_path_agrees_on_random_markup() {
        const PIECES: &[&str] = &[
            "<a>",
            "</a>",
            "<b/>",
            "<b x='1' y=\"2\">",
            "</b>",
            " ",
            "\n  ",
            "t",
            "&amp;",
            "&#32;",
            "&x;",
            "&",
            "<",
            ">",
            "'",
            "\"",
            "=",
            "/",
            "<!-- c -->",
            "<!--",
            "-->",
            "<![CDATA[ d ]]>",
            "]]>",
            "<?p i?>",
            "<a",
            " x='1'",
            " x='1' x='2'",
            " n:x='1'",
            " xmlns:n='u'",
            "<n:a>",
            "</n:a>",
            "<include file='p'/>",
            "<road>",
            "</road>",
            "\r\n",
            "\u{FEFF}",
            "ü",
            "\0",
            "<!DOCTYPE a>",
            "<a b='0.0000000000000000e+00'/>",
            "</a >",
        ];
        let limits = Limits::default();
        let tight = Limits {
            max_depth: 4,
            max_faults: 3,
            max_includes: 2,
            ..limits
        };
        let mut state = 0x9E37_79B9_7F4A_7C15_u64;
        let mut next = |below: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 33) as usize % below
        };
        for round in 0..40_000 {
            let mut text = String::from(["<OpenDRIVE>", "", "<road><a>"][next(3)]);
            for _ in 0..next(14) {
                text.push_str(PIECES[next(PIECES.len())]);
            }
            if next(2) == 0 {
                text.push_str("</OpenDRIVE>");
            }
            both_agree(&text, [&limits, &tight][round % 2]);
        }
    }
}
