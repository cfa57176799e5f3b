//! The gate: a directory in which accepted files lie, and nothing else. What lies there is complete
//! and judged as it lies there.
//!
//! A *claim* is an acceptance with the digests of all that it depends on. A file is published if it
//! has a claim, and each file below the watched directories that it depends on and that is judged
//! by itself has a claim on the same bytes and is published, too. What it depends on and nobody
//! judges by itself (an included file, one that is ignored) is published with it. The accepted
//! file gets its name last and loses it first, so that it is never there without what it needs.
//! Only files that refer to each other come one after the other.

mod contents;
mod publications;

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use qcbus_messages::Digest;
use qcbus_messages::control::{GateStatus, HeldBack};
use qcbus_messages::path_text::to_text;

use crate::core::{Input, Judged, Reading, RestsOn};
use crate::directory_lock::{DirectoryLock, Purpose};
use crate::environment::step;
use crate::journal::Remembered;
use crate::outputs::Outputs;
use crate::probes::Probes;
use crate::result_paths::{ResultPaths, leads_upwards};
use crate::stamp::is_listing;
use crate::store::digest_of;
use qcbus_disk::{foreign, is_for_good, write_ahead};

pub use contents::GateError;
use publications::{Copies, Need, Plan, Publication, PublicationState, Publications};

/// What becomes of an accepted file that depends on one outside of the watched directories.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Outside {
    /// It is published; the verdict file names the other.
    #[default]
    Name,
    /// It is not published.
    Refuse,
}

/// Whether a file gets a verdict of its own.
pub type IsJudged = Box<dyn Fn(&Path) -> bool + Send + Sync>;

/// Tells a person.
pub type Say = Box<dyn Fn(String) + Send + Sync>;

/// How a gate is to be.
pub struct GateOptions {
    /// The directory.
    pub directory: PathBuf,
    /// What lies where.
    pub paths: ResultPaths,
    /// Whether copies are on the disk before they get their names.
    pub durable: bool,
    /// What depends on files outside.
    pub outside: Outside,
    /// Most bytes of a file; one that has more is not what was accepted.
    pub max_file: u64,
    /// Who looks at files.
    pub probes: Probes,
    /// Keeps what lies there.
    pub outputs: Outputs,
    /// Whether a file gets a verdict of its own.
    pub is_judged: IsJudged,
    /// Tells a person.
    pub say: Say,
}

/// The gate. Shared by the threads that write.
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
    /// Takes the directory for the broker of an instance.
    ///
    /// # Errors
    /// See [`GateError`]; each says what to do.
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

    /// Makes sure that the directory that lies there is this broker's. Somebody may have put another one in its place.
    fn hold(&self) -> io::Result<()> {
        if self.lock.is_in_place() {
            return Ok(());
        }
        if !self.lock.has_lost_its_file() {
            contents::refuse_foreign(&self.options.directory).map_err(io::Error::other)?;
        }
        self.lock.hold().map_err(io::Error::other)
    }

    /// Puts the file by which a start knows the gate in its place again, if somebody has removed it alone.
    pub fn keep_its_file(&self) {
        if self.lock.has_lost_its_file() {
            // The next file that is written there says why it cannot be.
            let _ = self.hold();
        }
    }

    /// Brings the directory in agreement with the journal: what belongs to none of its acceptances is
    /// removed. Returns the accepted files that are not published. They have no claim, because others may
    /// have to judge them by now: [`Gate::accept`] publishes those whose verdict stands.
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

    /// Where a file lies behind the gate when it is published.
    pub fn place(&self, path: &Path) -> PathBuf {
        self.options
            .directory
            .join(self.options.paths.relative(path))
    }

    /// The files outside of the watched directories that a verdict depends on.
    pub fn outside<'i>(&self, inputs: &'i [Input]) -> Vec<&'i Path> {
        let files = inputs.iter().filter(|input| is_file(input));
        let outside = files.filter(|input| !self.options.paths.contains(&input.path));
        outside.map(|input| &*input.path).collect()
    }

    /// Before a new acceptance is written: what lies there of other bytes goes, with everything
    /// that rests on it.
    ///
    /// # Errors
    /// When something cannot be removed.
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

    /// A file is accepted: it is published if everything that it needs is. The files that waited
    /// for it come with [`Gate::follow`].
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn accept(&self, path: &Arc<Path>, judged: &Judged) -> io::Result<()> {
        let publication = self.publication(judged);
        let mut publications = self.make_way_for(path, &publication)?;
        if publications.get(path).is_none() {
            publications.insert(path, publication);
        }
        drop(publications);
        self.publish(path)
    }

    /// Before another verdict than an acceptance is written: the file goes, with everything that
    /// rests on it.
    ///
    /// # Errors
    /// When something cannot be removed.
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

    /// The file goes, with everything that rests on it, until it is accepted again.
    ///
    /// # Errors
    /// When something cannot be removed.
    pub fn revoke(&self, path: &Arc<Path>) -> io::Result<()> {
        self.hold()?;
        self.publications().revoke(path)
    }

    /// As [`Gate::revoke`] for a file that is no more.
    ///
    /// # Errors
    /// When something cannot be removed.
    pub fn forget(&self, path: &Arc<Path>) -> io::Result<()> {
        self.hold()?;
        let mut publications = self.publications();
        publications.forget(path);
        publications.revoke(path)
    }

    /// Publishes an accepted file if that has not been done, and then whatever waited for it.
    ///
    /// # Errors
    /// When something cannot be written now, with the first such file; all others were tried.
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

    /// No waiting brings a file to a place where something else is in the way.
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
        let why = format!("it cannot be written there: {error}");
        if let Some(publication) = self.publications().get_mut(path) {
            publication.refused = Some(why.clone());
            publication.told = true;
        }
        (self.options.say)(held(path, &why));
    }

    /// How many files are published, and which accepted ones are not.
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

    /// Publishes one file with what it needs, if it may be.
    fn publish(&self, path: &Arc<Path>) -> io::Result<()> {
        loop {
            // A name for it, because a lock in the scrutinee would be held in the arms.
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
            // Outside of the lock, because it takes its time.
            let Some(copies) = self.copy(&plan)? else {
                return Ok(());
            };
            step("copied", path);
            // Otherwise the claims have changed meanwhile, and it is looked at anew.
            if self.publications().publish(&plan, copies)? {
                return Ok(());
            }
        }
    }

    /// The bytes of a file, if they are those that were accepted.
    fn accepted(&self, path: &Arc<Path>, digest: Digest) -> io::Result<Option<Vec<u8>>> {
        let (path, most) = (path.clone(), self.options.max_file);
        let read = move || foreign::read(&path, most);
        let read = self.options.probes.within(read).and_then(|read| read);
        match read {
            Ok(bytes) => Ok((digest_of(&bytes) == digest).then_some(bytes)),
            // Something else lies there.
            Err(error) if is_of_the_path(&error) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The very bytes that were accepted; `None` when others are there by now. They get a verdict
    /// of their own.
    fn copy(&self, plan: &Plan) -> io::Result<Option<Copies>> {
        let mut copies = Copies::new();
        for (path, digest) in &plan.lacking {
            let Some(bytes) = self.accepted(path, *digest)? else {
                return Ok(None);
            };
            // A copy, not a link: a hard link would follow a writer who changes the file in place.
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

    /// What an acceptance claims.
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
        // A file that was only looked at, such as a scenario in a catalog directory, is needed by nobody.
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

    /// Why an acceptance does not lead behind the gate, whatever else comes.
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
                "it depends on {shown}; a published copy has no symbolic links, so `..` would lead \
                 elsewhere there: refer to the file by a path without the link"
            ));
        }
        let outside = self.outside(&judged.inputs);
        let first = outside.first().map(|path| to_text(path));
        let first = first.filter(|_| self.options.outside == Outside::Refuse)?;
        Some(format!(
            "it depends on {first}, which lies outside of the watched directories \
             (--gate-outside refuse)"
        ))
    }

    fn publications(&self) -> MutexGuard<'_, Publications> {
        self.publications
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Files that are named where there may be thousands.
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

/// Whether bytes of a file were read: directories are looked through, not read.
fn is_file(input: &Input) -> bool {
    matches!(input.content, Reading::Read(stamp, _) if !is_listing(&stamp))
}

fn held(path: &Path, why: &str) -> String {
    format!("{} is accepted and not published: {why}", to_text(path))
}

/// One line for all that a verdict keeps from being published.
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
