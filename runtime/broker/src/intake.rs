//! From a path to published document images: the only place where the broker reads what it checks.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use qcbus_bus::{Documents, Held, Loan, LoanError};
use qcbus_document::{Document, FileKind};
use qcbus_ingest::{BuildError, IngestError, Limits, Look, Prepared, Source};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Absence, Digest, DocId, DocumentRole, JobDocument, JobId, MissingDocument};
use sha2::{Digest as _, Sha256};

use crate::core::{Input, PrepareFailure, PreparedJob, Stamp};
use crate::stages::reached;
use crate::stamp::{from_content, is_racy, stamp_of, stamp_through_links};

/// Reads files and publishes their images. Shared by the threads that do so.
pub struct Intake {
    documents: Documents,
    limits: Limits,
    roots: Vec<PathBuf>,
    max_documents: usize,
    next_doc: AtomicU64,
    cache: Mutex<Cache>,
    held: Mutex<HashMap<JobId, Vec<(DocId, Held)>>>,
    recent: Mutex<VecDeque<(JobId, DocId)>>,
}

impl std::fmt::Debug for Intake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Intake")
            .field("roots", &self.roots)
            .finish_non_exhaustive()
    }
}

/// A published document.
#[derive(Debug, Clone)]
struct Published {
    doc: DocId,
    held: Held,
    digest: Digest,
    inputs: Vec<Input>,
    bytes: u64,
}

/// Documents that are on the bus, so that a thousand scenarios on one map publish the map once.
#[derive(Debug, Default)]
struct Cache {
    by_path: HashMap<PathBuf, Published>,
    order: VecDeque<PathBuf>,
}

/// Shared documents (maps, catalogs) that are kept on the bus beyond the job that needed them.
const CACHED: usize = 8;

/// Ended jobs whose root document reporters may still find on the bus.
const RECENT: usize = 256;

impl Intake {
    /// An intake that publishes through `documents`. `roots` are the watched or given directories:
    /// includes and archives stay inside them.
    pub fn new(
        documents: Documents,
        limits: Limits,
        roots: Vec<PathBuf>,
        max_documents: usize,
    ) -> Intake {
        Intake {
            documents,
            limits,
            roots,
            max_documents,
            next_doc: AtomicU64::new(1),
            cache: Mutex::default(),
            held: Mutex::default(),
            recent: Mutex::default(),
        }
    }

    /// Reads a file with everything it refers to and publishes the images.
    ///
    /// # Errors
    /// See [`PrepareFailure`].
    pub fn prepare(&self, job: JobId, path: &Path) -> Result<Box<PreparedJob>, PrepareFailure> {
        let root = self
            .publish_fresh(path)
            .map_err(|failure| explained(failure, path))?;
        let mut gathered = Gathered::new(path, &root);
        self.gather(&root.held, &mut gathered)?;
        let prepared = gathered.finish();
        self.hold(job, gathered.held);
        Ok(Box::new(prepared))
    }

    /// Publishes a document of a job once more.
    pub fn publish_again(&self, job: JobId, doc: DocId) {
        let held = lock(&self.held).get(&job).and_then(|all| {
            all.iter()
                .find(|(it, _)| *it == doc)
                .map(|(_, held)| held.clone())
        });
        if let Some(held) = held
            && let Err(error) = self.documents.publish_again(&held)
        {
            // The peer asks again while it lacks the document.
            tracing::warn!("document {} cannot be published again: {error}", doc.0);
        }
    }

    /// The root image of a job, while it is held.
    pub fn root(&self, job: JobId) -> Option<Held> {
        lock(&self.held)
            .get(&job)
            .and_then(|all| all.first().map(|(_, held)| held.clone()))
    }

    /// The root document of a job that has ended lately; it may still be on the bus.
    pub fn recent_root(&self, job: JobId) -> Option<DocId> {
        lock(&self.recent)
            .iter()
            .find(|(it, _)| *it == job)
            .map(|(_, doc)| *doc)
    }

    /// Lets go of a job's documents.
    pub fn release(&self, job: JobId) {
        let held = lock(&self.held).remove(&job);
        if let Some((doc, _)) = held.as_ref().and_then(|all| all.first()) {
            let mut recent = lock(&self.recent);
            recent.push_back((job, *doc));
            if recent.len() > RECENT {
                recent.pop_front();
            }
        }
    }

    fn hold(&self, job: JobId, held: Vec<(DocId, Held)>) {
        lock(&self.held).insert(job, held);
    }

    /// Follows the root's references.
    fn gather(&self, root: &Held, gathered: &mut Gathered) -> Result<(), PrepareFailure> {
        let Ok(document) = Document::open(root) else {
            return Ok(());
        };
        let mut links = Links {
            intake: self,
            gathered,
        };
        let missing = qcbus_ingest::gather(&document, self.max_documents, &mut links)?;
        gathered.missing = missing;
        Ok(())
    }

    /// A map or catalog: from the cache as long as nothing has changed.
    fn publish_shared(&self, path: &Path) -> Result<Published, Failure> {
        let cached = lock(&self.cache).by_path.get(path).cloned();
        if let Some(published) = cached
            && published.inputs.iter().all(is_unchanged)
        {
            return Ok(published);
        }
        let published = self.publish_fresh(path)?;
        let mut cache = lock(&self.cache);
        if cache
            .by_path
            .insert(path.to_path_buf(), published.clone())
            .is_none()
        {
            cache.order.push_back(path.to_path_buf());
        }
        while cache.order.len() > CACHED {
            if let Some(oldest) = cache.order.pop_front() {
                cache.by_path.remove(&oldest);
            }
        }
        Ok(published)
    }

    fn publish_fresh(&self, path: &Path) -> Result<Published, Failure> {
        let prepared = qcbus_ingest::prepare(path, self.boundary(path), &self.limits)?;
        reached("read", path);
        let digest = Digest(prepared.digest());
        let inputs = inputs_of(&prepared, &self.limits);
        let kind = FileKind::of_path(path).unwrap_or(FileKind::Xosc);
        let (loan, used) = self.build(&prepared)?;
        reached("built", path);
        let doc = DocId(self.next_doc.fetch_add(1, Ordering::Relaxed));
        let held = loan
            .publish(doc, used, digest, kind)
            .map_err(|error| Failure::Publish(error.to_string()))?;
        reached("published", path);
        let bytes = inputs
            .iter()
            .filter(|it| it.digest().is_some())
            .filter_map(|it| it.content)
            .map(|(stamp, _)| stamp.size)
            .sum();
        Ok(Published {
            doc,
            held,
            digest,
            inputs,
            bytes,
        })
    }

    /// Parses straight into shared memory. The bound is an estimate that many resolved entities
    /// can exceed; then the builder says how much it takes.
    fn build(&self, prepared: &Prepared) -> Result<(Loan, usize), Failure> {
        let mut room = prepared.upper_bound();
        loop {
            let mut loan = self.documents.loan(room)?;
            match prepared.build_into(&mut loan) {
                Ok(used) => return Ok((loan, used)),
                Err(BuildError::SmallBuffer { needed, .. }) if needed > room => room = needed,
                Err(error) => return Err(Failure::Build(error.to_string())),
            }
        }
    }

    /// The directory that includes may not leave.
    fn boundary<'a>(&'a self, path: &'a Path) -> &'a Path {
        let root = self.roots.iter().filter(|root| path.starts_with(root));
        root.max_by_key(|root| root.as_os_str().len())
            .map_or_else(|| path.parent().unwrap_or(path), PathBuf::as_path)
    }
}

/// What the failure means for the root.
fn explained(failure: Failure, path: &Path) -> PrepareFailure {
    match failure {
        Failure::Ingest(IngestError::Missing { .. } | IngestError::Unsettled { .. }) => {
            match stamp_of(path) {
                Ok(None) => PrepareFailure::Vanished,
                // It is written to this very moment: it is read again shortly.
                _ => PrepareFailure::NoRoom(format!("{} changes while it is read", to_text(path))),
            }
        }
        Failure::Ingest(error) => unreadable(path, error.to_string()),
        Failure::Build(error) => unreadable(path, error),
        Failure::Loan(LoanError::TooLarge(_)) => {
            unreadable(path, format!("{} is too large for the bus", to_text(path)))
        }
        Failure::Loan(LoanError::Busy) => PrepareFailure::Busy,
        Failure::Loan(error) => unpublished(path, &error),
        Failure::Publish(error) => unpublished(path, &error),
    }
}

/// The bus has no room, or could not take it: nothing that is the file's fault, or that stays.
fn unpublished(path: &Path, error: &dyn std::fmt::Display) -> PrepareFailure {
    PrepareFailure::NoRoom(format!("cannot publish {}: {error}", to_text(path)))
}

/// The documents that a root refers to, on their way to the bus. Whatever becomes of them, it is the
/// root's verdict that is at stake: none of them can make the root vanish or unreadable.
struct Links<'i> {
    intake: &'i Intake,
    gathered: &'i mut Gathered,
}

impl Source for Links<'_> {
    type Document = Published;
    type Halt = PrepareFailure;

    fn fetch(&mut self, path: &Path) -> Result<Result<Published, Absence>, PrepareFailure> {
        // Looked at before: when it changes while it is tried, this stamp fits no more.
        let before = stamp_through_links(path);
        let absence = match self.intake.publish_shared(path) {
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
            Look::Listed(directory) => self.gathered.listing(directory),
        }
    }
}

#[derive(Debug)]
enum Failure {
    Ingest(IngestError),
    Build(String),
    /// The image is there, and the bus did not take it.
    Publish(String),
    Loan(LoanError),
}

impl Failure {
    /// What the failure means for a file that a root refers to: that it cannot be had, or that the
    /// whole is to be tried again.
    fn of_linked(self, path: &Path) -> Result<Absence, PrepareFailure> {
        match self {
            Failure::Loan(LoanError::TooLarge(_)) => Ok(Absence::TooLarge {
                why: "it does not fit on the bus".to_owned(),
            }),
            Failure::Loan(LoanError::Busy) => Err(PrepareFailure::Busy),
            Failure::Loan(error) => Err(unpublished(path, &error)),
            Failure::Publish(error) => Err(unpublished(path, &error)),
            // It is written to this very moment: the whole is read again shortly.
            Failure::Ingest(error @ IngestError::Unsettled { .. }) => {
                Err(PrepareFailure::NoRoom(error.to_string()))
            }
            Failure::Ingest(error) => Ok(error.to_absence()),
            Failure::Build(why) => Ok(Absence::Unreadable { why }),
        }
    }
}

impl From<IngestError> for Failure {
    fn from(error: IngestError) -> Self {
        Failure::Ingest(error)
    }
}

impl From<LoanError> for Failure {
    fn from(error: LoanError) -> Self {
        Failure::Loan(error)
    }
}

/// What has been found for one job so far.
struct Gathered {
    documents: Vec<JobDocument>,
    missing: Vec<MissingDocument>,
    inputs: BTreeMap<PathBuf, Input>,
    root: Vec<Input>,
    held: Vec<(DocId, Held)>,
    bytes: u64,
}

impl Gathered {
    fn new(path: &Path, root: &Published) -> Gathered {
        let mut gathered = Gathered {
            documents: Vec::new(),
            missing: Vec::new(),
            inputs: BTreeMap::new(),
            root: root.inputs.iter().take(1).cloned().collect(),
            held: Vec::new(),
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
        });
        for input in &published.inputs {
            self.inputs.insert(input.path.to_path_buf(), input.clone());
        }
        self.held.push((published.doc, published.held.clone()));
        self.bytes += published.bytes;
    }

    /// Something that is there and could not be had: when it changes, the verdict is void.
    fn unread(&mut self, path: &Path, stamp: Option<Stamp>) {
        if let Some(stamp) = stamp {
            self.inputs
                .entry(path.to_path_buf())
                .or_insert_with(|| Input {
                    path: path.into(),
                    content: Some((stamp, Input::UNREAD)),
                });
        }
    }

    /// A file that was looked for and not found: when it appears, the verdict is void.
    fn absent(&mut self, path: &Path) {
        self.inputs
            .entry(path.to_path_buf())
            .or_insert_with(|| Input {
                path: path.into(),
                content: None,
            });
    }

    /// A directory whose files count: when one comes or goes, the verdict is void.
    fn listing(&mut self, directory: &Path) {
        let stamp = stamp_through_links(directory);
        let content = stamp.map(|stamp| {
            let digest =
                Sha256::digest(format!("{} {}", stamp.size, stamp.mtime_ns.unsigned_abs()));
            (stamp, Digest(digest.into()))
        });
        self.inputs.insert(
            directory.to_path_buf(),
            Input {
                path: directory.into(),
                content,
            },
        );
    }

    fn finish(&self) -> PreparedJob {
        let root = self.root.first().map(|input| input.path.clone());
        let others = self
            .inputs
            .values()
            .filter(|input| Some(&input.path) != root.as_ref());
        let inputs: Vec<Input> = self.root.iter().chain(others).cloned().collect();
        PreparedJob {
            basis: basis(&inputs),
            racy: inputs
                .iter()
                .any(|input| input.content.is_some_and(|(stamp, _)| is_racy(stamp))),
            inputs,
            documents: self.documents.clone(),
            missing: self.missing.clone(),
            bytes: self.bytes,
        }
    }
}

/// Digest over the paths and contents of all inputs.
fn basis(inputs: &[Input]) -> Digest {
    let mut hash = Sha256::new();
    for input in inputs {
        hash.update(input.path.as_os_str().as_encoded_bytes());
        match input.content {
            Some((_, digest)) => {
                hash.update([0, 1]);
                hash.update(digest.0);
            }
            None => hash.update([0, 0]),
        }
    }
    Digest(hash.finalize().into())
}

fn inputs_of(prepared: &Prepared, limits: &Limits) -> Vec<Input> {
    prepared
        .files()
        .iter()
        .map(|file| Input {
            path: file.path.as_path().into(),
            content: match &file.content {
                Some(it) => Some((from_content(it), Digest(it.digest))),
                None => unreadable_now(&file.path, limits).map(|stamp| (stamp, Input::UNREAD)),
            },
        })
        .collect()
}

/// The stamp of something that could not be read and still cannot. What can be read by now is
/// taken for missing, as it was; that it has come is noticed before the result is stored.
fn unreadable_now(path: &Path, limits: &Limits) -> Option<Stamp> {
    let stamp = stamp_through_links(path)?;
    let is_readable = std::fs::metadata(path).is_ok_and(|data| data.is_file())
        && stamp.size <= limits.max_file
        && File::open(path).is_ok();
    (!is_readable).then_some(stamp)
}

fn is_unchanged(input: &Input) -> bool {
    match input.content {
        Some((stamp, _)) => !is_racy(stamp) && stamp_through_links(&input.path) == Some(stamp),
        None => stamp_through_links(&input.path).is_none(),
    }
}

fn unreadable(path: &Path, reason: String) -> PrepareFailure {
    match stamp_of(path) {
        Ok(None) => PrepareFailure::Vanished,
        // What cannot even be looked at may be there.
        seen => PrepareFailure::Unreadable {
            reason,
            stamp: seen.ok().flatten(),
        },
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_becomes_of_a_linked_file_never_makes_the_root_vanish() {
        let path = Path::new("/farm/map.xodr");
        let of = |failure: Failure| failure.of_linked(path);
        let unsettled = IngestError::Unsettled {
            path: path.to_owned(),
            what: "was removed",
        };
        let again = of(unsettled.into());
        assert!(matches!(again, Err(PrepareFailure::NoRoom(_))), "{again:?}");
        let missing = IngestError::Missing {
            path: path.to_owned(),
        };
        assert_eq!(of(missing.into()), Ok(Absence::NotThere));
        let large = of(LoanError::TooLarge(1).into());
        assert!(matches!(large, Ok(Absence::TooLarge { .. })), "{large:?}");
    }

    #[test]
    fn what_the_bus_does_not_take_now_is_tried_again() {
        let path = Path::new("/farm/map.xodr");
        let refused = || Failure::Publish("no subscriber slot".to_owned());
        let linked = refused().of_linked(path);
        assert!(
            matches!(linked, Err(PrepareFailure::NoRoom(_))),
            "{linked:?}"
        );
        let root = explained(refused(), path);
        assert!(matches!(root, PrepareFailure::NoRoom(_)), "{root:?}");
    }
}
