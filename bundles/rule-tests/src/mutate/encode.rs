//! Edits of the encoding and storage of a whole file.

use super::scan::lines;

/// Edit of a file's storage.
#[derive(Debug, Clone)]
pub enum Storage {
    Utf16 { big: bool },
    Latin1,
    Ascii,
    Mark,
    CrLf,
    Undeclare,
    Cut(usize),
}

const MARK: &[u8] = b"\xef\xbb\xbf";

impl Storage {
    pub fn parse(text: &str) -> Result<Storage, String> {
        let storage = match text {
            "encode UTF-16" => Storage::Utf16 { big: false },
            "encode UTF-16BE" => Storage::Utf16 { big: true },
            "encode ISO-8859-1" => Storage::Latin1,
            "encode US-ASCII" => Storage::Ascii,
            "bom" => Storage::Mark,
            "crlf" => Storage::CrLf,
            "undeclare" => Storage::Undeclare,
            _ => {
                let count = text.strip_prefix("cut ").and_then(|it| it.parse().ok());
                Storage::Cut(count.ok_or_else(|| format!("not an edit of a file: {text}"))?)
            }
        };
        Ok(storage)
    }

    pub fn apply(&self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let text = text(bytes)?;
        let changed = match self {
            Storage::Utf16 { big } => {
                let text = format!("\u{feff}{}", declared(text, "UTF-16"));
                let units = text.encode_utf16();
                let bytes = |it: u16| {
                    if *big {
                        it.to_be_bytes()
                    } else {
                        it.to_le_bytes()
                    }
                };
                units.flat_map(bytes).collect()
            }
            Storage::Latin1 => narrow(&declared(text, "ISO-8859-1"), 0xff)?,
            Storage::Ascii => narrow(&declared(text, "US-ASCII"), 0x7f)?,
            Storage::Mark => [MARK, text.as_bytes()].concat(),
            Storage::CrLf => text
                .replace("\r\n", "\n")
                .replace('\n', "\r\n")
                .into_bytes(),
            Storage::Undeclare => {
                let end = text.find("?>").ok_or("there is no XML declaration")? + 2;
                let gap = "\n".repeat(lines(&text[..end]));
                format!("{gap}{}", &text[end..]).into_bytes()
            }
            Storage::Cut(count) => {
                let all: Vec<&str> = text.split('\n').collect();
                let kept = all.len().checked_sub(*count);
                let kept = kept.ok_or("the file has fewer lines")?;
                all[..kept].join("\n").into_bytes()
            }
        };
        if changed == bytes {
            return Err(format!("the edit changes nothing: {self:?}"));
        }
        Ok(changed)
    }
}

/// Returns the text of a UTF-8 file without its byte order mark.
pub fn text(bytes: &[u8]) -> Result<&str, String> {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| error.to_string())
}

/// Returns the file with another text. A byte order mark stays.
pub fn with_text(bytes: &[u8], text: &str) -> Vec<u8> {
    let mark = if bytes.starts_with(MARK) { MARK } else { b"" };
    [mark, text.as_bytes()].concat()
}

fn declared(text: &str, encoding: &str) -> String {
    let declared = text
        .starts_with("<?xml")
        .then(|| text.split_once("?>"))
        .flatten();
    let rest = declared.map_or(text, |(_, rest)| rest);
    format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?>{rest}")
}

/// Encodes each character as one byte.
fn narrow(text: &str, largest: u8) -> Result<Vec<u8>, String> {
    let byte = |c: char| u8::try_from(c).ok().filter(|byte| *byte <= largest);
    let narrow = text.chars().map(|c| byte(c).ok_or(c));
    narrow
        .collect::<Result<_, char>>()
        .map_err(|c| format!("the encoding has no character {c}"))
}
