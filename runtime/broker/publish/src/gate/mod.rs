//! The gate: a directory that contains accepted files only. Each file in it is complete and was judged with exactly
//! these bytes.
//!
//! A *publication* is an acceptance with the digests of all files that it depends on. A file is published if it has a
//! publication and its judged dependencies are published with the same bytes, too. A judged dependency lies below the
//! watched directories and gets its own verdict. Other dependencies (an included file, an ignored file) are published
//! with the file. The accepted file gets its name last and loses it first, so it is never there without its
//! dependencies. Only files that refer to each other appear one after the other.

mod contents;
mod publications;

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use qcbus_disk::{foreign, is_for_good, write_ahead};
use qcbus_environment::step;
use qcbus_messages::Digest;
use qcbus_messages::control::{GateStatus, HeldBack};
use qcbus_messages::path_text::to_text;
use qcbus_types::{Input, Judged, Reading, RestsOn, digest_of, leads_upwards};
use qcbus_watch::probes::Probes;
use qcbus_watch::stamp::is_listing;

use crate::directory_lock::{DirectoryLock, Purpose};
use crate::journal::Remembered;
use crate::outputs::Outputs;
use crate::result_paths::ResultPaths;

pub use contents::GateError;
use publications::{Copies, Need, Plan, Publication, PublicationState, Publications};

/// Treatment of an accepted file that depends on a file outside of the watched directories.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Outside {
    /// The file is published. The verdict file names the file outside.
    #[default]
    Name,
    /// The file is not published.
    Refuse,
}

/// Predicate: whether a file gets a verdict of its own.
pub type IsJudged = Box<dyn Fn(&Path) -> bool + Send + Sync>;

/// Function that shows a message to the user.
pub type Say = Box<dyn Fn(String) + Send + Sync>;

/// Options of a gate.
pub struct GateOptions {
    /// Directory of the gate.
    pub directory: PathBuf,
    /// Mapping from files to their places in the directory.
    pub paths: ResultPaths,
    /// Whether copies are flushed to the disk before they get their names.
    pub durable: bool,
    /// Treatment of accepted files that depend on files outside.
    pub outside: Outside,
    /// Maximum size of a file in bytes. A larger file is not the accepted one.
    pub max_file: u64,
    /// Probe threads that read the files.
    pub probes: Probes,
    /// Monitors the published files.
    pub outputs: Outputs,
    /// Predicate: whether a file gets a verdict of its own.
    pub is_judged: IsJudged,
    /// Function that shows a message to the user.
    pub say: Say,
}

/// The gate. The writer threads share it.
pub struct Gate {
    options: GateOptions,
    publications: Mutex<Publications>,
    lock: DirectoryLock,
}

impl fmt::Debug for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Gate")
            .field("directory", &self.options.directory)
            .finish_non_exhaustive()
    }
}

impl Gate {
    /// Locks the directory for the broker of an instance.
    ///
    /// # Errors
    /// See [`GateError`]. Each error names a fix.
    pub fn open(options: GateOptions, instance: &str) -> Result<Gate, GateError> {
        contents::refuse_foreign(&options.directory)?;
        let lock = DirectoryLock::take(&options.directory, Purpose::Gate, instance)?;
        let publications = Publications::new(
            options.directory.clone(),
            options.paths.clone(),
            options.outputs.clone(),
        );
        Ok(Gate {
            options,
            publications: Mutex::new(publications),
            lock,
        })
    }

    /// Makes sure that this broker owns the directory. Another program may have replaced it.
    fn hold(&self) -> io::Result<()> {
        if self.lock.is_in_place() {
            return Ok(());
        }
        if !self.lock.has_lost_its_file() {
            contents::refuse_foreign(&self.options.directory).map_err(io::Error::other)?;
        }
        self.lock.hold().map_err(io::Error::other)
    }

    /// Restores the marker file, by which a start recognises the gate, if only this file was removed.
    pub fn keep_its_file(&self) {
        if self.lock.has_lost_its_file() {
            // The next write into the directory reports the error.
            let _ = self.hold();
        }
    }

    /// Makes the directory agree with the journal: removes each file that belongs to no acceptance
    /// in it. Returns the accepted files that are not published. They have no publication, because
    /// the required set may have changed: [`Gate::accept`] publishes those with a verdict that
    /// still holds.
    ///
    /// # Errors
    /// When the directory cannot be read, or something in it cannot be removed.
    pub fn take_over(
        &self,
        state_of_publication: &[Remembered],
    ) -> Result<Vec<Arc<Path>>, GateError> {
        let taken = self.clear(state_of_publication);
        taken.map_err(|source| GateError::Contents {
            directory: self.options.directory.clone(),
            source,
        })
    }

    fn clear(&self, state_of_publication: &[Remembered]) -> io::Result<Vec<Arc<Path>>> {
        let mut publications = self.publications();
        for file in state_of_publication {
            if file.judged.is_accepted() {
                publications.insert(&file.path, self.publication(&file.judged));
            } else {
                publications.refuse(&file.path);
            }
        }
        let there = contents::files(&self.options.directory)?;
        let mut read = HashMap::new();
        let waiting = publications.take_over(|path, size, digest| {
            let place = self.place(path);
            let is_so_long = there.get(&place) == Some(&size);
            let now = || {
                *read
                    .entry(place)
                    .or_insert_with_key(|at| contents::digest_at(at, size))
            };
            is_so_long && now() == Some(digest)
        })?;
        contents::remove_others(&self.options.directory, &there, &publications.places())?;
        Ok(waiting)
    }

    /// Returns the place of a published file behind the gate.
    pub fn place(&self, path: &Path) -> PathBuf {
        self.options
            .directory
            .join(self.options.paths.relative(path))
    }

    /// Returns the files outside of the watched directories that a verdict depends on.
    pub fn outside<'i>(&self, inputs: &'i [Input]) -> Vec<&'i Path> {
        let files = inputs.iter().filter(|input| is_file(input));
        let outside = files.filter(|input| !self.options.paths.contains(&input.path));
        outside.map(|input| &*input.path).collect()
    }

    /// Removes an older version of a file before a new acceptance is written, with everything that
    /// depends on it.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn make_way(&self, path: &Arc<Path>, judged: &Judged) -> io::Result<()> {
        let publication = self.publication(judged);
        self.make_way_for(path, &publication).map(|_| ())
    }

    fn make_way_for(
        &self,
        path: &Arc<Path>,
        publication: &Publication,
    ) -> io::Result<MutexGuard<'_, Publications>> {
        self.hold()?;
        let mut publications = self.publications();
        let agrees = publications
            .get(path)
            .is_some_and(|there| there.agrees(publication));
        if !agrees || !publications.is_whole(path) {
            publications.revoke(path)?;
        }
        Ok(publications)
    }

    /// Accepts a file, and publishes it if everything that it needs is published. [`Gate::follow`]
    /// publishes the files that waited for it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn accept(&self, path: &Arc<Path>, judged: &Judged) -> io::Result<()> {
        let publication = self.publication(judged);
        let mut publications = self.make_way_for(path, &publication)?;
        if publications.get(path).is_none() {
            publications.insert(path, publication);
        }
        drop(publications);
        self.publish(path)
    }

    /// Removes a file before a verdict other than an acceptance is written, with everything that
    /// depends on it.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn refuse(&self, path: &Arc<Path>) -> io::Result<()> {
        self.hold()?;
        let mut publications = self.publications();
        publications.revoke(path)?;
        publications.refuse(path);
        let mut held: Vec<Arc<Path>> = Vec::new();
        for resting in publications.resting_on(path) {
            let publication = publications.get_mut(&resting);
            if let Some(publication) = publication.filter(|it| !it.told && it.refused.is_none()) {
                publication.told = true;
                held.push(resting);
            }
        }
        drop(publications);
        if let Some(text) = held_by(path, &held) {
            (self.options.say)(text);
        }
        Ok(())
    }

    /// Removes a file, with everything that depends on it, until it is accepted again.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn revoke(&self, path: &Arc<Path>) -> io::Result<()> {
        self.hold()?;
        self.publications().revoke(path)
    }

    /// Works as [`Gate::revoke`], for a file that no longer exists.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn forget(&self, path: &Arc<Path>) -> io::Result<()> {
        self.hold()?;
        let mut publications = self.publications();
        publications.forget(path);
        publications.revoke(path)
    }

    /// Publishes an accepted file if it is not published yet, and then all files that waited for
    /// it.
    ///
    /// # Errors
    /// When a file cannot be written now. Returns the first such file. All others were tried.
    pub fn follow(&self, path: &Arc<Path>) -> Result<(), (Arc<Path>, io::Error)> {
        let mut failed = None;
        let mut open = VecDeque::from([path.clone()]);
        while let Some(next) = open.pop_front() {
            if let Err(error) = self.publish(&next) {
                self.not_published(&next, error, &mut failed);
            }
            let publications = self.publications();
            if publications.is_published(&next) {
                let mut waiting = publications.resting_on(&next);
                waiting.retain(|it| !publications.is_published(it));
                open.extend(waiting);
            }
        }
        failed.map_or(Ok(()), Err)
    }

    /// Records a failed publication. A permanent error, such as an obstacle at the place, is not retried.
    fn not_published(
        &self,
        path: &Arc<Path>,
        error: io::Error,
        failed: &mut Option<(Arc<Path>, io::Error)>,
    ) {
        if !is_for_good(&error) {
            failed.get_or_insert((path.clone(), error));
            return;
        }
        let why = format!("it cannot be written to the gate: {error}");
        if let Some(publication) = self.publications().get_mut(path) {
            publication.refused = Some(why.clone());
            publication.told = true;
        }
        (self.options.say)(held(path, &why));
    }

    /// Returns the number of published files, and examples of accepted files that are not published.
    pub fn status(&self) -> GateStatus {
        let publications = self.publications();
        let mut status = GateStatus {
            directory: self.options.directory.clone(),
            ..GateStatus::default()
        };
        let mut held: Vec<&Arc<Path>> = Vec::new();
        for (path, publication) in publications.iter() {
            if publication.published {
                status.published += 1;
            } else {
                held.push(path);
            }
        }
        status.held_back = held.len() as u64;
        held.sort();
        for path in held.into_iter().take(SHOWN) {
            if let PublicationState::HeldBack { why, .. } = publications.state_of_publication(path)
            {
                let file = path.to_path_buf();
                status.examples.push(HeldBack { file, why });
            }
        }
        status
    }

    /// Publishes one file with everything that it needs, if this is allowed.
    fn publish(&self, path: &Arc<Path>) -> io::Result<()> {
        loop {
            // A lock guard in the scrutinee would live through the arms, so the value gets a name.
            let state_of_publication = self.publications().state_of_publication(path);
            let plan = match state_of_publication {
                PublicationState::Settled => return Ok(()),
                PublicationState::Ready(plan) => plan,
                PublicationState::HeldBack { why, lasting } => {
                    if lasting {
                        self.say_once(path, &why);
                    }
                    return Ok(());
                }
            };
            self.hold()?;
            // The lock is not held here, because copying takes time.
            let Some(copies) = self.copy(&plan)? else {
                return Ok(());
            };
            step("copied", path);
            // Otherwise the publications have changed meanwhile, and the loop starts again.
            if self.publications().publish(&plan, copies)? {
                return Ok(());
            }
        }
    }

    /// Returns the bytes of a file if they are the accepted ones.
    fn accepted(&self, path: &Arc<Path>, digest: Digest) -> io::Result<Option<Vec<u8>>> {
        let (path, most) = (path.clone(), self.options.max_file);
        let read = move || foreign::read(&path, most);
        let read = self.options.probes.within(read).and_then(|read| read);
        match read {
            Ok(bytes) => Ok((digest_of(&bytes) == digest).then_some(bytes)),
            // The file at this path is not the accepted one.
            Err(error) if is_of_the_path(&error) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Copies the accepted bytes. Returns `None` if a file has other bytes by now and gets its own verdict.
    fn copy(&self, plan: &Plan) -> io::Result<Option<Copies>> {
        let mut copies = Copies::new();
        for (path, digest) in &plan.lacking {
            let Some(bytes) = self.accepted(path, *digest)? else {
                return Ok(None);
            };
            // A hard link would show in-place changes of the file, so the bytes are copied.
            let place = self.publications().place(path);
            let copy = write_ahead(&place, &bytes, self.options.durable)?;
            copies.insert(path.clone(), (*digest, copy));
        }
        Ok(Some(copies))
    }

    fn say_once(&self, path: &Arc<Path>, why: &str) {
        let mut publications = self.publications();
        let publication = publications
            .get_mut(path)
            .filter(|publication| !publication.told);
        let Some(publication) = publication else {
            return;
        };
        publication.told = true;
        (self.options.say)(held(path, why));
    }

    /// Returns the publication of an acceptance.
    fn publication(&self, judged: &Judged) -> Publication {
        let needs = judged.inputs.iter().skip(1);
        let inside = |input: &&Input| self.options.paths.contains(&input.path);
        let need = |input: &Input| {
            let (stamp, digest) = input.content.read()?;
            Some(Need {
                path: input.path.clone(),
                digest,
                size: stamp.size,
                judged: (self.options.is_judged)(&input.path),
            })
        };
        // A file that was only searched, such as a scenario in a catalog directory, is not needed.
        let rests_on = judged.rests_on.as_ref();
        let is_needed = |need: &Need| {
            let named = |all: &Vec<RestsOn>| all.iter().any(|it| it.path == need.path);
            !need.judged || rests_on.is_none_or(named)
        };
        Publication {
            digest: judged.digest,
            size: size_of_root(judged),
            needs: needs
                .filter(|input| is_file(input))
                .filter(inside)
                .filter_map(need)
                .filter(is_needed)
                .collect(),
            refused: self.refusal(judged),
            published: false,
            told: false,
            serial: 0,
        }
    }

    /// Returns the reason why an accepted file can never be published in this version, or `None`.
    fn refusal(&self, judged: &Judged) -> Option<String> {
        let inputs = judged.inputs.iter();
        let mut unread = inputs.filter(|it| matches!(it.content, Reading::Unread(_)));
        if let Some(unread) = unread.find(|it| self.options.paths.contains(&it.path)) {
            let shown = to_text(&unread.path);
            return Some(format!("it depends on {shown}, which could not be read"));
        }
        let mut files = judged.inputs.iter().filter(|input| is_file(input));
        if let Some(upwards) = files.find(|it| leads_upwards(&it.path)) {
            let shown = to_text(&upwards.path);
            return Some(format!(
                "it depends on {shown}; published copies have no symbolic links, so `..` would lead to another \
                 place: refer to the file by a path without the link"
            ));
        }
        let outside = self.outside(&judged.inputs);
        let first = outside.first().map(|path| to_text(path));
        let first = first.filter(|_| self.options.outside == Outside::Refuse)?;
        Some(format!(
            "it depends on {first}, which is outside the watched directories (--gate-outside refuse)"
        ))
    }

    fn publications(&self) -> MutexGuard<'_, Publications> {
        self.publications
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Maximum number of files in a list of examples; there may be thousands.
const SHOWN: usize = 10;

fn is_of_the_path(error: &io::Error) -> bool {
    let gone = [io::ErrorKind::NotFound, io::ErrorKind::FileTooLarge];
    gone.contains(&error.kind()) || is_for_good(error)
}

fn size_of_root(judged: &Judged) -> u64 {
    let root = judged.inputs.first();
    let stamp = root.and_then(|root| root.content.stamp());
    stamp.map_or(0, |stamp| stamp.size)
}

/// Checks whether the input is a file that was read. Directories are listed, not read.
fn is_file(input: &Input) -> bool {
    matches!(input.content, Reading::Read(stamp, _) if !is_listing(&stamp))
}

fn held(path: &Path, why: &str) -> String {
    format!("{} is accepted but not published: {why}", to_text(path))
}

/// Returns one line for all files that a verdict holds back.
fn held_by(path: &Path, held: &[Arc<Path>]) -> Option<String> {
    let (first, others) = held.split_first()?;
    let others = match others.len() {
        0 => String::new(),
        count => format!(" and {count} more"),
    };
    Some(format!(
        "{}{others} not published: {} is not accepted",
        to_text(first),
        to_text(path)
    ))
}

#[cfg(test)]
mod tests;
