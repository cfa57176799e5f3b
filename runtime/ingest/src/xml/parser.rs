//! Parses a document and its includes in one pass.

mod character_data;
mod misc;
mod plain;

use std::collections::HashMap;

use qcbus_document::{BuildError, Capacities, FaultCode};
use quick_xml::Reader;
use quick_xml::events::Event;

use super::chars::name_with_colon;
use super::includes::first_element;
use super::namespaces::Prefixes;
use super::sink::{Halt, Sink};
use super::tag::{AttributeScanner, RawAttribute};
use super::value::{BadReference, attribute_value};
use crate::limits::Limits;
use crate::text_fault::TextFault;

/// The texts of a document, the root file first, and the targets of its includes.
pub(crate) struct Input<'t> {
    pub texts: Vec<SourceText<'t>>,
    pub splices: &'t HashMap<SpliceKey, Splice>,
    pub limits: &'t Limits,
}

/// One file's text and its start in the text of the image.
#[derive(Clone, Copy)]
pub(crate) struct SourceText<'t> {
    pub path: &'t str,
    pub text: &'t str,
    pub start: u32,
}

/// Key of an `<include>`: the number of its file, and the offset of its `<` in that file's text.
pub(crate) type SpliceKey = (usize, usize);

/// Target of an `<include>`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Splice {
    /// Number of the included file.
    File(usize),
    /// The include has no target, and this is the reason.
    Fault(FaultCode, String),
}

/// Parses a whole document into `sink`. Returns the faults in the order of their discovery, with
/// offsets in the image's text. The sink also receives everything that can be read of a faulty
/// text.
pub(crate) fn parse<S: Sink>(input: &Input<'_>, sink: &mut S) -> Result<Vec<TextFault>, Halt> {
    parse_by(Parser::new(input, sink))
}

fn parse_by<S: Sink>(mut parser: Parser<'_, '_, S>) -> Result<Vec<TextFault>, Halt> {
    match parser.file(0, None) {
        Ok(()) | Err(Stop::File | Stop::All) => Ok(parser.faults),
        Err(Stop::Sink(Halt::Build(BuildError::TooManyNames))) => {
            let text = format!(
                "more than {} distinct names, the maximum of an image",
                Capacities::MAX_NAMES
            );
            parser
                .faults
                .push(TextFault::new(FaultCode::NameLimit, 0, text));
            Ok(parser.faults)
        }
        Err(Stop::Sink(halt)) => Err(halt),
    }
}

/// Reason why parsing ends before the end of the text.
enum Stop {
    /// A fault after which the rest of this file is meaningless.
    File,
    /// An exceeded cap. Reading stops completely.
    All,
    /// The sink accepts no further events.
    Sink(Halt),
}

impl From<Halt> for Stop {
    fn from(halt: Halt) -> Stop {
        Stop::Sink(halt)
    }
}

/// An open element.
struct Open<'t> {
    name: &'t str,
    /// Offset of its `<` in the text of its file.
    at: usize,
    /// Whether the element has no node: the root of an included file is represented by its parent.
    transparent: bool,
    /// Number of prefix bindings before this element.
    prefixes: usize,
    /// The include that is spliced when this element ends.
    include: Option<SpliceKey>,
}

/// A run of character data that may still grow.
#[derive(Default)]
struct Run {
    active: bool,
    start: usize,
    stop: usize,
    /// Value so far, if it differs from the text.
    value: String,
    resolved: bool,
}

/// The file being read.
#[derive(Clone, Copy)]
struct File<'t> {
    number: usize,
    text: &'t str,
    start: u32,
    /// Length of the stack at the start of the file.
    floor: usize,
    /// Required name of the root element of an included file.
    parent: Option<&'t str>,
}

struct Parser<'p, 't, S> {
    input: &'p Input<'t>,
    sink: &'p mut S,
    faults: Vec<TextFault>,
    stack: Vec<Open<'t>>,
    /// Files being read, outermost first.
    chain: Vec<usize>,
    included: u32,
    /// Whether includes are spliced. This is the case in OpenDRIVE only.
    splices: bool,
    seen_doctype: bool,
    refused_doctype: bool,
    run: Run,
    prefixes: Prefixes<'t>,
    /// Names of the attributes of the current tag.
    names: Vec<&'t str>,
    /// Attributes of the current tag, if it has plain spelling.
    attributes: Vec<RawAttribute>,
    /// Whether plain tags are read without quick-xml. The result is the same.
    plainly: bool,
    scratch: String,
    bad: Vec<BadReference>,
}

impl<'p, 't, S: Sink> Parser<'p, 't, S> {
    fn new(input: &'p Input<'t>, sink: &'p mut S) -> Self {
        Parser {
            input,
            sink,
            faults: Vec::new(),
            stack: Vec::new(),
            chain: Vec::new(),
            included: 0,
            splices: false,
            seen_doctype: false,
            refused_doctype: false,
            run: Run::default(),
            prefixes: Prefixes::default(),
            names: Vec::new(),
            attributes: Vec::new(),
            plainly: true,
            scratch: String::new(),
            bad: Vec::new(),
        }
    }

    /// Reads one file. `parent` is the required root element of an included file.
    fn file(&mut self, number: usize, parent: Option<&'t str>) -> Result<(), Stop> {
        let source = self.input.texts[number];
        let file = File {
            number,
            text: source.text,
            start: source.start,
            floor: self.stack.len(),
            parent,
        };
        let (mark, body) = marks(file.text);
        if mark != body {
            self.fault(
                file,
                FaultCode::TextOutsideRoot,
                mark,
                "a second byte-order mark",
            )?;
        }
        if file.text[body..].trim_ascii().is_empty() {
            return self.fault(file, FaultCode::Empty, 0, "the file is empty");
        }
        self.chain.push(number);
        let mut reader = lenient(&file.text[body..]);
        let outcome = self.events(file, &mut reader, body, mark);
        self.chain.pop();
        outcome
    }

    fn events(
        &mut self,
        file: File<'t>,
        reader: &mut Reader<&'t [u8]>,
        mut body: usize,
        mark: usize,
    ) -> Result<(), Stop> {
        let mut seen_root = false;
        loop {
            let from = body + offset(reader.buffer_position());
            let event = reader.read_event();
            let to = body + offset(reader.buffer_position());
            let outside = self.stack.len() == file.floor;
            // After text, quick-xml has already looked ahead at the next markup.
            let markup = !matches!(event, Ok(Event::Text(_) | Event::GeneralRef(_)));
            match event {
                Ok(Event::Start(tag)) => {
                    self.start_tag(file, from, tag.name().as_ref().len(), to, false, seen_root)?;
                    seen_root = true;
                }
                Ok(Event::Empty(tag)) => {
                    self.start_tag(file, from, tag.name().as_ref().len(), to, true, seen_root)?;
                    seen_root = true;
                }
                Ok(Event::End(tag)) => self.end_tag(file, from, to, tag.name().as_ref())?,
                Ok(Event::Text(_)) => self.text(file, from, to, outside, seen_root)?,
                Ok(Event::GeneralRef(name)) => self.reference(file, from, to, &name, outside)?,
                Ok(Event::CData(_)) => self.cdata(file, from, to, outside)?,
                Ok(Event::Comment(_)) => self.comment(file, from, to)?,
                Ok(Event::PI(_)) => self.instruction(file, from, to)?,
                Ok(Event::Decl(_)) => self.declaration(file, from, to, from == mark)?,
                Ok(Event::DocType(_)) => self.doctype(file, from, to, seen_root)?,
                Ok(Event::Eof) => return self.end_of_file(file, seen_root),
                Err(error) => return self.broken(file, from, &error),
            }
            if markup && self.plainly {
                let read = self.plain_tags(file, to)?;
                *reader.get_mut() = &file.text.as_bytes()[read..];
                body += read - to;
            }
        }
    }

    fn start_tag(
        &mut self,
        file: File<'t>,
        from: usize,
        name_len: usize,
        to: usize,
        empty: bool,
        seen_root: bool,
    ) -> Result<(), Stop> {
        self.flush(file)?;
        let name = &file.text[from + 1..from + 1 + name_len];
        let outside = self.stack.len() == file.floor;
        let mut transparent = outside && file.parent.is_some();
        if outside {
            self.root(file, from, name, seen_root)?;
        }
        if self.stack.len() >= usize::from(self.input.limits.max_depth) {
            return self.too_deep(file, from);
        }
        let Some(colon) = name_with_colon(name) else {
            self.bad_name(file, from, name)?;
            return self.open_nameless(file, from, empty, name);
        };
        if transparent && name != file.parent.unwrap_or(name) {
            transparent = false;
        }
        if !transparent {
            self.sink.open(name, file.start + narrow(from))?;
        }
        let prefixes = self.prefixes.mark();
        let inside = from + 1 + name_len..to - if empty { 2 } else { 1 };
        self.attributes(file, inside, transparent)?;
        if colon {
            self.check_prefix(file, from + 1, name)?;
        }
        let include =
            (self.splices && !outside && name == "include").then_some((file.number, from));
        let open = Open {
            name,
            at: from,
            transparent,
            prefixes,
            include,
        };
        if empty {
            return self.end(file, &open, to);
        }
        self.stack.push(open);
        Ok(())
    }

    /// Handles the first element of a file, or reports a second root element.
    fn root(
        &mut self,
        file: File<'t>,
        from: usize,
        name: &str,
        seen_root: bool,
    ) -> Result<(), Stop> {
        if seen_root {
            let text = format!(
                "a second root element <{}>; only one is allowed",
                shown(name)
            );
            self.fault(file, FaultCode::SecondRoot, from, &text)?;
            return Err(Stop::File);
        }
        match file.parent {
            None => {
                self.splices = name == "OpenDRIVE" || name.ends_with(":OpenDRIVE");
                Ok(())
            }
            Some(_) => Ok(()),
        }
    }

    fn too_deep(&mut self, file: File<'t>, from: usize) -> Result<(), Stop> {
        let depth = self.input.limits.max_depth;
        let text = format!(
            "elements are nested deeper than {depth}; raise the limit max_depth to read the rest"
        );
        self.fault(file, FaultCode::DepthLimit, from, &text)?;
        Err(Stop::All)
    }

    fn bad_name(&mut self, file: File<'t>, from: usize, name: &str) -> Result<(), Stop> {
        let text = if name.is_empty() {
            "no element name follows <; a literal < is written &lt;".to_string()
        } else if name.starts_with("<<<<<<") {
            "merge conflict marker; resolve the conflict".to_string()
        } else {
            format!("{:?} is not a valid element name", shown(name))
        };
        self.fault(file, FaultCode::BadName, from, &text)
    }

    /// Handles an element without a valid name. It gets no node, but its end tag is expected.
    fn open_nameless(
        &mut self,
        file: File<'t>,
        from: usize,
        empty: bool,
        name: &'t str,
    ) -> Result<(), Stop> {
        if self.stack.len() == file.floor {
            return Err(Stop::File);
        }
        if !empty {
            let prefixes = self.prefixes.mark();
            self.stack.push(Open {
                name,
                at: from,
                transparent: true,
                prefixes,
                include: None,
            });
        }
        Ok(())
    }

    fn attributes(
        &mut self,
        file: File<'t>,
        inside: std::ops::Range<usize>,
        transparent: bool,
    ) -> Result<(), Stop> {
        self.names.clear();
        let mut colon = false;
        for attribute in AttributeScanner::new(file.text, inside) {
            let attribute = match attribute {
                Ok(attribute) => attribute,
                Err(fault) => {
                    self.fault(file, fault.code, fault.offset, &fault.text)?;
                    break;
                }
            };
            let name = &file.text[attribute.name.clone()];
            if attribute.missing_space {
                let text = format!("no space before the attribute {}", shown(name));
                self.fault(file, FaultCode::MissingSpace, attribute.name.start, &text)?;
            }
            if attribute.colon {
                colon |= !self.prefixes.declare(name);
            }
            self.names.push(name);
            self.attribute(file, name, &attribute, transparent)?;
        }
        if self.names.len() > 1 {
            self.check_duplicates(file)?;
        }
        if colon {
            self.check_prefixes(file)
        } else {
            Ok(())
        }
    }

    #[inline]
    fn attribute(
        &mut self,
        file: File<'t>,
        name: &str,
        attribute: &RawAttribute,
        transparent: bool,
    ) -> Result<(), Stop> {
        let (name_at, value) = (attribute.name.start, attribute.value.clone());
        if attribute.special {
            self.resolve(file, value.start, &file.text[value.clone()])?;
        }
        if transparent {
            return Ok(());
        }
        let resolved = attribute.special.then_some(&*self.scratch);
        let (value_at, len) = (file.start + narrow(value.start), narrow(value.len()));
        self.sink
            .attribute(name, file.start + narrow(name_at), value_at, len, resolved)?;
        Ok(())
    }

    /// Stores the value of a raw attribute in `scratch`.
    #[cold]
    fn resolve(&mut self, file: File<'t>, at: usize, raw: &str) -> Result<(), Stop> {
        self.scratch.clear();
        self.bad.clear();
        attribute_value(raw, &mut self.scratch, &mut self.bad);
        for bad in std::mem::take(&mut self.bad) {
            self.bad_reference(file, at + bad.offset, &bad.why)?;
        }
        match raw.find('<') {
            Some(less) => {
                let text = "< within an attribute's value must be written &lt;";
                self.fault(file, FaultCode::BadAttribute, at + less, text)
            }
            None => Ok(()),
        }
    }

    /// Checks for duplicate attributes. Few attributes are compared pairwise and many are put into
    /// a hash set, so the time is never quadratic.
    fn check_duplicates(&mut self, file: File<'t>) -> Result<(), Stop> {
        const FEW: usize = 24;
        let names = &self.names;
        let repeated: Option<&'t str> = if names.len() <= FEW {
            (1..names.len())
                .find(|&i| names[..i].iter().any(|earlier| same(earlier, names[i])))
                .map(|i| names[i])
        } else {
            let mut seen = std::collections::HashSet::with_capacity(names.len());
            names.iter().copied().find(|&name| !seen.insert(name))
        };
        let Some(name) = repeated else { return Ok(()) };
        let at = offset_in(file.text, name);
        let text = format!(
            "the attribute `{}` appears twice in one element",
            shown(name)
        );
        self.fault(file, FaultCode::DuplicateAttribute, at, &text)
    }

    #[cold]
    fn check_prefixes(&mut self, file: File<'t>) -> Result<(), Stop> {
        let names = std::mem::take(&mut self.names);
        for name in names.iter().filter(|name| name.contains(':')) {
            self.check_prefix(file, offset_in(file.text, name), name)?;
        }
        self.names = names;
        Ok(())
    }

    #[cold]
    fn check_prefix(&mut self, file: File<'t>, at: usize, name: &str) -> Result<(), Stop> {
        let Some(prefix) = self.prefixes.unbound(name) else {
            return Ok(());
        };
        let text = format!(
            "the prefix of {} has no namespace, so namespace-aware parsers refuse the file; xmlns:{} is missing",
            shown(name),
            shown(prefix)
        );
        self.fault(file, FaultCode::UnboundPrefix, at, &text)
    }

    fn end_tag(&mut self, file: File<'t>, from: usize, to: usize, name: &str) -> Result<(), Stop> {
        self.flush(file)?;
        if self.stack.len() > file.floor && self.stack.last().is_some_and(|open| open.name == name)
        {
            return self.close(file, to);
        }
        self.mismatch(file, from, to, name)
    }

    fn close(&mut self, file: File<'t>, to: usize) -> Result<(), Stop> {
        match self.stack.pop() {
            Some(open) => self.end(file, &open, to),
            None => Ok(()),
        }
    }

    /// Ends an element and splices its include, if it has one.
    #[inline]
    fn end(&mut self, file: File<'t>, open: &Open<'t>, to: usize) -> Result<(), Stop> {
        self.prefixes.forget(open.prefixes);
        if !open.transparent {
            self.sink.close(file.start + narrow(to))?;
        }
        open.include.map_or(Ok(()), |key| self.splice(file, key))
    }

    /// Handles an end tag that does not match. If it belongs to an outer element, the inner
    /// elements are closed. Otherwise it is skipped.
    #[cold]
    fn mismatch(&mut self, file: File<'t>, from: usize, to: usize, name: &str) -> Result<(), Stop> {
        let text = match self.stack[file.floor..].last() {
            Some(open) => format!(
                "found </{}>, expected </{}> for the element opened in row {}",
                shown(name),
                shown(open.name),
                row(file.text, open.at)
            ),
            None => format!("</{}> closes an element that was never opened", shown(name)),
        };
        self.fault(file, FaultCode::MismatchedTag, from, &text)?;
        let Some(depth) = self.stack[file.floor..]
            .iter()
            .rposition(|open| open.name == name)
        else {
            return Ok(());
        };
        while self.stack.len() > file.floor + depth + 1 {
            self.close(file, from)?;
        }
        self.close(file, to)
    }

    fn end_of_file(&mut self, file: File<'t>, seen_root: bool) -> Result<(), Stop> {
        self.flush(file)?;
        if !seen_root {
            return self.fault(
                file,
                FaultCode::NoRoot,
                file.text.len(),
                "the file has no element",
            );
        }
        let Some(open) = self.stack[file.floor..].last() else {
            return Ok(());
        };
        let text = format!(
            "the file ends before <{}>, opened in row {}, is closed",
            shown(open.name),
            row(file.text, open.at)
        );
        self.fault(file, FaultCode::Unclosed, file.text.len(), &text)?;
        self.close_rest(file)
    }

    fn close_rest(&mut self, file: File<'t>) -> Result<(), Stop> {
        while self.stack.len() > file.floor {
            self.close(file, file.text.len())?;
        }
        Ok(())
    }

    /// Handles an error of quick-xml: unterminated or invalid markup.
    #[cold]
    fn broken(
        &mut self,
        file: File<'t>,
        from: usize,
        error: &quick_xml::Error,
    ) -> Result<(), Stop> {
        self.flush(file)?;
        // There may be text between the last event and the faulty markup.
        let at = file.text[from..].find('<').map_or(from, |skip| from + skip);
        let code = match error {
            quick_xml::Error::Syntax(quick_xml::errors::SyntaxError::InvalidBangMarkup) => {
                FaultCode::Syntax
            }
            quick_xml::Error::Syntax(_) => FaultCode::Unclosed,
            _ => FaultCode::Syntax,
        };
        let text = match error {
            quick_xml::Error::Syntax(error) => error.to_string(),
            error => error.to_string(),
        };
        match open_quote(&file.text[at..]) {
            Some(quote) if text.starts_with("attribute value") => {
                let text = "the attribute's value has no closing quote";
                self.fault(file, code, at + quote, text)?;
            }
            _ => self.fault(file, code, at, &text)?,
        }
        Err(Stop::File)
    }

    /// Inserts the children of an included file's root at the current position.
    #[cold]
    fn splice(&mut self, file: File<'t>, key: SpliceKey) -> Result<(), Stop> {
        let target = match self.input.splices.get(&key) {
            Some(Splice::File(target)) => *target,
            Some(Splice::Fault(code, text)) => return self.fault(file, *code, key.1, text),
            None => {
                return self.fault(
                    file,
                    FaultCode::IncludeMissing,
                    key.1,
                    "this include was not read",
                );
            }
        };
        if self.chain.contains(&target) {
            let text = format!(
                "this include is circular: it leads back to {}, which is being included",
                self.input.texts[target].path
            );
            return self.fault(file, FaultCode::IncludeCycle, key.1, &text);
        }
        self.included += 1;
        let limit = self.input.limits.max_includes;
        if self.included > limit {
            let text =
                format!("more than {limit} includes; raise the limit max_includes to read them");
            self.fault(file, FaultCode::IncludeLimit, key.1, &text)?;
            return Err(Stop::All);
        }
        let Some(parent) = self.stack.last().map(|open| open.name) else {
            return Ok(());
        };
        if let Some(root) =
            first_element(self.input.texts[target].text).filter(|root| *root != parent)
        {
            let text = format!(
                "the root of the included file is <{}>, but it must be <{parent}>, the element around the include",
                shown(root)
            );
            return self.fault(file, FaultCode::IncludeParentMismatch, key.1, &text);
        }
        let floor = self.stack.len();
        match self.file(target, Some(parent)) {
            // A faulty included file ends here, and the including file continues.
            Err(Stop::File) => {
                self.run.active = false;
                let end = self.input.texts[target];
                let file = File {
                    number: target,
                    text: end.text,
                    start: end.start,
                    floor,
                    parent: None,
                };
                self.close_rest(file)
            }
            outcome => outcome,
        }
    }

    #[cold]
    fn fault(
        &mut self,
        file: File<'t>,
        code: FaultCode,
        at: usize,
        text: &str,
    ) -> Result<(), Stop> {
        let at = file.start as usize + at;
        let limit = self.input.limits.max_faults as usize;
        if self.faults.len() < limit {
            self.faults.push(TextFault::new(code, at, text));
            return Ok(());
        }
        let text = format!("more than {limit} faults; the rest of the file is not read");
        self.faults
            .push(TextFault::new(FaultCode::FaultLimit, at, text));
        Err(Stop::All)
    }
}

/// Returns the length of the byte-order mark, and the length of all consecutive byte-order marks
/// together. (quick-xml would skip one without counting it.)
pub(super) fn marks(text: &str) -> (usize, usize) {
    let body = text.len() - text.trim_start_matches('\u{FEFF}').len();
    (body.min('\u{FEFF}'.len_utf8()), body)
}

/// Creates a quick-xml reader without its checks. The checks here recover, and they report the
/// place and the reason.
pub(super) fn lenient(text: &str) -> Reader<&[u8]> {
    let mut reader = Reader::from_str(text);
    let config = reader.config_mut();
    config.check_end_names = false;
    config.allow_unmatched_ends = true;
    config.allow_dangling_amp = true;
    reader
}

/// Compares two strings. Most comparisons end at the first letter, before any call.
#[inline]
fn same(one: &str, other: &str) -> bool {
    one.len() == other.len() && one.as_bytes().first() == other.as_bytes().first() && one == other
}

/// Truncates a name or text for messages, so that their length is limited for every file.
fn shown(text: &str) -> &str {
    text.char_indices()
        .nth(60)
        .map_or(text, |(at, _)| &text[..at])
}

/// Returns the row of an offset. It counts from the start of the text, so it is for messages only.
fn row(text: &str, at: usize) -> usize {
    text.as_bytes()[..at]
        .iter()
        .filter(|&&byte| byte == b'\n')
        .count()
        + 1
}

/// Returns the offset of `part`, which must be a slice of `text`.
fn offset_in(text: &str, part: &str) -> usize {
    (part.as_ptr() as usize).saturating_sub(text.as_ptr() as usize)
}

/// Converts a position. Positions of a text in memory always fit.
pub(super) fn offset(position: u64) -> usize {
    usize::try_from(position).unwrap_or(usize::MAX)
}

/// Converts an offset to 32 bits. Texts above 4 GiB are refused before they are parsed.
#[inline]
fn narrow(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

/// Finds the opening quote of the value without a closing quote in a tag. It is the first quote
/// whose value contains a `<`, which is not allowed there, or extends to the end.
fn open_quote(tag: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        let rest = &tag[at..];
        let open = at + rest.find(['"', '\''])?;
        let quote = tag.as_bytes().get(open).copied()?;
        let value = &tag[open + 1..];
        match value.find(char::from(quote)) {
            Some(len) if !value[..len].contains('<') => at = open + len + 2,
            _ => return Some(open),
        }
    }
}
