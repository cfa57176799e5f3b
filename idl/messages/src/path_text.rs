//! Conversion of paths to text. On disk a name is bytes; in messages, JSON and the journal it is
//! text.
//!
//! A path in UTF-8 is written unchanged, unless a character moves a cursor or begins a line. Others
//! are written as `bytes:` and the path. Invalid bytes, such characters and every `%` become `%`
//! and two hexadecimal digits per byte. The conversion is unique and reversible. No name can look
//! like a line of a report.

use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

use qcbus_document::FileKind;

use crate::shown::moves;

/// Returns the end of the archive's name in `archive.mosc!member`; `None` for a file outside of
/// archives. A `!` that does not follow an archive's name is an ordinary character.
pub fn end_of_archive(path: &[u8]) -> Option<usize> {
    let is_archive = |path: &[u8]| {
        FileKind::of_path(Path::new(std::ffi::OsStr::from_bytes(path))) == Some(FileKind::Mosc)
    };
    let mut marks = (0..path.len()).filter(|&at| path[at] == b'!');
    marks.find(|&at| is_archive(&path[..at]))
}

/// Returns the archive on disk and the member in it: `archive.mosc` and `folder/member` of
/// `archive.mosc!folder/member`.
pub fn split_archive(path: &str) -> Option<(&str, &str)> {
    let end = end_of_archive(path.as_bytes())?;
    Some((path.get(..end)?, path.get(end + 1..)?))
}

/// Returns the display name of a file: its name without the directories. For a member of an
/// archive, the name of the archive precedes it, `archive.mosc!folder/member`.
pub fn name_of(path: &str) -> &str {
    let file = split_archive(path).map_or(path, |(archive, _)| archive);
    file.rfind('/')
        .map_or(path, |at| path.get(at + 1..).unwrap_or(path))
}

/// Prefix of the text of a path that cannot be written unchanged.
const ESCAPED: &str = "bytes:";

/// Returns the text of a path.
pub fn to_text(path: &Path) -> String {
    // An unescaped path with the prefix of an escaped one would be ambiguous.
    let plain = |text: &&str| !text.starts_with(ESCAPED) && !text.chars().any(moves);
    if let Some(plain) = path.to_str().filter(plain) {
        return plain.to_owned();
    }
    let mut text = ESCAPED.to_owned();
    for chunk in path.as_os_str().as_bytes().utf8_chunks() {
        for c in chunk.valid().chars() {
            if c == '%' || moves(c) {
                escape(c.encode_utf8(&mut [0; 4]).as_bytes(), &mut text);
            } else {
                text.push(c);
            }
        }
        escape(chunk.invalid(), &mut text);
    }
    text
}

/// Returns the path relative to the current directory if it lies below it, for people.
pub fn relative(path: &Path) -> &Path {
    let here = std::env::current_dir().ok();
    let below = here.and_then(|here| path.strip_prefix(here).ok());
    below
        .filter(|it| !it.as_os_str().is_empty())
        .unwrap_or(path)
}

fn escape(bytes: &[u8], text: &mut String) {
    for byte in bytes {
        text.push_str(&format!("%{byte:02X}"));
    }
}

/// Returns the path of a text. Text that is not an output of [`to_text`] is used unchanged.
pub fn from_text(text: &str) -> PathBuf {
    let unescaped = text.strip_prefix(ESCAPED).and_then(unescape);
    unescaped.map_or_else(
        || PathBuf::from(text),
        |bytes| PathBuf::from(OsString::from_vec(bytes)),
    )
}

fn unescape(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, tail)) = rest.split_first() {
        if byte != b'%' {
            bytes.push(byte);
            rest = tail;
            continue;
        }
        let (digits, tail) = tail.split_at_checked(2)?;
        let digits = std::str::from_utf8(digits).ok()?;
        // `from_str_radix` would accept a sign.
        if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return None;
        }
        bytes.push(u8::from_str_radix(digits, 16).ok()?);
        rest = tail;
    }
    Some(bytes)
}

/// Serde functions for `#[serde(with = "path_text::one")]`: a path as text.
pub mod one {
    use std::path::{Path, PathBuf};

    use serde::{Deserialize, Deserializer, Serializer};

    /// Writes the text of a path.
    ///
    /// # Errors
    /// The errors of the serializer.
    pub fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&super::to_text(path))
    }

    /// Reads a path from its text.
    ///
    /// # Errors
    /// The value is not a text.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PathBuf, D::Error> {
        String::deserialize(deserializer).map(|text| super::from_text(&text))
    }
}

/// Serde functions for `#[serde(with = "path_text::many")]`: paths as texts.
pub mod many {
    use std::path::PathBuf;

    use serde::{Deserialize, Deserializer, Serializer};

    /// Writes the texts of paths.
    ///
    /// # Errors
    /// The errors of the serializer.
    pub fn serialize<S: Serializer>(paths: &[PathBuf], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(paths.iter().map(|path| super::to_text(path)))
    }

    /// Reads paths from their texts.
    ///
    /// # Errors
    /// The value is not a list of texts.
    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<PathBuf>, D::Error> {
        let texts = Vec::<String>::deserialize(deserializer)?;
        Ok(texts.iter().map(|text| super::from_text(text)).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn archive_member_is_named_by_archive_and_full_name() {
        for (path, name) in [
            ("/a/b.xosc", "b.xosc"),
            ("/a/x.mosc!lib/b.xosc", "x.mosc!lib/b.xosc"),
            ("/a/X.MOSC!lib/b.xosc", "X.MOSC!lib/b.xosc"),
            ("/oh!/x.mosc!y.mosc!b.xosc", "x.mosc!y.mosc!b.xosc"),
            ("/oh!/b.xosc", "b.xosc"),
            ("b.xosc", "b.xosc"),
            ("", ""),
        ] {
            assert_eq!(name_of(path), name);
        }
    }

    fn path(bytes: &[u8]) -> PathBuf {
        PathBuf::from(OsString::from_vec(bytes.to_vec()))
    }

    #[test]
    fn path_text_keeps_utf8_and_escapes_other_bytes() {
        let cases: [(&[u8], &str); 9] = [
            (b"/farm/a.xodr", "/farm/a.xodr"),
            (
                "/farm/straße 100%.xodr".as_bytes(),
                "/farm/straße 100%.xodr",
            ),
            (b"/farm/stra\xDFe.xodr", "bytes:/farm/stra%DFe.xodr"),
            (b"/farm/\xFF%DF.xodr", "bytes:/farm/%FF%25DF.xodr"),
            (b"bytes:a", "bytes:bytes:a"),
            (b"a: accepted\nb.xodr", "bytes:a: accepted%0Ab.xodr"),
            (b"\x1b[2Ka.xodr", "bytes:%1B[2Ka.xodr"),
            ("\u{202e}a".as_bytes(), "bytes:%E2%80%AEa"),
            (b"", ""),
        ];
        for (bytes, text) in cases {
            assert_eq!(to_text(&path(bytes)), text);
            assert_eq!(from_text(text), path(bytes));
        }
    }

    #[test]
    fn malformed_escapes_are_taken_as_plain_path() {
        for text in ["bytes:%", "bytes:%F", "bytes:%+1", "bytes:%ß", "%FF"] {
            assert_eq!(from_text(text), PathBuf::from(text));
        }
    }

    proptest! {
        #[test]
        fn every_path_round_trips_through_text(bytes in mostly_text()) {
            prop_assert_eq!(from_text(&to_text(&path(&bytes))), path(&bytes));
        }

        #[test]
        fn different_paths_have_different_texts(one in mostly_text(), other in mostly_text()) {
            let same = to_text(&path(&one)) == to_text(&path(&other));
            prop_assert_eq!(same, path(&one).as_os_str() == path(&other).as_os_str());
        }

        #[test]
        fn every_text_converts_to_stable_path(text in "(bytes:)?[%A-F0-9a-zß/]{0,12}") {
            let path = from_text(&text);
            prop_assert_eq!(from_text(&to_text(&path)), path);
        }
    }

    /// Generates names that combine escapes, their prefix and broken UTF-8.
    fn mostly_text() -> impl Strategy<Value = Vec<u8>> {
        let part = prop_oneof![
            Just(b"bytes:".to_vec()),
            Just(b"%DF".to_vec()),
            Just(b"%25".to_vec()),
            Just("ß".as_bytes().to_vec()),
            proptest::collection::vec(any::<u8>(), 1..4),
        ];
        proptest::collection::vec(part, 0..5).prop_map(|parts| parts.concat())
    }
}
