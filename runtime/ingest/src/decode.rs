//! Decodes bytes to text: byte-order marks, encoding declarations and contradictions between them.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE};

use crate::limits::{Exceeded, Limits};
use crate::text_fault::{Code, TextFault};

/// A file's text in UTF-8 and the faults of its bytes. A UTF-8 byte-order mark stays in the text,
/// so that offsets match the file on disk.
pub(crate) struct Decoded {
    pub text: String,
    pub faults: Vec<TextFault>,
    /// The bytes on disk, if they differ from the bytes of the text.
    pub source: Option<Vec<u8>>,
}

/// Encoding by which the bytes are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Charset {
    Utf8,
    Ascii,
    /// ISO-8859-1 proper: byte = code point. (The web's tables read windows-1252 under that name.)
    Latin1,
    Table(&'static Encoding),
}

/// Encoding detected at the start of a file.
struct Opening {
    charset: Charset,
    /// Length of the byte-order mark.
    mark: usize,
    fault: Option<TextFault>,
}

/// Decodes a whole file. Each undecodable byte becomes U+FFFD, and the first few also become
/// faults. The rest stays readable.
pub(crate) fn decode(bytes: Vec<u8>, limits: &Limits) -> Decoded {
    let opening = open(&bytes);
    let mut faults: Vec<TextFault> = opening.fault.into_iter().collect();
    let (text, source) = match opening.charset {
        Charset::Utf8 => utf8(bytes, &mut faults),
        Charset::Ascii => ascii(bytes, &mut faults),
        Charset::Latin1 => {
            faults.push(transcoded("ISO-8859-1"));
            let text = bytes.iter().map(|&byte| char::from(byte)).collect();
            (text, Some(bytes))
        }
        Charset::Table(encoding) => {
            faults.push(transcoded(encoding.name()));
            let text = table(
                encoding,
                bytes.get(opening.mark..).unwrap_or(&[]),
                &mut faults,
            );
            if is_utf16(encoding) {
                check_utf16_declaration(&text, &mut faults);
            }
            (text, Some(bytes))
        }
    };
    let size = text.len() as u64;
    match Exceeded::check(
        "max_unpacked",
        "bytes of decoded text",
        size,
        limits.max_unpacked,
    ) {
        Ok(()) => Decoded {
            text,
            faults,
            source,
        },
        Err(exceeded) => {
            let fault = TextFault::new(Code::UnpackedLimit, 0, format!("the text has {exceeded}"));
            Decoded {
                text: String::new(),
                faults: vec![fault],
                source: Some(source.unwrap_or_else(|| text.into_bytes())),
            }
        }
    }
}

/// Detects the encoding: first by byte-order mark, then by the pattern of `<?` in 16 bits, then by
/// the declaration.
fn open(bytes: &[u8]) -> Opening {
    let found = |charset, mark, fault| Opening {
        charset,
        mark,
        fault,
    };
    if let Some(text) = bytes.strip_prefix(b"\xEF\xBB\xBF") {
        return found(Charset::Utf8, 3, contradiction(text));
    }
    match bytes {
        [0xFF, 0xFE, 0, 0, ..]
        | [0, 0, 0xFE, 0xFF, ..]
        | [0, 0, 0, b'<', ..]
        | [b'<', 0, 0, 0, ..] => {
            let text = "the file is in UTF-32, which is not supported; store it as UTF-8";
            found(
                Charset::Utf8,
                0,
                Some(TextFault::new(Code::EncodingUnknown, 0, text)),
            )
        }
        [0xFF, 0xFE, ..] => found(Charset::Table(UTF_16LE), 2, None),
        [0xFE, 0xFF, ..] => found(Charset::Table(UTF_16BE), 2, None),
        [b'<', 0, second, 0, ..] if *second != 0 => found(Charset::Table(UTF_16LE), 0, None),
        [0, b'<', 0, second, ..] if *second != 0 => found(Charset::Table(UTF_16BE), 0, None),
        _ => by_declaration(bytes),
    }
}

fn is_utf16(encoding: &'static Encoding) -> bool {
    encoding == UTF_16LE || encoding == UTF_16BE
}

fn transcoded(name: &str) -> TextFault {
    let text = format!("the file is in {name}, not in UTF-8; positions refer to its text in UTF-8");
    TextFault::new(Code::EncodingTranscoded, 0, text)
}

fn by_declaration(bytes: &[u8]) -> Opening {
    let Some((label, offset)) = declared(bytes) else {
        return Opening {
            charset: Charset::Utf8,
            mark: 0,
            fault: None,
        };
    };
    let (charset, trouble) = match charset_of(&label) {
        Some(Charset::Table(encoding)) if is_utf16(encoding) => {
            let text = format!(
                "the file declares encoding \"{label}\" but its characters are single bytes; \
                 it is read as UTF-8"
            );
            (Charset::Utf8, Some((Code::EncodingMismatch, text)))
        }
        Some(charset) => (charset, None),
        None => {
            let text = format!(
                "the declared encoding \"{label}\" is not known; the file is read as UTF-8"
            );
            (Charset::Utf8, Some((Code::EncodingUnknown, text)))
        }
    };
    let fault = trouble.map(|(code, text)| TextFault::new(code, offset, text));
    Opening {
        charset,
        mark: 0,
        fault,
    }
}

/// Returns a fault if the declaration contradicts the UTF-8 byte-order mark before it.
fn contradiction(text: &[u8]) -> Option<TextFault> {
    let (label, offset) = declared(text)?;
    if charset_of(&label) == Some(Charset::Utf8) {
        return None;
    }
    let text = format!(
        "the file declares encoding \"{label}\" but begins with a UTF-8 byte-order mark; it is read as UTF-8"
    );
    Some(TextFault::new(Code::EncodingMismatch, offset + 3, text))
}

fn check_utf16_declaration(text: &str, faults: &mut Vec<TextFault>) {
    let Some((label, offset)) = declared(text.as_bytes()) else {
        return;
    };
    let is_utf16_label = charset_of(&label)
        .is_some_and(|charset| matches!(charset, Charset::Table(encoding) if is_utf16(encoding)));
    if !is_utf16_label {
        let text = format!("the file declares encoding \"{label}\" but its bytes are UTF-16");
        faults.push(TextFault::new(Code::EncodingMismatch, offset, text));
    }
}

fn charset_of(label: &str) -> Option<Charset> {
    let lower = label.trim().to_ascii_lowercase();
    Some(match lower.as_str() {
        "utf-8" | "utf8" => Charset::Utf8,
        "us-ascii" | "ascii" | "iso646-us" | "ansi_x3.4-1968" => Charset::Ascii,
        "iso-8859-1" | "iso8859-1" | "iso_8859-1" | "latin1" | "latin-1" | "l1" => Charset::Latin1,
        _ => {
            let encoding = Encoding::for_label_no_replacement(lower.as_bytes())?;
            if encoding == encoding_rs::X_USER_DEFINED {
                return None;
            }
            Charset::Table(encoding)
        }
    })
}

/// Returns the label of `<?xml … encoding="…"?>` and its offset, if the bytes begin with such an
/// XML declaration.
fn declared(bytes: &[u8]) -> Option<(String, usize)> {
    let head = &bytes[..bytes.len().min(1024)];
    let rest = head.strip_prefix(b"<?xml")?;
    if !rest.first()?.is_ascii_whitespace() {
        return None;
    }
    let declaration = &head[..head.windows(2).position(|pair| pair == b"?>")?];
    let name = b"encoding";
    let after = declaration
        .windows(name.len())
        .position(|window| window == name)?
        + name.len();
    let mut at = after;
    let skip_blanks = |at: &mut usize| {
        while declaration.get(*at).is_some_and(u8::is_ascii_whitespace) {
            *at += 1;
        }
    };
    skip_blanks(&mut at);
    if declaration.get(at) != Some(&b'=') {
        return None;
    }
    at += 1;
    skip_blanks(&mut at);
    let quote = *declaration
        .get(at)
        .filter(|byte| matches!(byte, b'"' | b'\''))?;
    let label = &declaration[at + 1..];
    let label = &label[..label.iter().position(|&byte| byte == quote)?];
    Some((String::from_utf8_lossy(label).into_owned(), at + 1))
}

/// Maximum number of places with undecodable bytes that are reported one by one.
const NAMED_PLACES: usize = 8;

/// Returns the text, and the original bytes if they are not valid UTF-8.
fn utf8(bytes: Vec<u8>, faults: &mut Vec<TextFault>) -> (String, Option<Vec<u8>>) {
    let bytes = match String::from_utf8(bytes) {
        Ok(text) => return (text, None),
        Err(error) => error.into_bytes(),
    };
    let mut text = String::with_capacity(bytes.len() + 64);
    let mut named = 0;
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        if chunk.invalid().is_empty() {
            continue;
        }
        if named < NAMED_PLACES {
            named += 1;
            faults.push(TextFault::new(
                Code::EncodingMalformed,
                text.len(),
                format!(
                    "the {} not valid UTF-8; the encoding declaration may be wrong",
                    hex(chunk.invalid())
                ),
            ));
        }
        text.push(char::REPLACEMENT_CHARACTER);
    }
    (text, Some(bytes))
}

fn hex(bytes: &[u8]) -> String {
    let digits: Vec<String> = bytes.iter().map(|byte| format!("0x{byte:02X}")).collect();
    if digits.len() == 1 {
        format!("byte {} is", digits[0])
    } else {
        format!("bytes {} are", digits.join(" "))
    }
}

fn ascii(bytes: Vec<u8>, faults: &mut Vec<TextFault>) -> (String, Option<Vec<u8>>) {
    let before = faults.len();
    if let Some(offset) = bytes.iter().position(|byte| !byte.is_ascii()) {
        let text = format!(
            "the file declares US-ASCII but contains the byte 0x{:02X}; it is read as UTF-8",
            bytes[offset]
        );
        faults.push(TextFault::new(Code::EncodingMismatch, offset, text));
    }
    let read = utf8(bytes, faults);
    faults.truncate(before + 1);
    read
}

/// Decodes by one of the web's tables. Unmappable bytes appear in the result as U+FFFD, and are
/// located there.
fn table(encoding: &'static Encoding, bytes: &[u8], faults: &mut Vec<TextFault>) -> String {
    let (text, malformed) = encoding.decode_without_bom_handling(bytes);
    if malformed {
        let places = text
            .match_indices(char::REPLACEMENT_CHARACTER)
            .take(NAMED_PLACES);
        faults.extend(places.map(|(offset, _)| {
            let text = format!("the bytes here are not valid {}", encoding.name());
            TextFault::new(Code::EncodingMalformed, offset, text)
        }));
    }
    Cow::into_owned(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> (String, Vec<TextFault>) {
        let decoded = decode(bytes.to_vec(), &Limits::default());
        (decoded.text, decoded.faults)
    }

    fn codes(faults: &[TextFault]) -> Vec<Code> {
        faults.iter().map(|fault| fault.code).collect()
    }

    fn with_declaration(label: &str, value: &[u8]) -> Vec<u8> {
        let head = format!("<?xml version=\"1.0\" encoding=\"{label}\"?><a name=\"");
        [head.as_bytes(), value, b"\"/>"].concat()
    }

    #[test]
    fn single_byte_encodings_follow_the_declaration() {
        let table: &[(&str, &[u8], &str)] = &[
            ("UTF-8", "Straße €".as_bytes(), "Straße €"),
            ("ISO-8859-1", b"Stra\xDFe \x80", "Straße \u{80}"),
            ("latin1", b"\xE9", "é"),
            ("ISO-8859-15", b"\xA4", "€"),
            ("windows-1252", b"\x80 \xDF", "€ ß"),
            ("windows-1250", b"\xEC", "ě"),
            ("windows-1251", b"\xC6", "Ж"),
            ("US-ASCII", b"plain", "plain"),
        ];
        for (label, bytes, expected) in table {
            let (text, faults) = read(&with_declaration(label, bytes));
            assert!(
                text.ends_with(&format!("<a name=\"{expected}\"/>")),
                "{label}: {text}"
            );
            assert!(
                codes(&faults)
                    .iter()
                    .all(|&code| code == Code::EncodingTranscoded),
                "{label}"
            );
            assert_eq!(
                faults.is_empty(),
                matches!(*label, "UTF-8" | "US-ASCII"),
                "{label}"
            );
        }
    }

    #[test]
    fn utf16_is_decoded_with_and_without_a_mark() {
        let text = "<?xml version=\"1.0\" encoding=\"UTF-16\"?><a name=\"ß😀\"/>";
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        for (mark, bytes) in [(&b"\xFF\xFE"[..], &little), (b"\xFE\xFF", &big)] {
            for bytes in [[mark, bytes].concat(), bytes.clone()] {
                let (read, faults) = read(&bytes);
                assert_eq!(read, text);
                assert_eq!(codes(&faults), [Code::EncodingTranscoded]);
            }
        }
        let (_, faults) = read(&[&b"\xFF\xFE"[..], &little, b"\x00\xD8"].concat());
        assert_eq!(
            codes(&faults),
            [Code::EncodingTranscoded, Code::EncodingMalformed]
        );
    }

    #[test]
    fn utf8_byte_order_mark_is_kept() {
        assert_eq!(
            read(b"\xEF\xBB\xBF<a/>"),
            ("\u{FEFF}<a/>".to_string(), vec![])
        );
        assert_eq!(read(b""), (String::new(), vec![]));
    }

    #[test]
    fn wrong_declarations_are_found_at_their_place() {
        let marked = [b"\xEF\xBB\xBF", &with_declaration("ISO-8859-1", b"x")[..]].concat();
        let cases: &[(&[u8], Code, &str, usize)] = &[
            (
                &with_declaration("UTF-16", b"x"),
                Code::EncodingMismatch,
                "single bytes",
                30,
            ),
            (
                &with_declaration("klingon", b"x"),
                Code::EncodingUnknown,
                "is not known",
                30,
            ),
            (&marked, Code::EncodingMismatch, "it is read as UTF-8", 33),
            (
                &with_declaration("UTF-8", b"Stra\xDFe"),
                Code::EncodingMalformed,
                "byte 0xDF is not valid UTF-8",
                51,
            ),
            (
                &with_declaration("US-ASCII", b"\xC3\xA9"),
                Code::EncodingMismatch,
                "US-ASCII",
                50,
            ),
            (
                b"<a>\xE2\x82</a>",
                Code::EncodingMalformed,
                "bytes 0xE2 0x82 are not valid UTF-8",
                3,
            ),
        ];
        for (bytes, code, part, offset) in cases {
            let (_, faults) = read(bytes);
            assert_eq!(codes(&faults), [*code], "{part}: {faults:?}");
            assert!(faults[0].text.contains(part), "{}", faults[0].text);
            assert_eq!(faults[0].offset, *offset, "{part}");
        }
        let marked: Vec<u8> = "\u{FEFF}<?xml version='1.0' encoding='UTF-8'?><a/>"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        let (text, faults) = read(&marked);
        assert!(text.ends_with("<a/>"));
        assert_eq!(
            codes(&faults),
            [Code::EncodingTranscoded, Code::EncodingMismatch]
        );
    }

    #[test]
    fn unreadable_bytes_keep_the_rest_readable() {
        let (text, faults) = read(b"<a n='\xFF'><b m='\xFF'/></a>");
        assert_eq!(text, "<a n='\u{FFFD}'><b m='\u{FFFD}'/></a>");
        assert_eq!(
            faults.iter().map(|fault| fault.offset).collect::<Vec<_>>(),
            [6, 17]
        );
        let (_, faults) = read(&[b"<a>", &[0xFF; 100][..]].concat());
        assert_eq!(faults.len(), NAMED_PLACES);
    }
}
