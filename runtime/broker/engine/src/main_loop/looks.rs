//! File lookups of the loop: it starts probes, because it must never wait for a disk.

use std::collections::{BTreeSet, HashMap};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_configuration::Fingerprint;
use qcbus_disk::foreign::{self, IoWatchdog, Overdue};
use qcbus_messages::JobId;
use qcbus_messages::control::{Response, ScratchStatus, Unseen};
use qcbus_messages::path_text::to_text;
use qcbus_publish::result_paths::ResultPaths;
use qcbus_types::{Event, Input, LostOutput, PrepareFailure, Stamp, Until};
use qcbus_watch::probes::{PATIENCE, Probes};
use qcbus_watch::stamp::{stamp_of, stamp_through_links};
use qcbus_watch::{
    FileLookup, NoFile, hidden_above, is_behind_a_link, is_left_alone, is_looked_at, look_at,
};
use tokio::sync::oneshot;

use super::Broker;

/// State of all file lookups and of the clients that wait for them.
pub(super) struct Looks {
    /// Monitors the threads that wait for a file.
    io_watchdog: Arc<IoWatchdog>,
    probes: Probes,
    /// Files that did not respond to the last access.
    hanging: BTreeSet<PathBuf>,
    /// Clients that wait for a file lookup, by the number of the probe.
    pending: HashMap<u64, Look>,
    /// Removed files that a client waits for. They are looked up once more.
    missed: HashMap<u64, Arc<Path>>,
    /// The probe that checks configuration, manifests and programs for changes.
    pub(super) changes: Option<u64>,
    pub(super) around: Around,
}

impl Default for Looks {
    fn default() -> Looks {
        let io_watchdog = Arc::new(IoWatchdog::default());
        Looks {
            probes: Probes::new(io_watchdog.clone(), PATIENCE),
            io_watchdog,
            hanging: BTreeSet::new(),
            pending: HashMap::new(),
            missed: HashMap::new(),
            changes: None,
            around: Around::default(),
        }
    }
}

impl Looks {
    /// Returns the probes for other parts of the broker.
    pub(super) fn probes(&self) -> Probes {
        self.probes.clone()
    }

    pub(super) fn io_watchdog(&self) -> Arc<IoWatchdog> {
        self.io_watchdog.clone()
    }

    pub(super) fn is_hanging(&self, path: &Path) -> bool {
        self.hanging.contains(path)
    }
}

/// A client that waits for the verdict on a file, and the file lookup for it.
pub(super) struct Look {
    pub file: PathBuf,
    pub until: Until,
    pub answer: oneshot::Sender<Response>,
    /// The path of the client was resolved to this file.
    pub is_led: bool,
}

/// A changed file. The stamp is `None` if the file was removed.
type Changed = (Arc<Path>, Option<Stamp>);

/// Result of a file lookup.
pub struct LookedUp {
    /// The watched file. An outside link to a watched file stands for that file.
    pub file: PathBuf,
    pub stamp: Option<Stamp>,
    /// Changed files that its verdict depends on.
    pub inputs: Vec<Changed>,
    /// Missing output files of it.
    pub lost: Vec<LostOutput>,
    /// Reason why it is not watched, or `None`.
    pub unwatched: Option<String>,
    /// Reason why it cannot be read now or soon, or `None`.
    pub hidden: Option<String>,
}

/// Result of a probe, with the number of the probe.
pub struct Looked {
    probe: u64,
    seen: Seen,
}

/// Environment of the broker, checked once a second for the status.
#[derive(Default)]
pub(super) struct Around {
    /// Description of the file that has replaced the running program.
    pub replaced: Option<String>,
    /// The state directory was removed or replaced.
    pub state_is_gone: bool,
    pub scratch: Option<ScratchStatus>,
}

pub(super) enum Seen {
    /// Present state of configuration, manifests, programs and the environment of the broker.
    Sources(Fingerprint, Around),
    /// The path stands for another file.
    Elsewhere(PathBuf),
    LookedUp(LookedUp),
    /// Present state of a file that was missing, and the changed files that its verdict depends on.
    Again {
        stamp: Option<Stamp>,
        inputs: Vec<Changed>,
    },
}

impl Broker {
    /// Starts a probe of a file that a client requests.
    pub(super) fn look_at(&mut self, look: Look) -> bool {
        let (file, is_led) = (look.file.clone(), look.is_led);
        let inputs = self.state.inputs_of(&file).into_iter().skip(1).collect();
        let (store, roots) = (self.store.clone(), self.options.roots.clone());
        self.send_probe(look, move || {
            if let Some(file) = meant(&file, &store.places, &roots).filter(|_| !is_led) {
                return Seen::Elsewhere(file);
            }
            let moved = moved(inputs);
            let (stamp, hidden) = match stamp_of(&file) {
                Ok(stamp) => (stamp, None),
                Err(error) => (None, is_there_to_stay(&error).then(|| hides(&file, &error))),
            };
            let unwatched = why_unwatched(&file, stamp, &store.places, &roots)
                .or_else(|| what_instead(&file, stamp, &roots));
            let lost = store.lost_outputs(&file.as_path().into());
            Seen::LookedUp(LookedUp {
                file,
                lost,
                stamp,
                inputs: moved,
                unwatched,
                hidden,
            })
        })
    }

    /// Looks up a removed file that a client waits for. It may exist again, and then the client
    /// must not receive its removal.
    pub(super) fn look_whether_it_is_back(&mut self, path: Arc<Path>) -> bool {
        let (at, roots) = (path.clone(), self.options.roots.clone());
        let inputs = self.state.inputs_of(&path).into_iter().skip(1).collect();
        let probe = self.probe(move || {
            let stamp = stamp_of(&at).ok().flatten();
            let stamp = stamp.filter(|_| is_looked_at(&roots, &at));
            let inputs = moved(inputs);
            Seen::Again { stamp, inputs }
        });
        match probe {
            Ok(probe) => {
                self.looks.missed.insert(probe, path);
                true
            }
            Err(_) => self.missed(path, None),
        }
    }

    fn missed(&mut self, path: Arc<Path>, stamp: Option<Stamp>) -> bool {
        let go_on = stamp.is_some() || self.handle(Event::Vanished { path: path.clone() });
        if let Some(watcher) = &self.watcher {
            // The watcher may have reported meanwhile that the file is back.
            if stamp.is_none() {
                watcher.forget(path.clone());
            }
            watcher.look(path);
        }
        go_on
    }

    /// Starts a probe that sends its result to the loop. Returns its number.
    pub(super) fn probe(&self, see: impl FnOnce() -> Seen + Send + 'static) -> io::Result<u64> {
        let (tell, told) = std::sync::mpsc::channel();
        let inbox = self.inbox.looked_in.clone();
        let sent = self.looks.probes.send(move || {
            let seen = see();
            // The number follows right after the start. A failed send is ignored, because the loop has ended.
            if let Ok(probe) = told.recv() {
                let _ = inbox.send(Looked { probe, seen });
            }
        })?;
        let _ = tell.send(sent);
        Ok(sent)
    }

    fn send_probe(&mut self, look: Look, see: impl FnOnce() -> Seen + Send + 'static) -> bool {
        match self.probe(see) {
            Ok(probe) => {
                self.looks.pending.insert(probe, look);
            }
            Err(error) => {
                let reason = format!("cannot access {}: {error}", to_text(&look.file));
                // The error is ignored, because a client that has disconnected needs no answer.
                let _ = look.answer.send(Response::Failed { reason });
            }
        }
        true
    }

    pub(super) fn looked(&mut self, looked: Looked) -> bool {
        let Looked { probe, seen } = looked;
        match seen {
            Seen::Sources(now, around) => {
                self.look_at_state(around.state_is_gone);
                self.looks.around = around;
                self.reload_if_changed(now);
                true
            }
            Seen::Again { stamp, inputs } => {
                let path = self.looks.missed.remove(&probe);
                self.take_in(inputs);
                path.is_none_or(|path| self.missed(path, stamp))
            }
            // A missing entry means that the lookup was given up and answered.
            Seen::Elsewhere(file) => match self.looks.pending.remove(&probe) {
                Some(look) => {
                    let is_led = true;
                    self.look_at(Look {
                        file,
                        is_led,
                        ..look
                    })
                }
                None => true,
            },
            Seen::LookedUp(seen) => match self.looks.pending.remove(&probe) {
                Some(look) => self.wait(look, seen),
                None => true,
            },
        }
    }

    /// Ends waits for files that do not respond, and reports these files as long as they hang.
    pub(super) fn give_up_the_overdue(&mut self) {
        for overdue in self.looks.io_watchdog.overdue(PATIENCE) {
            self.give_up(&overdue);
        }
        let hanging = self.looks.io_watchdog.hanging();
        if self.looks.hanging.is_empty() && hanging.is_empty() {
            return;
        }
        let before = std::mem::take(&mut self.looks.hanging);
        self.looks.hanging.extend(hanging);
        let now = self.looks.hanging.clone();
        for path in before.difference(&now).cloned() {
            self.answers_again(path);
        }
        for path in now.difference(&before).cloned() {
            let seconds = PATIENCE.as_secs();
            let why =
                format!("the system has not responded for {seconds} s; check its disk or server");
            self.unseen(Unseen { path, why });
        }
    }

    fn give_up(&mut self, overdue: &Overdue) {
        // Without an owner it is a single lookup that no other thread can take over.
        let Some(owner) = overdue.owner else { return };
        // Changes there are noticed when the file responds again.
        if self.is_watcher(owner) || self.looks.changes == Some(owner) {
            return;
        }
        let (path, seconds) = (to_text(&overdue.path), overdue.waited.as_secs());
        let reason = format!("read {path}: the system has not responded for {seconds} s");
        if let Some(look) = self.looks.pending.remove(&owner) {
            // The answer is the same as after a timeout: there is no verdict, but the request is valid.
            let _ = look.answer.send(Response::Unanswered { reason });
            return;
        }
        if let Some(path) = self.looks.missed.remove(&owner) {
            self.missed(path, None);
            return;
        }
        self.handle(Event::Prepared {
            job: JobId(owner),
            result: Err(PrepareFailure::Moment(reason)),
        });
    }
}

/// Returns the watched file that a path stands for. The path may be an outside link to the file, or
/// may lead through a link to its directory.
fn meant(file: &Path, places: &ResultPaths, roots: &[PathBuf]) -> Option<PathBuf> {
    if !places.contains(file) {
        return led_to(file, |at| places.contains(at));
    }
    if !is_behind_a_link(file, roots) {
        return None;
    }
    let real = foreign::canonicalize(file.parent()?).ok()?;
    let real = real.join(file.file_name()?);
    is_looked_at(roots, &real).then_some(real)
}

/// Maximum number of consecutive links. The kernel does not follow more.
const MOST_LINKS: usize = 40;

/// Follows links to a file one by one, because each may be the path under which it is judged.
fn led_to(file: &Path, is_meant: impl Fn(&Path) -> bool) -> Option<PathBuf> {
    let mut next = file.to_path_buf();
    for _ in 0..MOST_LINKS {
        let directory = foreign::canonicalize(next.parent()?).ok()?;
        let at = directory.join(next.file_name()?);
        if is_meant(&at) {
            return Some(at);
        }
        next = foreign::access(&at, || Ok(directory.join(std::fs::read_link(&at)?))).ok()?;
    }
    None
}

fn moved(inputs: Vec<Input>) -> Vec<Changed> {
    let now = inputs.into_iter().map(|input| {
        let now = stamp_through_links(&input.path);
        (now != input.content.stamp()).then_some((input.path, now))
    });
    now.flatten().collect()
}

/// Checks whether an error is permanent. Errors that pass within a second are not. A server that
/// does not respond counts as permanent, because the end of its failure is unknown.
fn is_there_to_stay(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::TimedOut || !foreign::is_of_the_moment(error)
}

fn hides(file: &Path, error: &io::Error) -> String {
    format!("cannot access {}: {error}", to_text(file))
}

/// Returns a description of the entry that occupies the path of a missing file.
fn what_instead(file: &Path, stamp: Option<Stamp>, roots: &[PathBuf]) -> Option<String> {
    if stamp.is_some() {
        return None;
    }
    let what = match look_at(file, roots) {
        FileLookup::Directory | FileLookup::Known => "it is a directory".to_owned(),
        // The target of the link may still be created.
        FileLookup::NoFile(NoFile::Dangling(_)) => return None,
        FileLookup::NoFile(what) => what.to_string(),
        FileLookup::File(_) | FileLookup::Nothing | FileLookup::Hidden(_) => return None,
    };
    Some(format!("{} cannot be checked: {what}", to_text(file)))
}

fn why_unwatched(
    file: &Path,
    stamp: Option<Stamp>,
    places: &ResultPaths,
    roots: &[PathBuf],
) -> Option<String> {
    let shown = to_text(file);
    if qcbus_document::FileKind::of_path(file).is_none() {
        Some(format!(
            "{shown} is not a file that qcbus checks ({})",
            qcbus_document::Suffix::list()
        ))
    } else if !places.contains(file) {
        Some(format!("{shown} is outside the watched directories"))
    } else if let Some(hidden) = file.parent().and_then(|it| hidden_above(roots, it)) {
        let name = hidden.file_name().map(Path::new).map(to_text);
        Some(format!(
            "{shown} is in the hidden directory {}, and hidden directories are skipped; name it as a directory \
             to watch, or put `!{}/` into a .qcignore",
            to_text(&hidden),
            name.unwrap_or_default()
        ))
    } else if stamp.is_some() && is_left_alone(roots, file) {
        Some(format!("{shown} is ignored (by its name or a .qcignore)"))
    } else if stamp.is_some() && !is_looked_at(roots, file) {
        Some(format!(
            "{shown} is behind a symbolic link to a directory that is not watched, and such links are not \
             followed; name that directory as well to watch it"
        ))
    } else {
        None
    }
}
