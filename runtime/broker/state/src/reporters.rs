//! Reporters: their sessions, their messages and the reports that they must withdraw.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::path_text::from_text;
use qcbus_messages::{FromPeer, Hello, JobId, Role, ToPeer};
use qcbus_types::{Action, Launch, Notice, Reported, SessionId};

use super::delivering::Sent;
use super::files::{FileId, Files};
use super::retries::Retries;
use super::{Actions, State};

/// A reporter, identified by its name.
#[derive(Debug, Default)]
pub(super) struct Reporter {
    pub name: String,
    pub version: String,
    pub session: Option<SessionId>,
    pub incarnation: u64,
    pub pid: u32,
    pub launch: Option<Launch>,
    pub capacity: usize,
    /// Results that were sent and not acknowledged yet.
    pub active: BTreeMap<JobId, Sent>,
    /// Files with a newest result that must be sent.
    pub queue: VecDeque<FileId>,
    /// Removed files with reports that must be withdrawn.
    pub void: BTreeSet<Arc<Path>>,
    /// Removed files among them that the reporter already knows of.
    pub voiding: BTreeSet<Arc<Path>>,
    /// Older processes that finish their work, each with the files that it is about.
    pub finishing: BTreeMap<SessionId, BTreeSet<FileId>>,
    pub heard: Duration,
    pub moved: Duration,
    pub done: u64,
    /// Reports that failed.
    pub retries: Retries,
    /// Number of reports that it could not withdraw.
    pub not_withdrawn: u64,
    pub note: String,
}

impl Reporter {
    /// Checks whether the reporter has not answered a message yet.
    pub fn owes(&self) -> bool {
        !self.active.is_empty() || !self.voiding.is_empty()
    }

    /// Takes the next file out of the queue. A file with a result in transit waits. Results are
    /// read back in parallel, and an older result must not arrive last. A file with an old report
    /// that must still be withdrawn waits as well.
    pub fn next_in_queue(&mut self, files: &Files) -> Option<FileId> {
        let under_way = |file: &FileId| {
            self.active.values().any(|sent| sent.file == *file)
                || self.finishing.values().any(|begun| begun.contains(file))
                || files
                    .get(*file)
                    .is_some_and(|it| self.void.contains(&it.path))
        };
        let at = self.queue.iter().position(|file| !under_way(file))?;
        self.queue.remove(at)
    }

    /// Returns the number of reports that are not written or not withdrawn.
    pub fn unreported(&self) -> u64 {
        self.retries.len() as u64 + self.not_withdrawn
    }

    /// Returns the remark for the user: the missing reports and their reason, or the reason why it is down.
    pub fn remark(&self, now: Duration) -> String {
        let missing = self.unreported();
        if missing == 0 {
            return self.note.clone();
        }
        let again = self.retries.due().map_or(String::new(), |due| {
            let seconds = due.saturating_sub(now).as_secs_f64().ceil();
            format!("; retried in {seconds} s")
        });
        format!("{missing} not reported: {}{again}", self.note)
    }

    /// Discards the state of a session that has ended.
    fn forget_session(&mut self) {
        self.active.clear();
        self.queue.clear();
        self.retries = Retries::default();
        self.void.append(&mut self.voiding);
    }
}

impl State {
    pub(super) fn reporter_named(&self, name: &str) -> Option<&Reporter> {
        self.reporters.iter().find(|reporter| reporter.name == name)
    }

    /// Returns the index of a reporter. A new reporter is added.
    pub fn reporter_index(&mut self, name: &str) -> u32 {
        let found = self
            .reporters
            .iter()
            .position(|reporter| reporter.name == name);
        let index = found.unwrap_or_else(|| {
            self.reporters.push(Reporter {
                name: name.to_owned(),
                ..Reporter::default()
            });
            self.reporters.len() - 1
        });
        u32::try_from(index).unwrap_or(u32::MAX)
    }

    pub(super) fn reporter_joins(
        &mut self,
        session: SessionId,
        hello: &Hello,
        actions: &mut Actions,
    ) {
        let launch = hello.launch.map(Launch);
        self.child_joined(&hello.name, launch, &hello.version, actions);
        let index = self.reporter_index(&hello.name);
        let now = self.now;
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        let old = reporter.session.replace(session);
        let old = old.map(|old| (old, reporter.launch));
        let same_process = reporter.pid == hello.pid && hello.pid != 0;
        reporter.version.clone_from(&hello.version);
        reporter.incarnation = hello.incarnation;
        reporter.pid = hello.pid;
        reporter.launch = launch;
        reporter.capacity = usize::from(hello.capacity).clamp(1, 64);
        reporter.heard = now;
        reporter.moved = now;
        reporter.note.clear();
        if let Some(old) = old {
            self.reporter_is_replaced(index, old, same_process, actions);
        }
        self.sessions
            .insert(session, (Role::Reporter, hello.name.as_str().into()));
        actions.push(Action::Accept { session });
        self.drain_unwanted(&hello.name, launch, actions);
        self.queue_undelivered(index);
        self.deliver(index, actions);
    }

    /// Lets a newer process of the same name take over. The older process finishes its work. Until it has ended, no
    /// newer results of its files are sent, because it could overwrite their reports.
    fn reporter_is_replaced(
        &mut self,
        index: u32,
        (old, launch): (SessionId, Option<Launch>),
        same_process: bool,
        actions: &mut Actions,
    ) {
        self.sessions.remove(&old);
        if same_process {
            actions.push(Action::Disconnect { session: old });
            return;
        }
        if let Some(reporter) = self.reporters.get_mut(index as usize) {
            let begun = reporter.active.values().map(|sent| sent.file).collect();
            reporter.finishing.insert(old, begun);
        }
        self.retire(old, launch);
        let message = ToPeer::Drain;
        actions.push(Action::Send {
            session: old,
            message,
        });
    }

    /// Handles the end of a process that was told to leave.
    pub(super) fn retired_has_gone(&mut self, session: SessionId, actions: &mut Actions) {
        let finished = |it: &mut Reporter| it.finishing.remove(&session).is_some();
        if let Some(index) = self.reporters.iter_mut().position(finished) {
            self.deliver(u32::try_from(index).unwrap_or(u32::MAX), actions);
        }
    }

    /// Queues every result that this reporter has not acknowledged.
    fn queue_undelivered(&mut self, index: u32) {
        let lacks: Vec<FileId> = self
            .files
            .iter()
            .filter(|(_, entry)| {
                entry
                    .judged
                    .as_ref()
                    .is_some_and(|judged| !entry.has(index, judged.job))
            })
            .map(|(id, _)| id)
            .collect();
        if let Some(reporter) = self.reporters.get_mut(index as usize) {
            reporter.forget_session();
            reporter.queue = lacks.into();
        }
    }

    /// Handles a removed file. Every reporter that has or may have reported it must withdraw its
    /// report. Returns the names of these reporters.
    pub(super) fn void_reports(&mut self, id: FileId) -> Vec<String> {
        let Some(entry) = self.files.get(id) else {
            return Vec::new();
        };
        let judged = entry.judged.is_some();
        let mut names = Vec::new();
        for (index, reporter) in self.reporters.iter_mut().enumerate() {
            let has = |it: &(u32, Reported)| usize::try_from(it.0) == Ok(index);
            let under_way = reporter.active.values().any(|sent| sent.file == id);
            reporter.active.retain(|_, sent| sent.file != id);
            reporter.retries.forget(id);
            let pending =
                reporter.void.contains(&entry.path) || reporter.voiding.contains(&entry.path);
            // A former broker may have sent the result and died before the acknowledgement.
            let here = reporter.session.is_some() || self.children.contains_key(&reporter.name);
            if under_way || pending || entry.delivered.iter().any(has) || (judged && here) {
                reporter.void.insert(entry.path.clone());
                names.push(reporter.name.clone());
            }
        }
        names
    }

    /// Adds a removed file from the journal. A reporter may still have a report of it.
    pub fn remember_void(&mut self, path: &Arc<Path>, reporter: &str) {
        let index = self.reporter_index(reporter);
        if let Some(reporter) = self.reporters.get_mut(index as usize) {
            reporter.void.insert(path.clone());
        }
    }

    /// Handles a message of a reporter.
    pub(super) fn reporter_says(&mut self, name: &str, message: FromPeer, actions: &mut Actions) {
        let now = self.now;
        let index = self.reporter_index(name);
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        reporter.heard = now;
        match message {
            FromPeer::ResultDone { job, report } => self.result_done(index, job, report, actions),
            FromPeer::WithdrawalDone { input, report } => {
                self.withdrawal_done(index, &from_text(&input), report, actions);
            }
            FromPeer::Leaving => {
                if let Some(session) = reporter.session.take() {
                    self.sessions.remove(&session);
                    self.retired.remove(&session);
                    actions.push(Action::Disconnect { session });
                }
                self.child_left(name);
            }
            _ => {}
        }
    }

    pub(super) fn reporter_died(&mut self, name: &str, why: &str, actions: &mut Actions) {
        self.reporter_is_down(name, Notice::ended(name, why), actions);
    }

    fn reporter_is_down(&mut self, name: &str, notice: Notice, actions: &mut Actions) {
        let index = self.reporter_index(name);
        let Some(reporter) = self.reporters.get_mut(index as usize) else {
            return;
        };
        if let Some(session) = reporter.session.take() {
            self.sessions.remove(&session);
            actions.push(Action::Disconnect { session });
        }
        let proved = reporter.done > 0;
        let why = notice.why();
        reporter.note.clone_from(&why);
        reporter.forget_session();
        self.notice(notice, actions);
        self.child_down(name, proved, &why, actions);
    }

    pub(super) fn watch_reporters(&mut self, actions: &mut Actions) {
        // A reporter with a large result may have disconnected.
        self.deliver_what_waited(actions);
        self.report_again(actions);
        let limit = self.settings.job_deadline;
        let silence = self.settings.silence_limit;
        let mut failing = Vec::new();
        for reporter in &self.reporters {
            if reporter.session.is_none() || !reporter.owes() {
                continue;
            }
            let moved = self.now.saturating_sub(reporter.moved);
            let heard = self.now.saturating_sub(reporter.heard);
            if moved > limit || heard.min(moved) > silence {
                failing.push((reporter.name.clone(), reporter.launch));
            }
        }
        for (name, launch) in failing {
            actions.extend(launch.map(|launch| Action::Kill { launch }));
            let notice = Notice::killed(&name, "it does not acknowledge results");
            self.reporter_is_down(&name, notice, actions);
        }
    }
}
