//! Clients that wait for the verdict on a file's present bytes.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::control::Response;
use qcbus_messages::path_text::to_text;

use super::action::Action;
use super::files::{FileEntry, FileId, Priority, Stage};
use super::types::{Judged, RequestId, Stamp, file_verdict};
use super::{Actions, State};

/// For what a client of the control socket waits, and when it gives up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Until {
    /// When to give up; never, when absent.
    pub timeout: Option<Duration>,
    /// Also for every reporter to have its report written.
    pub reports: bool,
}

/// One client.
#[derive(Debug)]
pub(super) struct Waiter {
    request_id: RequestId,
    path: Arc<Path>,
    until: Option<Duration>,
    /// It waits for the reports, too.
    reports: bool,
    /// Whether the file has been seen to be there since it was asked for. A verdict is kept while a
    /// watched directory is away, and nobody may be told that what is not there was accepted.
    seen: bool,
}

impl Waiter {
    pub fn request_id(&self) -> RequestId {
        self.request_id
    }
}

impl State {
    /// A client asks. The stamp is of now, so a file that was written a moment ago and whose
    /// change nobody has reported yet is judged anew before the answer.
    pub(super) fn wait(
        &mut self,
        request_id: RequestId,
        path: &Arc<Path>,
        stamp: Option<Stamp>,
        unwatched: Option<String>,
        until: Until,
        actions: &mut Actions,
    ) {
        if let Some(reason) = unwatched {
            actions.push(Action::Answer {
                request_id,
                response: Response::Unwatched { reason },
            });
            return;
        }
        self.waiters.push(Waiter {
            request_id,
            path: path.clone(),
            until: until.timeout.map(|timeout| self.now + timeout),
            reports: until.reports,
            seen: false,
        });
        if let Some(stamp) = stamp
            && FileKind::of_path(path).is_some()
        {
            self.settled(path, stamp, actions);
        }
        if let Some(id) = self.files.id(path)
            && stamp.is_some()
            && self.is_awaited(path)
        {
            self.hurry(id);
        }
    }

    /// A file is there: who waits for it is told what stands.
    pub(super) fn seen(&mut self, id: FileId, actions: &mut Actions) {
        let Some(path) = self.files.get(id).map(|entry| entry.path.clone()) else {
            return;
        };
        let mut awaited = false;
        for waiter in self.waiters.iter_mut().filter(|it| it.path == path) {
            (waiter.seen, awaited) = (true, true);
        }
        if awaited {
            self.settle_waits(id, actions);
        }
    }

    /// Whether somebody waits for the verdict on this file.
    pub fn is_awaited(&self, path: &Path) -> bool {
        self.waiters.iter().any(|it| *it.path == *path)
    }

    /// Somebody waits for a verdict that is not there: the file need not wait for its turn among
    /// those that nobody asks for.
    fn hurry(&mut self, id: FileId) {
        let there = |it: &FileEntry| it.present && it.judged.is_some();
        if self.files.get(id).is_some_and(there) {
            self.files.enqueue(id, Priority::Fresh, self.now);
        }
        self.hurry_under(id);
    }

    /// Answers everybody who waits for this file, if there is nothing more to wait for.
    pub(super) fn settle_waits(&mut self, id: FileId, actions: &mut Actions) {
        let Some((path, judged)) = self.standing_verdict(id) else {
            return;
        };
        let for_reports = |it: &Waiter| it.reports && it.path == path;
        let waits = self.waiters.iter().any(for_reports);
        let is_reported = !waits || self.unreported(id).is_empty();
        let told = |it: &Waiter| it.seen && it.path == path && (!it.reports || is_reported);
        self.answer(actions, told, || {
            Response::Verdict(file_verdict(&path, &judged))
        });
    }

    /// The verdict on a file, if there is nothing more to wait for.
    fn standing_verdict(&self, id: FileId) -> Option<(Arc<Path>, Arc<Judged>)> {
        let entry = self.files.get(id)?;
        // One that waits in the background may have a verdict that stands nevertheless.
        let settled = matches!(
            entry.stage(),
            Stage::Idle | Stage::Waiting(Priority::Background, _)
        );
        let stands = |judged: &Arc<Judged>| {
            settled
                && entry.present
                && !entry.stale
                && entry.opening == 0
                && self.stands(entry.kind, judged)
                && self.rests_firmly(judged)
        };
        let judged = entry.judged.clone().filter(stands)?;
        Some((entry.path.clone(), judged))
    }

    /// An acceptance lies behind the gate again: who waits for it may be told.
    pub(super) fn opened(&mut self, path: &Path, actions: &mut Actions) {
        let Some(id) = self.files.id(path) else {
            return;
        };
        if let Some(entry) = self.files.get_mut(id) {
            entry.opening = entry.opening.saturating_sub(1);
        }
        self.settle_waits(id, actions);
    }

    /// Answers clients that wait for reports of which nobody is in debt any more: a reporter may have been removed.
    pub(super) fn settle_reported(&mut self, actions: &mut Actions) {
        let waiting = self.waiters.iter().filter(|it| it.reports && it.seen);
        let files: BTreeSet<FileId> = waiting.filter_map(|it| self.files.id(&it.path)).collect();
        for id in files {
            self.settle_waits(id, actions);
        }
    }

    /// A person wants a bundle off the roster.
    pub(super) fn removal(&mut self, request_id: RequestId, name: &str, actions: &mut Actions) {
        let response = match self.remove_bundle(name, actions) {
            Ok(what) => Response::Removed { what },
            Err(reason) => Response::Failed { reason },
        };
        actions.push(Action::Answer {
            request_id,
            response,
        });
    }

    pub(super) fn answer_gone(&mut self, path: &Path, actions: &mut Actions) {
        let reason = || format!("{} is not there", to_text(path));
        let told = |waiter: &Waiter| *waiter.path == *path;
        self.answer(actions, told, || Response::Unwatched { reason: reason() });
    }

    fn answer(
        &mut self,
        actions: &mut Actions,
        told: impl Fn(&Waiter) -> bool,
        response: impl Fn() -> Response,
    ) {
        let (answered, rest) = std::mem::take(&mut self.waiters)
            .into_iter()
            .partition(told);
        self.waiters = rest;
        let answered: Vec<Waiter> = answered;
        for waiter in answered {
            actions.push(Action::Answer {
                request_id: waiter.request_id,
                response: response(),
            });
        }
    }

    pub(super) fn expire_waits(&mut self, actions: &mut Actions) {
        let now = self.now;
        let is_over = |it: &Waiter| it.until.is_some_and(|until| until <= now);
        let waiters = std::mem::take(&mut self.waiters);
        let (over, rest): (Vec<Waiter>, _) = waiters.into_iter().partition(is_over);
        self.waiters = rest;
        for waiter in over {
            actions.push(Action::Answer {
                request_id: waiter.request_id,
                response: self.in_vain(&waiter),
            });
        }
    }

    /// The answer to a client whose time is over.
    fn in_vain(&self, waiter: &Waiter) -> Response {
        let id = self.files.id(&waiter.path);
        let id = id.filter(|_| waiter.reports && waiter.seen);
        let readiness = id.and_then(|id| Some((id, self.standing_verdict(id)?)));
        let Some((id, (path, judged))) = readiness else {
            return Response::TimedOut;
        };
        Response::Unreported {
            verdict: file_verdict(&path, &judged),
            reporters: self.unreported(id),
        }
    }

    /// The broker stops: nobody is left without an answer.
    pub(super) fn end_waits(&mut self, actions: &mut Actions) {
        for waiter in std::mem::take(&mut self.waiters) {
            actions.push(Action::Answer {
                request_id: waiter.request_id,
                response: Response::Stopped,
            });
        }
    }
}
