//! Dependencies of one job: the documents that it publishes on the bus, and every file that was looked up.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use qcbus_bus::MappedImage;
use qcbus_disk::foreign;
use qcbus_ingest::modular::ExpandedImage;
use qcbus_ingest::{Found, Limits, Look, Prepared, Source};
use qcbus_messages::path_text::{from_text, to_text};
use qcbus_messages::{Absence, Digest, DocId, DocumentRole, JobDocument, MissingDocument};
use qcbus_types::{Input, PrepareFailure, PreparedJob, Reading, Referenced, Stamp, digest_of};
use qcbus_watch::stamp::{from_content, is_racy, stamp_through_links};
use sha2::{Digest as _, Sha256};

use super::{Intake, JudgedAs, Manner, Published, judged_in_a_run};

/// Documents and inputs found for one job so far.
pub(super) struct Gathered {
    documents: Vec<JobDocument>,
    missing: Vec<MissingDocument>,
    /// For each document: whether the root depends on it.
    rests_on: Vec<bool>,
    inputs: BTreeMap<PathBuf, Input>,
    root: Vec<Input>,
    pub held: Vec<(DocId, MappedImage)>,
    /// Whether an input was so young when it was read that its stamp proves nothing.
    racy: bool,
    bytes: u64,
}

impl Gathered {
    pub fn new(path: &Path, root: &Published) -> Gathered {
        let mut gathered = Gathered {
            documents: Vec::new(),
            missing: Vec::new(),
            rests_on: Vec::new(),
            inputs: BTreeMap::new(),
            root: root.inputs.iter().take(1).cloned().collect(),
            held: Vec::new(),
            racy: false,
            bytes: 0,
        };
        gathered.push(path, DocumentRole::Root, 0, root);
        gathered
    }

    fn push(&mut self, path: &Path, role: DocumentRole, referred_at: u32, published: &Published) {
        self.documents.push(JobDocument {
            doc: published.doc,
            role,
            path: to_text(path),
            digest: published.digest,
            referred_at,
            links: Vec::new(),
        });
        for input in &published.inputs {
            self.inputs.insert(input.path.to_path_buf(), input.clone());
        }
        self.held.push((published.doc, published.held.clone()));
        self.racy |= published.racy;
        self.bytes += published.bytes;
    }

    /// Takes over the result of the walk.
    pub fn found(&mut self, found: Found) {
        self.missing = found.missing;
        self.rests_on = found.rests_on;
        for (document, links) in self.documents.iter_mut().zip(found.links) {
            document.links = links;
        }
    }

    /// Records an input that exists but could not be read. When it changes, the verdict becomes invalid.
    fn unread(&mut self, path: &Path, stamp: Option<Stamp>) {
        if let Some(stamp) = stamp {
            self.inputs
                .entry(path.to_path_buf())
                .or_insert_with(|| Input {
                    path: path.into(),
                    content: Reading::Unread(stamp),
                });
        }
    }

    /// Records a file that is no document, with the digest of its bytes. A file of more than `most` bytes counts as
    /// unread.
    fn attached(&mut self, path: &Path, most: u64) {
        let Some(stamp) = stamp_through_links(path) else {
            return self.absent(path);
        };
        let Ok(bytes) = foreign::read(path, most) else {
            return self.unread(path, Some(stamp));
        };
        let content = Reading::Read(stamp, digest_of(&bytes));
        let path = path.to_path_buf();
        self.inputs.entry(path).or_insert_with_key(|path| Input {
            path: path.as_path().into(),
            content,
        });
    }

    /// Records a file that was not found. When it appears, the verdict becomes invalid.
    fn absent(&mut self, path: &Path) {
        self.inputs
            .entry(path.to_path_buf())
            .or_insert_with(|| Input {
                path: path.into(),
                content: Reading::Absent,
            });
    }

    /// Records a directory listing. When a file appears or disappears in it, the verdict becomes invalid.
    fn listing(&mut self, directory: &Path) {
        let stamp = stamp_through_links(directory);
        let content = stamp.map_or(Reading::Absent, |stamp| {
            let digest =
                Sha256::digest(format!("{} {}", stamp.size, stamp.mtime_ns.unsigned_abs()));
            Reading::Read(stamp, Digest(digest.into()))
        });
        self.inputs.insert(
            directory.to_path_buf(),
            Input {
                path: directory.into(),
                content,
            },
        );
    }

    /// Returns the documents that the root depends on: those with a verdict of their own, and those that could have
    /// one. `judged_as` returns the path for a verdict. A member of an archive is judged with its archive.
    fn rests_on(&self, judged_as: &JudgedAs) -> (Vec<Referenced>, Vec<Referenced>) {
        let root = self.root.first().map(|input| &*input.path);
        let documents = self.documents.iter().zip(&self.rests_on);
        let (mut found, mut unwatched) = (Vec::new(), Vec::new());
        for (document, _) in documents.filter(|(_, rests)| **rests) {
            let file = qcbus_ingest::outer_file(&from_text(&document.path));
            let Some(digest) = self.inputs.get(&file).and_then(Input::digest) else {
                continue;
            };
            let (list, path) = match judged_as(&file) {
                Some(path) => (&mut found, path),
                None => match judged_in_a_run(&file) {
                    Some(path) => (&mut unwatched, path),
                    None => continue,
                },
            };
            let is_new = |it: &Referenced| it.path != path;
            if Some(&*path) != root && list.iter().all(is_new) {
                list.push(Referenced {
                    path,
                    digest,
                    role: document.role,
                    referred_at: document.referred_at,
                });
            }
        }
        (found, unwatched)
    }

    pub fn finish(&self, judged_as: &JudgedAs) -> PreparedJob {
        let root = self.root.first().map(|input| input.path.clone());
        let others = self
            .inputs
            .values()
            .filter(|input| Some(&input.path) != root.as_ref());
        let inputs: Vec<Input> = self.root.iter().chain(others).cloned().collect();
        let (rests_on, unwatched) = self.rests_on(judged_as);
        PreparedJob {
            basis: basis(&inputs),
            racy: self.racy || inputs.iter().any(was_racy),
            inputs,
            documents: self.documents.clone(),
            missing: self.missing.clone(),
            rests_on,
            unwatched,
            bytes: self.bytes,
        }
    }
}

/// Returns the digest over the paths and contents of all inputs.
fn basis(inputs: &[Input]) -> Digest {
    let mut hash = Sha256::new();
    for input in inputs {
        hash.update(input.path.as_os_str().as_encoded_bytes());
        match input.content {
            Reading::Absent => hash.update([0, 0]),
            Reading::Unread(_) => {
                hash.update([0, 1]);
                hash.update([0; 32]);
            }
            Reading::Read(_, digest) => {
                hash.update([0, 1]);
                hash.update(digest.0);
            }
        }
    }
    Digest(hash.finalize().into())
}

/// Publishes the documents that a root refers to. Only the root's verdict depends on the outcome: a
/// failure of a document cannot make the root vanished or unreadable.
pub(super) struct Links<'i> {
    pub intake: &'i Intake,
    pub manner: Manner,
    /// Documents must not be older than this time.
    pub asked: Instant,
    pub gathered: &'i mut Gathered,
}

impl Source for Links<'_> {
    type Document = Published;
    type Halt = PrepareFailure;

    fn fetch(&mut self, path: &Path) -> Result<Result<Published, Absence>, PrepareFailure> {
        // The stamp is taken first: if the file changes during the attempt, the stamp no longer matches.
        let before = stamp_through_links(path);
        let published = match is_member(path) {
            // A member comes from an archive that belongs to this job alone, or that was just read for it.
            true => self.intake.publish_fresh(&self.manner, path),
            false => self.intake.publish_shared(&self.manner, path, self.asked),
        };
        let absence = match published {
            Ok(published) => return Ok(Ok(published)),
            Err(failure) => failure.of_linked(path)?,
        };
        if absence != Absence::NotThere {
            self.gathered.unread(path, before);
        }
        Ok(Err(absence))
    }

    fn image(document: &Published) -> &[u8] {
        &document.held
    }

    fn listing(&mut self, archive: &Path) -> Result<Option<Published>, PrepareFailure> {
        match self.intake.publish_listing(&self.manner, archive) {
            Ok(published) => Ok(published),
            // Without the listing, the known part of the set is checked.
            Err(failure) => failure.of_linked(archive).map(|_| None),
        }
    }

    fn expanded(
        &self,
        expanded: &ExpandedImage<'_, '_>,
    ) -> Result<Result<Published, Absence>, PrepareFailure> {
        match self.intake.publish_expanded(expanded) {
            Ok(published) => Ok(Ok(published)),
            Err(failure) => {
                let path = Path::new("the expansion of a modular scenario");
                failure.of_linked(path).map(Err)
            }
        }
    }

    fn kept(&self, index: usize) -> &[u8] {
        let held = self.gathered.held.get(index + 1);
        held.map_or(&[], |(_, held)| held)
    }

    fn keep(&mut self, path: &Path, role: DocumentRole, referred_at: u32, document: Published) {
        self.gathered.push(path, role, referred_at, &document);
    }

    fn looked(&mut self, look: Look<'_>) {
        match look {
            Look::NotHad(path) => self.gathered.absent(path),
            Look::NotRead(path) => {
                self.gathered.unread(path, stamp_through_links(path));
                self.gathered.absent(path);
            }
            Look::Attached(path) => self.gathered.attached(path, self.intake.limits.max_file),
            Look::Listed(directory) => self.gathered.listing(directory),
        }
    }
}

/// Checks whether a path leads into an archive.
fn is_member(path: &Path) -> bool {
    let mut around = path
        .as_os_str()
        .as_encoded_bytes()
        .split(|&byte| byte == b'!');
    around.next().is_some_and(|file| file.ends_with(b".mosc")) && around.next().is_some()
}

/// Returns the input files of one image.
pub(super) fn inputs_of(prepared: &Prepared, limits: &Limits) -> Vec<Input> {
    prepared
        .files()
        .iter()
        .map(|file| Input {
            path: file.path.as_path().into(),
            content: match &file.content {
                Some(it) => Reading::Read(from_content(it), Digest(it.digest)),
                None => unreadable_now(&file.path, limits).map_or(Reading::Absent, Reading::Unread),
            },
        })
        .collect()
}

/// Returns the stamp of an input that is still unreadable. If it has become readable, it stays
/// recorded as missing. The change is noticed before the result is stored.
fn unreadable_now(path: &Path, limits: &Limits) -> Option<Stamp> {
    let stamp = stamp_through_links(path)?;
    let is_readable = stamp.size <= limits.max_file && foreign::open(path).is_ok();
    (!is_readable).then_some(stamp)
}

/// Checks whether a file changed so recently that its stamp proves nothing. Call this when the file is read.
pub(super) fn was_racy(input: &Input) -> bool {
    input.content.stamp().is_some_and(is_racy)
}

/// Checks whether a file is certainly unchanged since it was read.
pub(super) fn is_unchanged(input: &Input) -> bool {
    !was_racy(input) && has_its_stamps(input)
}

/// Checks whether the stamp of a file still matches. For a young file this proves nothing.
pub(super) fn has_its_stamps(input: &Input) -> bool {
    stamp_through_links(&input.path) == input.content.stamp()
}

/// Checks whether two readings give the same image: the same files with the same bytes, and all files could be read.
pub(super) fn same_bytes(one: &[Input], other: &[Input]) -> bool {
    let same = |(one, other): (&Input, &Input)| {
        one.path == other.path && one.digest().is_some() && one.digest() == other.digest()
    };
    one.len() == other.len() && one.iter().zip(other).all(same)
}
