//! Reads `.mosc`, a zip archive around a modular scenario. It is read in memory and never unpacked
//! to disk.

use std::collections::HashSet;
use std::io::{Cursor, Read};
use std::sync::Arc;

use qcbus_messages::shown;
use zip::ZipArchive;
use zip::result::ZipError;

use crate::limits::{Exceeded, Limits};
use crate::text_fault::{Code, TextFault};
use crate::unpack::inflated_cap;

/// Main member of a modular scenario.
pub(crate) const MAIN_MEMBER: &str = "main.xosc";

/// One member of an archive, with the faults found while reading it.
pub(crate) struct Member {
    /// The bytes. Empty when the member is missing or cannot be read.
    pub bytes: Vec<u8>,
    /// Whether the archive has the member.
    pub present: bool,
    pub faults: Vec<TextFault>,
}

/// Checks whether the bytes begin as a zip archive (one with members or one without).
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06")
}

type Archive = ZipArchive<Cursor<Arc<[u8]>>>;

/// An archive. Its directory is read and checked once for any number of members.
pub(crate) struct OpenArchive {
    /// `None` when the archive must not be read.
    zip: Option<Archive>,
    faults: Vec<TextFault>,
}

/// Directory entry of a member.
pub(crate) struct Entry {
    pub name: String,
    /// Unpacked size in bytes.
    pub size: u64,
    pub crc32: u32,
}

impl OpenArchive {
    /// Reads the directory. A name that leads out of the archive is refused for every requested
    /// member. The caps count over all members, so the order of reading cannot bypass them.
    pub fn new(packed: &Arc<[u8]>, limits: &Limits) -> OpenArchive {
        let mut faults = Vec::new();
        let mut zip = match ZipArchive::new(Cursor::new(packed.clone())) {
            Ok(zip) => zip,
            Err(error) => {
                faults.push(damaged(packed, &error));
                return OpenArchive { zip: None, faults };
            }
        };
        match check_directory(&mut zip, packed, limits, &mut faults) {
            Ok(()) => OpenArchive {
                zip: Some(zip),
                faults,
            },
            Err(fault) => {
                faults.push(fault);
                OpenArchive { zip: None, faults }
            }
        }
    }

    /// Reads one member. `left` is the number of unpacked bytes that may still be read, from this
    /// archive and from the archives around and within it.
    pub fn member(&mut self, name: &str, limits: &Limits, left: &mut u64) -> Member {
        let mut member = Member {
            bytes: Vec::new(),
            present: false,
            faults: Vec::new(),
        };
        let Some(zip) = &mut self.zip else {
            member.faults.clone_from(&self.faults);
            return member;
        };
        match read_checked(zip, name, limits, *left) {
            Ok(Some(bytes)) => {
                *left = left.saturating_sub(bytes.len() as u64);
                (member.bytes, member.present) = (bytes, true);
            }
            Ok(None) => member.faults.push(TextFault::new(
                Code::ArchiveMemberMissing,
                0,
                format!("the archive has no member {name}{}", similar(zip, name)),
            )),
            Err(fault) => {
                member.present = true;
                member.faults.push(fault);
            }
        }
        member
    }

    /// Returns the faults of the archive itself. Its members may still be intact.
    pub fn faults(&self) -> &[TextFault] {
        &self.faults
    }

    /// Checks whether the archive has been refused, so that no member can be read.
    pub fn is_refused(&self) -> bool {
        self.zip.is_none()
    }

    /// Returns the files in the archive in directory order, if their names can be read.
    pub fn entries(&mut self) -> Vec<Entry> {
        let Some(zip) = &mut self.zip else {
            return Vec::new();
        };
        let count = zip.len();
        let entry = |index| {
            let entry = zip.by_index_raw(index).ok()?;
            entry.is_file().then_some(())?;
            Some(Entry {
                name: entry.name().ok()?.into_owned(),
                size: entry.size(),
                crc32: entry.crc32(),
            })
        };
        (0..count).filter_map(entry).collect()
    }
}

/// Checks names, number and declared sizes. Declared values are trusted only as evidence against
/// the archive. The reader counts again.
fn check_directory(
    archive: &mut Archive,
    packed: &[u8],
    limits: &Limits,
    faults: &mut Vec<TextFault>,
) -> Result<(), TextFault> {
    let count = archive.len() as u64;
    Exceeded::check(
        "max_members",
        "members",
        count,
        u64::from(limits.max_members),
    )
    .map_err(|exceeded| {
        TextFault::new(Code::ArchiveLimit, 0, format!("the archive has {exceeded}"))
    })?;
    if let Some(total) = archive.decompressed_size() {
        let total = u64::try_from(total).unwrap_or(u64::MAX);
        Exceeded::check("max_archive", "unpacked bytes", total, limits.max_archive).map_err(
            |exceeded| {
                TextFault::new(
                    Code::UnpackedLimit,
                    0,
                    format!("the archive has {exceeded}"),
                )
            },
        )?;
    }
    if archive.has_duplicate_names() {
        let twice = twice(packed, archive.central_directory_start());
        let named = match twice.is_empty() {
            true => String::new(),
            false => format!(", `{}`", twice.join("`, `")),
        };
        let text = format!(
            "the archive has several members with the same name{named}; the last one is read"
        );
        faults.push(TextFault::new(Code::ArchiveDuplicate, 0, text));
    }
    let escaping: Vec<(Code, String)> = (0..archive.len())
        .filter_map(|index| {
            let entry = archive.by_index_raw(index).ok()?;
            let name = entry.name().ok()?.into_owned();
            match entry.is_symlink() {
                true => Some((
                    Code::ArchiveEscapes,
                    format!("the member `{}` is a symbolic link", shown::line(&name)),
                )),
                false => (!stays_inside(&name)).then(|| refused(&name)),
            }
        })
        .take(MOST_NAMED)
        .collect();
    for (code, what) in escaping {
        let text = format!("{what}; it is not read");
        faults.push(TextFault::new(code, 0, text));
    }
    Ok(())
}

/// Describes the fault in the name of a member.
fn refused(name: &str) -> (Code, String) {
    let name_shown = shown::line(name);
    match has_only_backslashes(name) {
        true => (
            Code::ArchiveBackslash,
            format!(
                "the member `{name_shown}` has a backslash in its name, but names in archives use `/` as \
                 separator"
            ),
        ),
        false => (
            Code::ArchiveEscapes,
            format!("the member `{name_shown}` points outside the archive"),
        ),
    }
}

/// Maximum number of members named for one fault of an archive.
const MOST_NAMED: usize = 4;

/// Returns the names that occur more than once in the directory. The library keeps one member of
/// each.
fn twice(packed: &[u8], directory: u64) -> Vec<String> {
    const ENTRY: &[u8] = b"PK\x01\x02";
    const HEAD: usize = 46;
    let mut rest = usize::try_from(directory)
        .ok()
        .and_then(|start| packed.get(start..))
        .unwrap_or(&[]);
    let mut seen = HashSet::new();
    let mut twice = Vec::new();
    while rest.starts_with(ENTRY) && twice.len() < MOST_NAMED {
        let len = |at: usize| {
            let bytes = rest.get(at..at + 2).and_then(|it| it.try_into().ok());
            usize::from(u16::from_le_bytes(bytes.unwrap_or([0; 2])))
        };
        let (name, more) = (len(28), len(30) + len(32));
        let Some(raw) = rest.get(HEAD..HEAD + name) else {
            break;
        };
        let text = String::from_utf8_lossy(raw).into_owned();
        if !seen.insert(raw) && !twice.contains(&text) {
            twice.push(text);
        }
        rest = rest.get(HEAD + name + more..).unwrap_or(&[]);
    }
    twice
}

/// Checks whether a member's name is a plain relative path: no root, drive, backslash, `..` or NUL.
pub fn stays_inside(name: &str) -> bool {
    !name.is_empty()
        && !name.starts_with('/')
        && !name.contains(['\\', '\0', ':'])
        && name.split('/').all(|part| part != "..")
}

/// Checks whether a name would be a plain relative path if `/` replaced its backslashes.
pub fn has_only_backslashes(name: &str) -> bool {
    name.contains('\\') && stays_inside(&name.replace('\\', "/"))
}

fn read_checked(
    archive: &mut Archive,
    name: &str,
    limits: &Limits,
    left: u64,
) -> Result<Option<Vec<u8>>, TextFault> {
    if !stays_inside(name) {
        return Ok(None);
    }
    let entry = match archive.by_name(name) {
        Ok(entry) => entry,
        Err(ZipError::FileNotFound) => return Ok(None),
        Err(error) => return Err(malformed(name, &error.to_string())),
    };
    if entry.is_symlink() || entry.is_dir() {
        return Ok(None);
    }
    let cap = inflated_cap(
        entry.compressed_size(),
        limits.max_archive.min(left),
        limits.max_ratio,
    );
    let mut bytes = Vec::new();
    let read = entry
        .take(cap.allowed.saturating_add(1))
        .read_to_end(&mut bytes);
    if bytes.len() as u64 > cap.allowed {
        let code = if cap.limit == "max_ratio" {
            Code::RatioLimit
        } else {
            Code::UnpackedLimit
        };
        let limit = if cap.limit == "max_ratio" {
            cap.limit
        } else {
            "max_archive"
        };
        // The message states the whole cap, because earlier members may have used part of it.
        let used = match limit {
            "max_archive" => limits.max_archive.saturating_sub(cap.allowed),
            _ => 0,
        };
        let exceeded = Exceeded {
            limit,
            found: cap.allowed.saturating_add(used).saturating_add(1),
            allowed: cap.allowed.saturating_add(used),
            ..cap
        };
        return Err(TextFault::new(
            code,
            0,
            format!("the member {name} has {exceeded}"),
        ));
    }
    read.map_err(|error| malformed(name, &error.to_string()))?;
    Ok(Some(bytes))
}

fn malformed(name: &str, reason: &str) -> TextFault {
    TextFault::new(
        Code::ArchiveMalformed,
        0,
        format!("the member {name} cannot be read: {reason}"),
    )
}

fn damaged(packed: &[u8], error: &ZipError) -> TextFault {
    // A local header without the directory at the end means that the archive is truncated.
    match is_zip(packed) {
        true => {
            let text = format!("the archive cannot be read: {error}");
            TextFault::new(Code::ArchiveTruncated, 0, text)
        }
        false => {
            let text = "the file is not a zip archive, although its name says so";
            TextFault::new(Code::ArchiveMalformed, 0, text)
        }
    }
}

/// Returns a hint for the most common mistake: the folder was packed instead of its content.
fn similar(archive: &Archive, name: &str) -> String {
    let base = name.rsplit('/').next().unwrap_or(name);
    let ends = |other: &str| {
        other
            .rsplit('/')
            .next()
            .is_some_and(|o| o.eq_ignore_ascii_case(base))
    };
    let found = archive
        .file_names()
        .filter_map(Result::ok)
        .find(|other| ends(other));
    found.map_or_else(String::new, |other| format!("; it has {other:?}"))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;

    fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in members {
            writer
                .start_file(*name, SimpleFileOptions::default())
                .unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn read(packed: &[u8], limits: Limits) -> (Vec<u8>, Vec<Code>, String) {
        let mut left = limits.max_archive;
        let mut archive = OpenArchive::new(&packed.into(), &limits);
        let mut member = archive.member(MAIN_MEMBER, &limits, &mut left);
        if !archive.is_refused() {
            member.faults.splice(0..0, archive.faults().iter().cloned());
        }
        let texts: Vec<&str> = member.faults.iter().map(|fault| &*fault.text).collect();
        let codes = member.faults.iter().map(|fault| fault.code).collect();
        (member.bytes, codes, texts.join("; "))
    }

    #[test]
    fn main_member_is_found() {
        let packed = zip(&[("lib.xosc", b"<a/>"), ("main.xosc", b"<OpenSCENARIO/>")]);
        let (bytes, codes, _) = read(&packed, Limits::default());
        assert_eq!((&bytes[..], &codes[..]), (&b"<OpenSCENARIO/>"[..], &[][..]));
        let (_, codes, text) = read(&zip(&[("x/Main.xosc", b"")]), Limits::default());
        assert_eq!(codes, [Code::ArchiveMemberMissing]);
        assert!(text.contains("it has \"x/Main.xosc\""), "{text}");
    }

    #[test]
    fn member_names_that_leave_the_archive_are_refused() {
        let names = [
            "../evil.xosc",
            "/etc/passwd",
            "a/../../b",
            "C:x",
            "a\\..\\b",
        ];
        for name in names {
            let (bytes, codes, _) = read(
                &zip(&[("main.xosc", b"<a/>"), (name, b"x")]),
                Limits::default(),
            );
            assert_eq!(bytes, b"<a/>", "{name}");
            assert_eq!(codes, [Code::ArchiveEscapes], "{name}");
        }
        assert!(stays_inside("a/b.xosc") && stays_inside("..a"));
    }

    #[test]
    fn exceeded_limits_are_named() {
        let big = vec![b' '; 4 << 20];
        let packed = zip(&[("main.xosc", &big), ("b", b""), ("c", b"")]);
        let limits = Limits::default();
        let cases = [
            (
                Limits {
                    max_members: 2,
                    ..limits
                },
                Code::ArchiveLimit,
                "3 members, 2 are allowed",
            ),
            (
                Limits {
                    max_archive: 1 << 20,
                    ..limits
                },
                Code::UnpackedLimit,
                "max_archive",
            ),
            (
                Limits {
                    max_ratio: 10,
                    ..limits
                },
                Code::RatioLimit,
                "max_ratio",
            ),
        ];
        for (limits, code, part) in cases {
            let (bytes, codes, text) = read(&packed, limits);
            assert!(bytes.is_empty());
            assert_eq!(codes, [code], "{text}");
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn duplicate_members_are_named() {
        let mut packed = zip(&[("main.xosc", b"<a/>"), ("a.xosc", b"1"), ("b.xosc", b"2")]);
        // The zip writer refuses duplicate names, so the test renames the member in the bytes.
        for at in 0..packed.len() - 6 {
            if packed[at..].starts_with(b"b.xosc") {
                packed[at] = b'a';
            }
        }
        let (bytes, codes, text) = read(&packed, Limits::default());
        assert_eq!(
            (&bytes[..], &codes[..]),
            (&b"<a/>"[..], &[Code::ArchiveDuplicate][..])
        );
        assert!(text.contains("the same name, `a.xosc`; the last"), "{text}");
    }

    #[test]
    fn damaged_archive_is_a_fault() {
        let packed = zip(&[("main.xosc", b"<a/>")]);
        let (_, codes, _) = read(&packed[..packed.len() - 10], Limits::default());
        assert_eq!(codes, [Code::ArchiveTruncated]);
        let (_, codes, _) = read(b"<OpenSCENARIO/>", Limits::default());
        assert_eq!(codes, [Code::ArchiveMalformed]);
        let mut flipped = zip(&[("main.xosc", b"<OpenSCENARIO></OpenSCENARIO>")]);
        flipped[45] ^= 0xFF;
        let (_, codes, _) = read(&flipped, Limits::default());
        assert_eq!(codes, [Code::ArchiveMalformed]);
    }
}
