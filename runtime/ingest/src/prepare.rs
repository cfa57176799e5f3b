//! Turns a path into a [`Prepared`] document: reads, unpacks, decodes and follows includes.

use std::collections::HashMap;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_document::{FaultCode, FileKind, Suffix};
use qcbus_messages::path_text::end_of_archive;

use crate::archive::{Entry, MAIN_MEMBER, OpenArchive, is_zip};
use crate::decode::decode;
use crate::error::IngestError;
use crate::limits::Limits;
use crate::prepared::{NamedText, Prepared};
use crate::read::{FileStamp, RawFile, read_file, read_unhashed, stamp_of_bytes};
use crate::text_fault::TextFault;
use crate::unpack::{InflateError, gunzip, is_gzip};
use crate::xml::escape_into;
use crate::xml::{Include, Splice, SpliceKey, first_element, includes_of};

/// Reads a file and everything that belongs to its image. Includes must lie below `boundary`.
/// `path` may name a member of an archive as `archive.mosc!member`.
///
/// # Errors
/// If the file itself cannot be read, or an archive does not contain the member. Errors inside the
/// bytes or in an included file are faults of the image.
pub fn prepare(path: &Path, boundary: &Path, limits: &Limits) -> Result<Prepared, IngestError> {
    Reader::new(*limits).prepare(path, boundary)
}

/// Prepares bytes that are already in memory. It reads nothing from disk, so every include is a
/// fault.
pub fn prepare_bytes(path: &Path, bytes: Vec<u8>, limits: &Limits) -> Prepared {
    Reader::new(*limits).prepare_bytes(path, bytes)
}

/// File size from which the digest is computed in parallel with the image. Starting a thread costs
/// as much as hashing 100 KB.
const LARGE: usize = 1 << 20;

/// Reads files for one set of documents. An archive is read and checked once, for any number of its
/// members in the set.
pub struct Reader {
    limits: Limits,
    /// Opened archives by path. For an archive within another one the path is `archive!member`.
    archives: HashMap<PathBuf, (FileStamp, OpenArchive)>,
    /// Number of unpacked archive bytes that may still be read.
    left: u64,
}

impl Reader {
    /// Creates a reader without opened archives.
    pub fn new(limits: Limits) -> Reader {
        Reader {
            limits,
            archives: HashMap::new(),
            left: limits.max_archive,
        }
    }

    /// See [`prepare`].
    ///
    /// # Errors
    /// As [`prepare`].
    pub fn prepare(&mut self, path: &Path, boundary: &Path) -> Result<Prepared, IngestError> {
        let (file, members) = split_members(path);
        let (stamp, root, hashed) = match self.archives.get(&file) {
            Some((stamp, _)) => {
                let stamp = stamp.clone();
                let root = self.open_archive(&stamp.path, &members);
                (stamp, root, true)
            }
            None => self.read(&file, &members)?,
        };
        let asked = members.iter().any(|member| !member.is_empty());
        // An existing archive without a main scenario is not a missing file.
        let is_there = root.path.as_os_str().len() > path.as_os_str().len();
        let is_member_missing = |fault: &TextFault| fault.code == FaultCode::ArchiveMemberMissing;
        if asked && !is_there && root.faults.iter().any(is_member_missing) {
            return Err(IngestError::Missing {
                path: path.to_path_buf(),
            });
        }
        let boundary = std::path::absolute(boundary).unwrap_or_else(|_| boundary.to_path_buf());
        Ok(assemble(stamp, root, hashed, Some(&boundary), &self.limits))
    }

    /// Reads a file and opens it. For a large file, whose text is identical to its bytes, the
    /// digest may be computed later. The flag says whether the digest is already known.
    fn read(
        &mut self,
        file: &Path,
        members: &[String],
    ) -> Result<(FileStamp, NamedText, bool), IngestError> {
        let mut raw = read_unhashed(file, &self.limits)?;
        let later = raw.bytes.len() >= LARGE
            && FileKind::of_path(file) != Some(FileKind::Mosc)
            && !is_gzip(&raw.bytes)
            && !is_zip(&raw.bytes);
        if !later {
            raw.hash();
        }
        let RawFile { bytes, mut stamp } = raw;
        let mut root = self.open(&stamp, bytes, members);
        let source = root.source.take().filter(|_| later);
        if let Some(source) = &source {
            stamp.hash(source);
        }
        Ok((stamp, root, !later || source.is_some()))
    }

    /// See [`prepare_bytes`]. Members of an archive can be prepared after it.
    pub fn prepare_bytes(&mut self, path: &Path, bytes: Vec<u8>) -> Prepared {
        let (file, members) = split_members(path);
        let stamp = stamp_of_bytes(&file, &bytes);
        let root = self.open(&stamp, bytes, &members);
        assemble(stamp, root, true, None, &self.limits)
    }

    /// Returns the listing of an archive as a document: see
    /// [`qcbus_messages::DocumentRole::Listing`]. Returns `None` if the archive cannot be read.
    ///
    /// # Errors
    /// As [`prepare`].
    pub fn listing(
        &mut self,
        archive: &Path,
        boundary: &Path,
    ) -> Result<Option<Prepared>, IngestError> {
        if !self.archives.contains_key(archive) {
            self.prepare(archive, boundary)?;
        }
        let Some((stamp, open)) = self.archives.get_mut(archive) else {
            return Ok(None);
        };
        if open.is_refused() {
            return Ok(None);
        }
        let text = listing(&open.entries());
        let root = NamedText {
            path: archive.to_path_buf(),
            text,
            faults: Vec::new(),
            source: None,
        };
        let stamp = stamp.clone();
        Ok(Some(assemble(stamp, root, true, None, &self.limits)))
    }

    /// Unpacks and decodes one file.
    fn open(&mut self, stamp: &FileStamp, bytes: Vec<u8>, members: &[String]) -> NamedText {
        let path = &stamp.path;
        if FileKind::of_path(path) != Some(FileKind::Mosc) {
            return open(path, bytes, &self.limits);
        }
        let archive = OpenArchive::new(&bytes.into(), &self.limits);
        self.archives.insert(path.clone(), (stamp.clone(), archive));
        self.open_archive(path, members)
    }

    /// Opens `main.xosc` of an opened archive, or the member that the path leads to, also through
    /// archives within archives.
    fn open_archive(&mut self, archive: &Path, members: &[String]) -> NamedText {
        let (name, rest) = match members.split_first() {
            Some((name, rest)) if !name.is_empty() => (name.as_str(), rest),
            _ => (MAIN_MEMBER, &[][..]),
        };
        let path = member_of(archive, name);
        let known = self.archives.contains_key(&path);
        let (stamp, open) = match self.archives.get_mut(archive) {
            Some((stamp, open)) => (stamp.clone(), open),
            None => return empty(path, Vec::new()),
        };
        if FileKind::of_path(Path::new(name)) == Some(FileKind::Mosc) {
            if !known {
                let member = open.member(name, &self.limits, &mut self.left);
                if !member.present {
                    return empty(path, member.faults);
                }
                let inner = OpenArchive::new(&member.bytes.into(), &self.limits);
                self.archives.insert(path.clone(), (stamp, inner));
            }
            return self.open_archive(&path, rest);
        }
        let mut member = open.member(name, &self.limits, &mut self.left);
        // The faults of an archive belong to its main scenario. They do not affect other members.
        if members.iter().all(String::is_empty) && !open.is_refused() {
            member.faults.splice(0..0, open.faults().iter().cloned());
        }
        if !member.present {
            return empty(path, member.faults);
        }
        decoded(path, member.bytes, member.faults, &self.limits)
    }
}

fn empty(path: PathBuf, faults: Vec<TextFault>) -> NamedText {
    NamedText {
        path,
        text: String::new(),
        faults,
        source: None,
    }
}

/// Returns the members of an archive as an XML document.
fn listing(entries: &[Entry]) -> String {
    let mut text = String::from("<Archive>\n");
    for entry in entries {
        let mut name = String::new();
        escape_into(&mut name, &entry.name, '"');
        let (size, crc32) = (entry.size, entry.crc32);
        text.push_str(&format!(
            "<Member name=\"{name}\" size=\"{size}\" crc32=\"{crc32:08x}\"/>\n"
        ));
    }
    text.push_str("</Archive>\n");
    text
}

/// Returns the file on disk that a path refers to. For a member such as
/// `archive.mosc!member!member` this is the archive.
pub fn outer_file(path: &Path) -> PathBuf {
    split_members(path).0
}

pub(crate) fn split_members(path: &Path) -> (PathBuf, Vec<String>) {
    // The file name may be invalid UTF-8. The names of members in the archive are valid UTF-8.
    let bytes = path.as_os_str().as_bytes();
    let Some((at, members)) = end_of_archive(bytes)
        .and_then(|at| Some((at, std::str::from_utf8(&bytes[at + 1..]).ok()?)))
    else {
        return (path.to_path_buf(), Vec::new());
    };
    let members = members.split('!').map(str::to_string).collect();
    (PathBuf::from(OsStr::from_bytes(&bytes[..at])), members)
}

/// Returns `archive.mosc!member`.
fn member_of(archive: &Path, name: &str) -> PathBuf {
    let mut path = archive.as_os_str().to_owned();
    path.push("!");
    path.push(name);
    PathBuf::from(path)
}

fn assemble(
    stamp: FileStamp,
    mut root: NamedText,
    hashed: bool,
    boundary: Option<&Path>,
    limits: &Limits,
) -> Prepared {
    root.source = None;
    let content = stamp.content.as_ref();
    let digest = hashed.then(|| content.map_or([0; 32], |content| content.digest));
    let mut reader = Includes {
        limits,
        boundary,
        known: HashMap::new(),
        files: vec![stamp],
        texts: vec![root],
    };
    let splices = reader.follow();
    Prepared::new(limits, digest, reader.files, reader.texts, splices)
}

/// Unpacks and decodes one file that is not a `.mosc` archive.
fn open(path: &Path, bytes: Vec<u8>, limits: &Limits) -> NamedText {
    let mut faults = Vec::new();
    let packed = is_gzip(&bytes);
    let bytes = if packed {
        inflate(path, &bytes, limits, &mut faults)
    } else {
        bytes
    };
    if is_zip(&bytes) {
        let text = "the file is a zip archive, although its name is that of an XML file; names of modular \
                    scenarios end in .mosc";
        faults.push(TextFault::new(FaultCode::ArchiveMalformed, 0, text));
        return empty(path.to_path_buf(), faults);
    }
    if promises_gzip(path) && !packed && !bytes.is_empty() {
        let text = "the name is that of a gzip file, but the content is not gzip";
        faults.push(TextFault::new(FaultCode::GzipMalformed, 0, text));
    }
    decoded(path.to_path_buf(), bytes, faults, limits)
}

fn decoded(
    path: PathBuf,
    bytes: Vec<u8>,
    mut faults: Vec<TextFault>,
    limits: &Limits,
) -> NamedText {
    let decoded = decode(bytes, limits);
    faults.extend(decoded.faults);
    faults.extend(forbidden_runs(&decoded.text));
    NamedText {
        path,
        text: decoded.text,
        faults,
        source: decoded.source,
    }
}

/// Returns faults for the characters that XML forbids. At most `MOST` places are reported, and a
/// run of equal characters is one place.
fn forbidden_runs(text: &str) -> Vec<TextFault> {
    const MOST: usize = 8;
    let mut runs: Vec<(usize, char, usize)> = Vec::new();
    for (at, c) in crate::xml::chars::forbidden(text) {
        let full = runs.len() == MOST;
        match runs.last_mut() {
            Some((from, same, count)) if *same == c && *from + *count * c.len_utf8() == at => {
                *count += 1;
            }
            _ if full => break,
            _ => runs.push((at, c, 1)),
        }
    }
    let faults = runs.into_iter().map(|(at, c, count)| {
        let c = u32::from(c);
        let text = match count {
            1 => format!("the character U+{c:04X} is not allowed in XML"),
            _ => format!("{count} characters U+{c:04X} in a row, which is not allowed in XML"),
        };
        TextFault::new(FaultCode::BadCharacter, at, text)
    });
    faults.collect()
}

fn promises_gzip(path: &Path) -> bool {
    let name = path.to_string_lossy().to_ascii_lowercase();
    name.ends_with(".gz") || Suffix::of_path(path).is_some_and(|suffix| suffix.packed)
}

fn inflate(path: &Path, packed: &[u8], limits: &Limits, faults: &mut Vec<TextFault>) -> Vec<u8> {
    let inflated = gunzip(packed, limits);
    if let Some(trouble) = inflated.trouble {
        let code = match &trouble {
            InflateError::Truncated { .. } => FaultCode::GzipTruncated,
            InflateError::Damaged { .. } => FaultCode::GzipMalformed,
            InflateError::Exceeded(exceeded) if exceeded.limit == "max_ratio" => {
                FaultCode::RatioLimit
            }
            InflateError::Exceeded(_) => FaultCode::UnpackedLimit,
        };
        faults.push(TextFault::new(code, 0, trouble.to_string()));
    } else if !promises_gzip(path) {
        let text =
            "the file is compressed with gzip, although its name is that of a plain XML file";
        faults.push(TextFault::new(FaultCode::EncodingTranscoded, 0, text));
    }
    inflated.bytes
}

/// Reads the files that `<include>` elements name, each file once.
struct Includes<'l> {
    limits: &'l Limits,
    boundary: Option<&'l Path>,
    /// Indices of the texts by canonical path.
    known: HashMap<PathBuf, usize>,
    files: Vec<FileStamp>,
    texts: Vec<NamedText>,
}

type Refusal = (FaultCode, String);

impl Includes<'_> {
    fn follow(&mut self) -> HashMap<SpliceKey, Splice> {
        let mut splices = HashMap::new();
        let is_map = first_element(&self.texts[0].text)
            .is_some_and(|root| root.rsplit(':').next() == Some("OpenDRIVE"));
        if !is_map {
            return splices;
        }
        if let Ok(root) = foreign::canonicalize(&self.texts[0].path) {
            self.known.insert(root, 0);
        }
        let mut number = 0;
        while number < self.texts.len() {
            for include in includes_of(&self.texts[number].text) {
                let splice = match self.resolve(number, &include) {
                    Ok(target) => Splice::File(target),
                    Err((code, text)) => Splice::Fault(code, text),
                };
                splices.insert((number, include.at), splice);
            }
            number += 1;
        }
        splices
    }

    fn resolve(&mut self, number: usize, include: &Include) -> Result<usize, Refusal> {
        let written = include
            .file
            .as_deref()
            .map(str::trim)
            .filter(|file| !file.is_empty());
        let Some(written) = written else {
            let text = "an include needs the attribute file with the path of a file".to_string();
            return Err((FaultCode::IncludeMalformed, text));
        };
        let Some(boundary) = self.boundary else {
            let text = format!("the include of {written} was not read: the document has no file");
            return Err((FaultCode::IncludeMissing, text));
        };
        if written.contains("://") {
            let text =
                format!("the include of {written} is not fetched; only files can be included");
            return Err((FaultCode::IncludeMalformed, text));
        }
        if names_directory(written) {
            let text = format!("the include of {written} names a directory, not a file");
            return Err((FaultCode::IncludeMissing, text));
        }
        let folder = self.texts[number]
            .path
            .parent()
            .unwrap_or(Path::new(""))
            .to_path_buf();
        let path = normal(&folder, &folder.join(written));
        let path = if !is_there(&path) && written.contains('\\') {
            normal(&folder, &folder.join(written.replace('\\', "/")))
        } else {
            path
        };
        inside(&path, &normal(boundary, boundary), written)?;
        if self.texts.len() > self.limits.max_includes as usize {
            let limit = self.limits.max_includes;
            let text = format!(
                "more than {limit} included files; raise the limit max_includes to read them"
            );
            return Err((FaultCode::IncludeLimit, text));
        }
        self.load(path, boundary, written)
    }

    fn load(&mut self, path: PathBuf, boundary: &Path, written: &str) -> Result<usize, Refusal> {
        let canonical = foreign::canonicalize(&path).unwrap_or_else(|_| path.clone());
        if let Ok(boundary) = foreign::canonicalize(boundary) {
            // A symbolic link inside the boundary may still lead out of it.
            if is_there(&path) {
                inside(&canonical, &boundary, written)?;
            }
        }
        if let Some(&number) = self.known.get(&canonical) {
            return Ok(number);
        }
        match read_file(&path, self.limits) {
            Ok(RawFile { bytes, stamp }) => {
                let mut text = open(&stamp.path, bytes, self.limits);
                text.source = None;
                self.files.push(stamp);
                self.texts.push(text);
                self.known.insert(canonical, self.texts.len() - 1);
                Ok(self.texts.len() - 1)
            }
            Err(error) => {
                if !self.files.iter().any(|stamp| stamp.path == path) {
                    self.files.push(FileStamp {
                        path,
                        content: None,
                    });
                }
                Err((
                    FaultCode::IncludeMissing,
                    format!("the included file is missing: failed to {error}"),
                ))
            }
        }
    }
}

fn is_there(path: &Path) -> bool {
    foreign::metadata(path).is_ok()
}

fn inside(path: &Path, boundary: &Path, written: &str) -> Result<(), Refusal> {
    if path.starts_with(boundary) {
        return Ok(());
    }
    let text = format!(
        "the include of {written} points outside {}; included files must be inside it",
        boundary.display()
    );
    Err((FaultCode::IncludeEscapes, text))
}

/// Returns a path without `.`, and without each `..` that follows a directory. A `..` after a link,
/// a file or a missing path stays. There, removing it would lead to another file than the system
/// and a simulator use. `base` is the directory of a file that was read. The directory may have
/// been moved since.
pub(crate) fn normal(base: &Path, path: &Path) -> PathBuf {
    let is_left = |normal: &Path| match foreign::symlink_metadata(normal) {
        Ok(data) => data.is_dir(),
        Err(error) => error.kind() == ErrorKind::NotFound && base.starts_with(normal),
    };
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if is_left(&normal) => _ = normal.pop(),
            part => normal.push(part),
        }
    }
    normal
}

/// Returns the absolute [`normal`] path.
pub(crate) fn absolute(base: &Path, path: &Path) -> PathBuf {
    let from_root = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    normal(&from_root(base), &from_root(path))
}

/// Checks whether the spelling of a path means a directory. For the system, `map.xodr/` is not a
/// file.
pub(crate) fn names_directory(text: &str) -> bool {
    matches!(text.rsplit(['/', '\\']).next(), Some("" | "." | ".."))
}
