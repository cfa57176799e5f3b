//! The files of a job with exactly the bytes on disk.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use qcbus_document::{FaultCode, Suffix};
use qcbus_messages::DocumentRole;
use qcbus_messages::path_text::{from_text, split_archive};
use qcbus_sdk::Subject;
use sha2::{Digest as _, Sha256};

use crate::messages::{Bytes, Document};

/// Input for a runner: the files, and slices of the images with the bytes of those files that are
/// in the message.
pub(crate) type Files<'d> = (Vec<Document>, Vec<&'d [u8]>);

/// Returns the documents of a job without duplicates: first the checked file, then the files that
/// it refers to. Members of archives are left out, because no ASAM module reads archives.
///
/// # Errors
/// If the bytes of a file are not available, as text for the user.
pub(crate) fn of<'d>(subject: &Subject<'d>) -> Result<Files<'d>, String> {
    let is_file = |role: DocumentRole| {
        matches!(
            role,
            DocumentRole::Root | DocumentRole::Map | DocumentRole::Catalog | DocumentRole::Scenario
        )
    };
    let linked = subject.linked().iter().filter(|it| is_file(it.role));
    let documents = std::iter::once(subject.written()).chain(linked.map(|it| it.document));
    let mut known = BTreeSet::new();
    let (mut files, mut pieces) = (Vec::new(), Vec::new());
    for document in documents {
        for (number, source) in document.sources().enumerate() {
            if split_archive(source.path).is_some() {
                continue;
            }
            let path = plain(&from_text(source.path));
            if !path.is_absolute() {
                return Err(format!("`{}` is not an absolute path", source.path));
            }
            if !known.insert(path.clone()) {
                continue;
            }
            let text = document.source_bytes(&source);
            let digest = (number == 0).then(|| document.content_hash());
            let transcoded = document
                .faults()
                .any(|fault| fault.code == FaultCode::EncodingTranscoded);
            let is_root = files.is_empty();
            let unpacked = unpacked(&path).filter(|_| is_root && !transcoded);
            let (path, bytes, packed) = match unpacked {
                Some(unpacked) => (unpacked, Bytes::Here(text.len() as u64), Some(path)),
                None => {
                    let bytes = bytes_of(&path, text, digest, transcoded)?;
                    (path, bytes, None)
                }
            };
            if let Bytes::Here(_) = bytes {
                pieces.push(text);
            }
            files.push(Document {
                path,
                bytes,
                packed,
            });
        }
    }
    if files.is_empty() {
        return Err("the file is in an archive".to_owned());
    }
    Ok((files, pieces))
}

/// Returns the path that a packed file would have if it were unpacked. ASAM's modules cannot read
/// packed files. They would report that a valid packed file is not XML.
fn unpacked(path: &Path) -> Option<PathBuf> {
    let suffix = Suffix::of_path(path).filter(|it| it.packed)?;
    let name = path.file_name()?.to_str()?;
    let stem = name.get(..name.len() - suffix.text.len())?;
    Some(path.with_file_name(format!("{stem}.{}", suffix.kind.as_str())))
}

fn is_packed(path: &Path) -> bool {
    Suffix::of_path(path).is_some_and(|it| it.packed)
}

fn bytes_of(
    path: &Path,
    text: &[u8],
    digest: Option<[u8; 32]>,
    transcoded: bool,
) -> Result<Bytes, String> {
    let unverified = |why: &str| {
        let path = path.display();
        format!("the bytes of {path} cannot be verified: it is included, and {why}")
    };
    match digest {
        Some(digest) if <[u8; 32]>::from(Sha256::digest(text)) == digest => {
            Ok(Bytes::Here(text.len() as u64))
        }
        Some(digest) => Ok(Bytes::OnDisk(digest)),
        None if is_packed(path) => Err(unverified("packed")),
        None if transcoded => Err(unverified(
            "it or the file that includes it is not in UTF-8",
        )),
        None => Ok(Bytes::Here(text.len() as u64)),
    }
}

/// Returns the path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                plain.pop();
            }
            other => plain.push(other),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_file_gets_name_of_its_content() {
        let of = |path: &str| unpacked(Path::new(path));
        assert_eq!(of("/a/b.xodrz"), Some("/a/b.xodr".into()));
        assert_eq!(of("/a/B.XODRZ"), Some("/a/B.xodr".into()));
        assert_eq!(of("/a/b.xodr.gz"), Some("/a/b.xodr".into()));
        assert_eq!(of("/a/b.xodr"), None);
        assert_eq!(of("/a/b.xosc"), None);
    }
}
