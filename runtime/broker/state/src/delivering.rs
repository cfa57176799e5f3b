//! Delivery: every result reaches every reporter at least once, and no reporter can delay a verdict.

use std::path::Path;
use std::sync::Arc;

use qcbus_messages::{JobId, PeerReport, Role};
use qcbus_types::{Action, Delivery, Notice, Reported, SessionId, clip_text};

use super::files::FileId;
use super::reporters::Reporter;
use super::{Actions, State};

/// Maximum number of unacknowledged findings per reporter. A result with more findings is sent
/// alone. Otherwise a bundle that reports far too much would fill the broker with unread results.
const FINDINGS_UNDER_WAY: u64 = 2_000;

/// Maximum number of reporters that have a larger result at once. Each such result is read back and
/// kept until it is acknowledged, and the number of reporters is unlimited. The limit is above 1 so
/// that a stopped reporter does not block the others.
const LARGE_AT_ONCE: usize = 2;

/// A result that was sent and is not acknowledged yet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub file: FileId,
    pub findings: u64,
}

impl Sent {
    fn is_large(&self) -> bool {
        self.findings > FINDINGS_UNDER_WAY
    }
}

impl State {
    /// Checks whether one more large result may be sent to a reporter.
    fn has_room_for_large(&self) -> bool {
        let sent = self.reporters.iter().flat_map(|it| it.active.values());
        sent.filter(|sent| sent.is_large()).count() < LARGE_AT_ONCE
    }

    /// Sends the results that had to wait for other reporters.
    pub(super) fn deliver_what_waited(&mut self, actions: &mut Actions) {
        for index in 0..self.reporters.len() {
            let waits = |it: &Reporter| it.active.is_empty() && !it.queue.is_empty();
            if self.reporters.get(index).is_some_and(waits) {
                self.deliver(u32::try_from(index).unwrap_or(u32::MAX), actions);
            }
        }
    }

    /// Checks whether a result that was read back for a reporter must still be sent. Its file may
    /// have been removed meanwhile.
    pub fn awaits_result(&self, session: SessionId, job: JobId) -> bool {
        let mut reporters = self.reporters.iter();
        reporters.any(|it| it.session == Some(session) && it.active.contains_key(&job))
    }

    pub(super) fn deliver_everything(&mut self, actions: &mut Actions) {
        for index in 0..self.reporters.len() {
            self.deliver(u32::try_from(index).unwrap_or(u32::MAX), actions);
        }
    }

    /// Sends a new result to every connected reporter.
    pub(super) fn deliver_to_all(&mut self, file: FileId, actions: &mut Actions) {
        for index in 0..self.reporters.len() {
            let Some(reporter) = self.reporters.get_mut(index) else {
                continue;
            };
            // A disconnected reporter gets all missing results when it joins.
            if reporter.session.is_some() {
                reporter.retries.forget(file);
                reporter.queue.push_back(file);
                self.deliver(u32::try_from(index).unwrap_or(u32::MAX), actions);
            }
        }
    }

    pub(super) fn deliver(&mut self, index: u32, actions: &mut Actions) {
        let mut has_room = self.has_room_for_large();
        while let Some(reporter) = self.reporters.get_mut(index as usize) {
            let Some(session) = reporter.session else {
                return;
            };
            if reporter.active.len() + reporter.voiding.len() >= reporter.capacity {
                return;
            }
            // Withdrawals precede results, because the new report of a file that exists again must be written later.
            let recorded = |path: &&Arc<Path>| !self.withdrawing.contains_key(*path);
            let gone = reporter.void.iter().find(recorded).cloned();
            if let Some(path) = gone {
                reporter.void.remove(&path);
                reporter.voiding.insert(path.clone());
                reporter.moved = self.now;
                actions.push(Action::Void {
                    session,
                    reporter: reporter.name.clone(),
                    path,
                });
                continue;
            }
            let Some(file) = reporter.next_in_queue(&self.files) else {
                return;
            };
            let Some(entry) = self.files.get(file) else {
                continue;
            };
            let Some(judged) = entry.judged.clone() else {
                continue;
            };
            if entry.has(index, judged.job) || reporter.active.contains_key(&judged.job) {
                continue;
            }
            let findings = judged.counts.iter().sum();
            let sent = Sent { file, findings };
            let under_way: u64 = reporter.active.values().map(|sent| sent.findings).sum();
            let crowded = !reporter.active.is_empty() && under_way + findings > FINDINGS_UNDER_WAY;
            if crowded || (sent.is_large() && !has_room) {
                reporter.queue.push_front(file);
                return;
            }
            has_room &= !sent.is_large();
            reporter.active.insert(judged.job, sent);
            reporter.moved = self.now;
            let delivery = Delivery {
                job: judged.job,
                path: entry.path.clone(),
                judged,
            };
            let reporter = reporter.name.clone();
            actions.push(Action::Deliver {
                session,
                reporter,
                delivery,
            });
        }
    }

    /// Handles the answer of a reporter that it has a result or could not use it.
    pub(super) fn result_done(
        &mut self,
        index: u32,
        job: JobId,
        report: PeerReport,
        actions: &mut Actions,
    ) {
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        let Some(sent) = reporter.active.remove(&job) else {
            return;
        };
        reporter.moved = self.now;
        reporter.done += 1;
        match report {
            PeerReport::Written => self.is_reported(index, sent.file, job, actions),
            PeerReport::Failed(why) => self.is_not_reported(index, sent.file, why, actions),
        }
        self.deliver(index, actions);
        if sent.is_large() {
            self.deliver_what_waited(actions);
        }
    }

    fn is_reported(&mut self, index: u32, file: FileId, job: JobId, actions: &mut Actions) {
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        let had_failed = reporter.retries.len() > 0;
        reporter.queue.extend(reporter.retries.written(file));
        let name = reporter.name.clone();
        if had_failed && reporter.retries.len() == 0 && reporter.not_withdrawn == 0 {
            reporter.note.clear();
            self.is_over(|it| matches!(it, Notice::NotReported { name: of, .. } if *of == name));
        }
        if let Some(entry) = self.files.get_mut(file) {
            entry.delivered.retain(|(other, _)| *other != index);
            entry.delivered.push((index, Reported::Of(job)));
            let path = entry.path.clone();
            actions.push(Action::Delivered {
                reporter: name,
                path,
                job,
            });
        }
        self.settle_waits(file, actions);
    }

    /// Schedules a failed report for another try after a pause. The journal does not record it, so
    /// the next broker tries it as well.
    fn is_not_reported(&mut self, index: u32, file: FileId, why: String, actions: &mut Actions) {
        let (now, pause) = (self.now, self.settings.retry_after);
        let mut why = why;
        clip_text(&mut why, self.settings.max_text);
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        let is_new = reporter.retries.failed(file, now, pause);
        if is_new || reporter.note != why {
            reporter.note.clone_from(&why);
            let why = format!("could not report and will retry: {why}");
            let notice = Notice::not_reported(&reporter.name, why);
            self.notice(notice, actions);
        }
    }

    /// Retries failed reports after the end of their pause.
    pub(super) fn report_again(&mut self, actions: &mut Actions) {
        for index in 0..self.reporters.len() {
            let Some(reporter) = self.reporters.get_mut(index) else {
                continue;
            };
            let probes = reporter.retries.probes(self.now);
            if !probes.is_empty() {
                reporter.queue.extend(probes);
                self.deliver(u32::try_from(index).unwrap_or(u32::MAX), actions);
            }
        }
    }

    /// Handles the answer of a reporter that it has withdrawn its report of a removed file, or could not.
    pub(super) fn withdrawal_done(
        &mut self,
        index: u32,
        input: &Path,
        report: PeerReport,
        actions: &mut Actions,
    ) {
        let (now, max_text) = (self.now, self.settings.max_text);
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        let Some(path) = reporter.voiding.take(input) else {
            return;
        };
        reporter.moved = now;
        let again = reporter.void.contains(&path);
        let name = reporter.name.clone();
        if let PeerReport::Failed(mut why) = report {
            clip_text(&mut why, max_text);
            reporter.not_withdrawn += 1;
            reporter.note.clone_from(&why);
            let why = format!("could not withdraw a report: {why}");
            self.notice(Notice::not_reported(&name, why), actions);
        }
        if !again {
            let reporter = name;
            actions.push(Action::Voided { reporter, path });
        }
        self.deliver(index, actions);
    }

    /// Handles a result that could not be read back: it was withdrawn or replaced, or the disk has failed.
    pub(super) fn undeliverable(
        &mut self,
        session: SessionId,
        job: JobId,
        why: String,
        actions: &mut Actions,
    ) {
        let Some((Role::Reporter, name)) = self.sessions.get(&session).cloned() else {
            return;
        };
        let index = self.reporter_index(&name);
        if let Some(reporter) = self.reporters.get_mut(index as usize)
            && let Some(Sent { file, .. }) = reporter.active.remove(&job)
            && let Some(entry) = self.files.get(file).filter(|it| it.present)
        {
            if entry.judged.as_ref().is_some_and(|it| it.is_written()) {
                let pause = self.settings.retry_after;
                reporter.retries.failed(file, self.now, pause);
                reporter.note.clone_from(&why);
            }
            self.notice(Notice::NotDelivered(why), actions);
        }
        self.deliver(index, actions);
    }

    /// Checks whether every connected reporter has received everything.
    pub(super) fn all_delivered(&self) -> bool {
        self.reporters.iter().all(|it| {
            it.session.is_none() || (!it.owes() && it.queue.is_empty() && it.void.is_empty())
        })
    }
}
