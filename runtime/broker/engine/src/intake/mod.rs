//! Turns a path into published document images. Only this module reads the files that the broker checks.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use qcbus_bus::{Documents, Loan, LoanError, MappedImage};
use qcbus_disk::foreign;
use qcbus_document::{Document, FileKind};
use qcbus_environment::reached;
use qcbus_ingest::modular::{ExpandedImage, SearchPath};
use qcbus_ingest::{BuildError, Limits, Prepared, Reader, Walking};
use qcbus_messages::{Digest, DocId, JobId};
use qcbus_types::{Input, PrepareFailure, PreparedJob};
use qcbus_watch::is_excluded;

mod failure;
mod gathered;
mod shared;

use failure::{Failure, exact, explained};
use gathered::{Gathered, Links, inputs_of, same_bytes, was_racy};
use shared::Shared;

/// Reads files and publishes their images. The reading threads share it.
pub struct Intake {
    documents: Documents,
    limits: Limits,
    roots: Vec<PathBuf>,
    max_documents: usize,
    search: Mutex<Arc<SearchPath>>,
    judged_as: Box<JudgedAs>,
    next_doc: AtomicU64,
    shared: Shared,
    held: Mutex<HashMap<JobId, Vec<(DocId, MappedImage)>>>,
    recent: Mutex<VecDeque<(JobId, DocId)>>,
}

impl std::fmt::Debug for Intake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Intake")
            .field("roots", &self.roots)
            .finish_non_exhaustive()
    }
}

/// Function that returns the path under which a file gets a verdict of its own, or `None`.
pub type JudgedAs = dyn Fn(&Path) -> Option<Arc<Path>> + Send + Sync;

/// Returns the same in a run. A run judges all files that its files depend on, except excluded ones.
pub fn judged_in_a_run(path: &Path) -> Option<Arc<Path>> {
    let is_judged = |path: &Path| FileKind::of_path(path).is_some() && !is_excluded(path);
    if is_judged(path) {
        return Some(path.into());
    }
    let real = foreign::canonicalize(path).ok();
    real.filter(|it| is_judged(it)).map(Into::into)
}

/// Boundary for the includes of a job's files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Within {
    /// Files in the watched directory of the including file. Outside of all watched directories: files next to it.
    Watched,
    /// Files next to the including file, as if no directory were watched.
    Beside,
}

/// Reader and include boundary for the files of a job.
struct Manner {
    reader: RefCell<Reader>,
    within: Within,
}

/// A published document.
#[derive(Debug, Clone)]
struct Published {
    doc: DocId,
    held: MappedImage,
    digest: Digest,
    inputs: Vec<Input>,
    /// Whether an input was so young when it was read that its stamp proves nothing.
    racy: bool,
    bytes: u64,
}

/// Number of ended jobs with a root document that reporters may still find on the bus.
const RECENT: usize = 256;

impl Intake {
    /// Creates an intake that publishes through `documents`. `roots` are the watched or given
    /// directories: includes and archives stay inside them.
    pub fn new(
        documents: Documents,
        limits: Limits,
        roots: Vec<PathBuf>,
        max_documents: usize,
        judged_as: Box<JudgedAs>,
    ) -> Intake {
        Intake {
            documents,
            limits,
            roots,
            max_documents,
            search: Mutex::default(),
            judged_as,
            next_doc: AtomicU64::new(1),
            shared: Shared::default(),
            held: Mutex::default(),
            recent: Mutex::default(),
        }
    }

    /// Sets an additional search path for scenarios that other scenarios refer to.
    pub fn search_in(&self, search: Arc<SearchPath>) {
        *lock(&self.search) = search;
    }

    /// Reads a file with everything it refers to and publishes the images. No image is older than
    /// `asked`, the time at which the file appeared or was last requested.
    ///
    /// # Errors
    /// See [`PrepareFailure`].
    pub fn prepare(
        &self,
        job: JobId,
        path: &Path,
        asked: Instant,
        within: Within,
    ) -> Result<Box<PreparedJob>, PrepareFailure> {
        let _behalf = foreign::on_behalf_of(path);
        let reader = RefCell::new(Reader::new(self.limits));
        let manner = Manner { reader, within };
        let root = self
            .publish_fresh(&manner, path)
            .map_err(|failure| explained(failure, path))?;
        let mut gathered = Gathered::new(path, &root);
        self.gather(&root.held, manner, asked, &mut gathered)?;
        let prepared = gathered.finish(match within {
            Within::Watched => &*self.judged_as,
            Within::Beside => &judged_in_a_run,
        });
        reached("gathered", path);
        self.hold(job, gathered.held);
        Ok(Box::new(prepared))
    }

    /// Publishes a document of a job again.
    pub fn publish_again(&self, job: JobId, doc: DocId) {
        let held = lock(&self.held).get(&job).and_then(|all| {
            all.iter()
                .find(|(it, _)| *it == doc)
                .map(|(_, held)| held.clone())
        });
        if let Some(held) = held
            && let Err(error) = self.documents.publish_again(&held)
        {
            // The peer repeats its request while the document is missing.
            tracing::warn!("document {} cannot be published again: {error}", doc.0);
        }
    }

    /// Returns the root image of a job while it is held.
    pub fn root(&self, job: JobId) -> Option<MappedImage> {
        lock(&self.held)
            .get(&job)
            .and_then(|all| all.first().map(|(_, held)| held.clone()))
    }

    /// Returns all images of a job while they are held.
    pub fn images(&self, job: JobId) -> Vec<(DocId, MappedImage)> {
        lock(&self.held).get(&job).cloned().unwrap_or_default()
    }

    /// Returns the root document of a job that is being stored or ended recently. It may still be on the bus.
    pub fn recent_root(&self, job: JobId) -> Option<DocId> {
        let held = lock(&self.held)
            .get(&job)
            .and_then(|all| Some(all.first()?.0));
        if held.is_some() {
            return held;
        }
        lock(&self.recent)
            .iter()
            .find(|(it, _)| *it == job)
            .map(|(_, doc)| *doc)
    }

    /// Releases the documents of a job except the root.
    pub fn release_parts(&self, job: JobId) {
        if let Some(held) = lock(&self.held).get_mut(&job) {
            held.truncate(1);
        }
    }

    /// Releases the documents of a job.
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

    fn hold(&self, job: JobId, held: Vec<(DocId, MappedImage)>) {
        lock(&self.held).insert(job, held);
    }

    /// Follows the references of the root.
    fn gather(
        &self,
        root: &MappedImage,
        manner: Manner,
        asked: Instant,
        gathered: &mut Gathered,
    ) -> Result<(), PrepareFailure> {
        let Ok(document) = Document::open(root) else {
            return Ok(());
        };
        let mut links = Links {
            intake: self,
            manner,
            asked,
            gathered,
        };
        let search = lock(&self.search).clone();
        let walking = Walking {
            max_documents: self.max_documents,
            max_text: self.limits.max_archive,
            max_image: self.limits.max_image,
            search: &search,
        };
        let found = qcbus_ingest::gather(&document, &walking, &mut links)?;
        gathered.found(found);
        Ok(())
    }

    /// Publishes a map or catalog. The image on the bus is reused while the bytes are unchanged.
    fn publish_shared(
        &self,
        manner: &Manner,
        path: &Path,
        asked: Instant,
    ) -> Result<Published, Failure> {
        let boundary = self.boundary(path, manner.within);
        self.shared.get(path, boundary, asked, |before| {
            let prepared = self.read(manner, path)?;
            // The digest of a new document is computed while its image is built.
            let Some(before) = before else {
                return self.publish(path, &prepared);
            };
            let inputs = inputs_of(&prepared, &self.limits);
            if !same_bytes(&before.inputs, &inputs) {
                return self.publish(path, &prepared);
            }
            Ok(Published {
                racy: inputs.iter().any(was_racy),
                inputs,
                ..before.clone()
            })
        })
    }

    fn publish_fresh(&self, manner: &Manner, path: &Path) -> Result<Published, Failure> {
        let prepared = self.read(manner, path)?;
        self.publish(path, &prepared)
    }

    /// Publishes the listing of an archive.
    fn publish_listing(
        &self,
        manner: &Manner,
        archive: &Path,
    ) -> Result<Option<Published>, Failure> {
        let mut reader = manner.reader.borrow_mut();
        let listing = reader.listing(archive, &archive.join(".."))?;
        let Some(prepared) = listing else {
            return Ok(None);
        };
        self.publish(archive, &prepared).map(Some)
    }

    /// Publishes the expansion of a modular scenario. It has the same dependencies as its documents.
    fn publish_expanded(&self, expanded: &ExpandedImage<'_, '_>) -> Result<Published, Failure> {
        let mut loan = self.loan(expanded.upper_bound())?;
        let used = expanded
            .build_into(&mut loan)
            .map_err(|error| Failure::Build(error.to_string()))?;
        let digest = Digest(expanded.digest());
        self.give_out(loan, used, digest, FileKind::Xosc, Vec::new())
    }

    fn read(&self, manner: &Manner, path: &Path) -> Result<Prepared, Failure> {
        let boundary = self.boundary(path, manner.within);
        let prepared = manner.reader.borrow_mut().prepare(path, boundary)?;
        reached("read", path);
        Ok(prepared)
    }

    fn publish(&self, path: &Path, prepared: &Prepared) -> Result<Published, Failure> {
        let kind = FileKind::of_path(path).unwrap_or(FileKind::Xosc);
        let (loan, used) = self.build(prepared)?;
        reached("built", path);
        let inputs = inputs_of(prepared, &self.limits);
        let published = self.give_out(loan, used, Digest(prepared.digest()), kind, inputs)?;
        reached("published", path);
        Ok(published)
    }

    fn give_out(
        &self,
        loan: Loan,
        used: usize,
        digest: Digest,
        kind: FileKind,
        inputs: Vec<Input>,
    ) -> Result<Published, Failure> {
        let racy = inputs.iter().any(was_racy);
        let doc = DocId(self.next_doc.fetch_add(1, Ordering::Relaxed));
        let held = loan
            .publish(doc, used, digest, kind)
            .map_err(|error| Failure::Publish(error.to_string()))?;
        let bytes = inputs
            .iter()
            .filter_map(|it| it.content.read())
            .map(|(stamp, _)| stamp.size)
            .sum();
        Ok(Published {
            doc,
            held,
            digest,
            racy,
            inputs,
            bytes,
        })
    }

    /// Parses directly into shared memory. The upper bound is an estimate. It is often too large, which matters only
    /// when there is little room. Many resolved entities can exceed it; then the builder returns the exact size.
    fn build(&self, prepared: &Prepared) -> Result<(Loan, usize), Failure> {
        let mut room = prepared.upper_bound();
        loop {
            let mut loan = match self.loan(room) {
                Ok(loan) => loan,
                Err(error) => match exact(prepared, &error).filter(|exact| *exact < room) {
                    Some(exact) => {
                        room = exact;
                        continue;
                    }
                    None => return Err(error.into()),
                },
            };
            match prepared.build_into(&mut loan) {
                Ok(used) => return Ok((loan, used)),
                Err(BuildError::SmallBuffer { needed, .. }) if needed > room => room = needed,
                Err(error) => return Err(Failure::Build(error.to_string())),
            }
        }
    }

    /// Reserves room for an image. Cached images that no job uses are released if the room is needed.
    fn loan(&self, room: usize) -> Result<Loan, LoanError> {
        loop {
            match self.documents.loan(room) {
                Err(LoanError::Busy | LoanError::NoSpace { .. }) if self.let_one_go() => {}
                loan => return loan,
            }
        }
    }

    fn let_one_go(&self) -> bool {
        let held = lock(&self.held);
        let used: HashSet<DocId> = held.values().flatten().map(|(doc, _)| *doc).collect();
        drop(held);
        self.shared.make_room(|doc| used.contains(&doc))
    }

    /// Returns the directory that includes must not leave.
    fn boundary<'a>(&'a self, path: &'a Path, within: Within) -> &'a Path {
        let counts = |root: &&PathBuf| within == Within::Watched && path.starts_with(root);
        let root = self.roots.iter().filter(counts);
        root.max_by_key(|root| root.as_os_str().len())
            .map_or_else(|| path.parent().unwrap_or(path), PathBuf::as_path)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
