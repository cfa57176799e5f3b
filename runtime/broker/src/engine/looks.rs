//! What the loop wants to know of files: it sends scouts, because it must never wait for a disk.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_disk::foreign::{self, Overdue};
use qcbus_messages::JobId;
use qcbus_messages::control::{Response, Unseen};
use qcbus_messages::path_text::to_text;
use tokio::sync::oneshot;

use super::Broker;
use crate::core::{Event, Input, PrepareFailure, Stamp};
use crate::result_paths::ResultPaths;
use crate::scouts::PATIENCE;
use crate::stamp::{stamp_of, stamp_through_links};
use crate::watch::{is_behind_a_link, is_left_alone, is_looked_at};

/// A client that waits for the verdict on a file, which is being looked at for it.
pub(super) struct Look {
    pub file: PathBuf,
    pub timeout_ms: Option<u64>,
    pub answer: oneshot::Sender<Response>,
    /// The path that was given led to this file.
    pub is_led: bool,
}

/// What a scout has seen.
pub(super) struct Sighted {
    /// The file as it is watched: a link from elsewhere to a watched file means that file.
    pub file: PathBuf,
    pub stamp: Option<Stamp>,
    /// Those of the files that its verdict depends on which are not what they were.
    pub inputs: Vec<(Arc<Path>, Option<Stamp>)>,
    /// Why nobody watches it.
    pub unwatched: Option<String>,
}

/// What a scout says, and which one.
pub(super) struct Looked {
    scout: u64,
    seen: Seen,
}

enum Seen {
    /// The path means another file.
    Elsewhere(PathBuf),
    Sighted(Sighted),
}

impl Broker {
    /// Sends a scout to a file that a client asks for.
    pub(super) fn look_at(&mut self, look: Look) -> bool {
        let (file, is_led) = (look.file.clone(), look.is_led);
        let inputs = self.state.inputs_of(&file).into_iter().skip(1).collect();
        let (store, roots) = (self.store.clone(), self.options.roots.clone());
        self.send_scout(look, move || {
            if let Some(file) = meant(&file, &store.places, &roots).filter(|_| !is_led) {
                return Seen::Elsewhere(file);
            }
            let moved = moved(inputs);
            let stamp = stamp_of(&file).ok().flatten();
            let unwatched = why_unwatched(&file, stamp, &store.places, &roots);
            Seen::Sighted(Sighted {
                file,
                stamp,
                inputs: moved,
                unwatched,
            })
        })
    }

    fn send_scout(&mut self, look: Look, see: impl FnOnce() -> Seen + Send + 'static) -> bool {
        let (tell, told) = std::sync::mpsc::channel();
        let inbox = self.inbox.looked_in.clone();
        let sent = self.scouts.send(move || {
            let seen = see();
            // It is told its number right after it was sent. After the end of the loop nobody listens.
            if let Ok(scout) = told.recv() {
                let _ = inbox.send(Looked { scout, seen });
            }
        });
        match sent {
            Ok(scout) => {
                let _ = tell.send(scout);
                self.looks.insert(scout, look);
            }
            Err(error) => {
                let reason = format!("cannot look at {}: {error}", to_text(&look.file));
                // A client that has left needs no answer.
                let _ = look.answer.send(Response::Failed { reason });
            }
        }
        true
    }

    pub(super) fn looked(&mut self, looked: Looked) -> bool {
        // Given up, and answered, if it is not there.
        let Some(look) = self.looks.remove(&looked.scout) else {
            return true;
        };
        match looked.seen {
            Seen::Elsewhere(file) => {
                let is_led = true;
                self.look_at(Look {
                    file,
                    is_led,
                    ..look
                })
            }
            Seen::Sighted(seen) => self.wait(look, seen),
        }
    }

    /// Ends what waits for a file that does not answer, and says so as long as it is so.
    pub(super) fn give_up_the_overdue(&mut self) {
        for overdue in self.lookout.overdue(PATIENCE) {
            self.give_up(&overdue);
        }
        let hanging = self.lookout.hanging();
        if self.hanging.is_empty() && hanging.is_empty() {
            return;
        }
        let before = std::mem::take(&mut self.hanging);
        self.hanging.extend(hanging);
        for path in before.difference(&self.hanging) {
            self.unseen.remove(path);
        }
        for path in self.hanging.clone().difference(&before) {
            let seconds = PATIENCE.as_secs();
            let why = format!(
                "the system has not answered for {seconds} s; is its disk or server there?"
            );
            let path = path.clone();
            self.unseen(Unseen { path, why });
        }
    }

    fn give_up(&mut self, overdue: &Overdue) {
        let (path, seconds) = (to_text(&overdue.path), overdue.waited.as_secs());
        let reason = format!("read {path}: the system has not answered for {seconds} s");
        if let Some(look) = self.looks.remove(&overdue.owner) {
            // As when no verdict came in time: there is none, and nothing of the question is wrong.
            let _ = look.answer.send(Response::Unanswered { reason });
            return;
        }
        self.handle(Event::Prepared {
            job: JobId(overdue.owner),
            result: Err(PrepareFailure::Moment(reason)),
        });
    }
}

/// A link from elsewhere to a watched file means that file, and so does a path to it through a link to its
/// directory.
fn meant(file: &Path, places: &ResultPaths, roots: &[PathBuf]) -> Option<PathBuf> {
    if !places.contains(file) {
        let real = foreign::canonicalize(file).ok();
        return real.filter(|real| places.contains(real));
    }
    if !is_behind_a_link(file, roots) {
        return None;
    }
    let real = foreign::canonicalize(file.parent()?).ok()?;
    let real = real.join(file.file_name()?);
    is_looked_at(roots, &real).then_some(real)
}

fn moved(inputs: Vec<Input>) -> Vec<(Arc<Path>, Option<Stamp>)> {
    let now = inputs.into_iter().map(|input| {
        let now = stamp_through_links(&input.path);
        (now != input.content.stamp()).then_some((input.path, now))
    });
    now.flatten().collect()
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
            "{shown} is no file that qcbus checks ({})",
            qcbus_document::Suffix::list()
        ))
    } else if !places.contains(file) {
        Some(format!("{shown} lies outside the watched directories"))
    } else if stamp.is_some() && is_left_alone(roots, file) {
        Some(format!("{shown} is ignored (by its name or a .qcignore)"))
    } else if stamp.is_some() && !is_looked_at(roots, file) {
        Some(format!(
            "{shown} lies behind a symbolic link to a directory that is not watched, and such links are not \
             followed; name that directory, too, to have it watched"
        ))
    } else {
        None
    }
}
