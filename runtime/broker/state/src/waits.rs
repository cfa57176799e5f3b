//! Waits: clients that wait for the verdict on a file's present bytes.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::control::Response;
use qcbus_messages::path_text::to_text;
use qcbus_types::{Action, Judged, RequestId, Stamp, Until, file_verdict};

use super::files::{FileEntry, FileId, Priority, Stage};
use super::{Actions, State};

/// A waiting client.
#[derive(Debug)]
pub(super) struct Waiter {
    request_id: RequestId,
    path: Arc<Path>,
    until: Option<Duration>,
    /// The client also waits for the reports.
    reports: bool,
    /// Whether the file was found to exist since the request. A verdict is kept while a watched
    /// directory is missing, but a missing file must not be reported as accepted.
    seen: bool,
}

impl Waiter {
    pub fn request_id(&self) -> RequestId {
        self.request_id
    }
}

impl State {
    /// Handles the wait of a client. The stamp is current. Thus a file that was just written is
    /// judged again first, even if its change is not reported yet.
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

    /// Answers the clients that wait for an existing file, if its verdict is valid.
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

    /// Checks whether a client waits for the verdict on this file.
    pub fn is_awaited(&self, path: &Path) -> bool {
        self.waiters.iter().any(|it| *it.path == *path)
    }

    /// Moves a file with an awaited verdict out of the background queue.
    fn hurry(&mut self, id: FileId) {
        let there = |it: &FileEntry| it.present && it.judged.is_some();
        if self.files.get(id).is_some_and(there) {
            self.files.enqueue(id, Priority::Fresh, self.now);
        }
        self.hurry_under(id);
    }

    /// Answers all clients that wait for this file if its verdict is final.
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

    /// Returns the verdict on a file if it is final.
    fn standing_verdict(&self, id: FileId) -> Option<(Arc<Path>, Arc<Judged>)> {
        let entry = self.files.get(id)?;
        // A file in the background queue may still have a valid verdict.
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

    /// Notes that an acceptance is behind the gate again, and answers the clients that wait for it.
    pub(super) fn opened(&mut self, path: &Path, actions: &mut Actions) {
        let Some(id) = self.files.id(path) else {
            return;
        };
        if let Some(entry) = self.files.get_mut(id) {
            entry.opening = entry.opening.saturating_sub(1);
        }
        self.settle_waits(id, actions);
    }

    /// Answers clients that wait for reports after the last missing report. For example, a reporter
    /// may have been removed.
    pub(super) fn settle_reported(&mut self, actions: &mut Actions) {
        let waiting = self.waiters.iter().filter(|it| it.reports && it.seen);
        let files: BTreeSet<FileId> = waiting.filter_map(|it| self.files.id(&it.path)).collect();
        for id in files {
            self.settle_waits(id, actions);
        }
    }

    /// Handles the request of a user to remove a bundle from the registry.
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
        let reason = || format!("{} does not exist", to_text(path));
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

    /// Returns the answer to a client after its timeout.
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

    /// Answers all remaining clients, because the broker stops.
    pub(super) fn end_waits(&mut self, actions: &mut Actions) {
        for waiter in std::mem::take(&mut self.waiters) {
            actions.push(Action::Answer {
                request_id: waiter.request_id,
                response: Response::Stopped,
            });
        }
    }
}
