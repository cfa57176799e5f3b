//! File events: handles new, changed and removed files, and changes of the files that verdicts depend on.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;
use qcbus_types::{Action, Judged, LostOutput, Notice, Stamp};

use super::files::{FileEntry, FileId, Priority, Stage};
use super::jobs::JobStage;
use super::{Actions, State};

/// Kind of a verdict's dependence on a file.
enum Dependence {
    /// The file was read or looked up.
    Read {
        /// Stamp at that time. `None` if the file did not exist.
        stamp: Option<Stamp>,
        /// The stamp is too young to prove that the file is unchanged.
        racy: bool,
    },
    /// The file has the verdict, and a link to it was read.
    ByLink,
}

impl State {
    /// Handles a file that exists and may still be written to.
    pub(super) fn present(&mut self, path: &Arc<Path>) {
        if let Some(id) = self.files.id(path) {
            self.is_there(id);
        }
    }

    /// Marks a file as present. It may have a verdict from before a restart. Then a shadow that was
    /// ready before the watcher does not know the file yet.
    fn is_there(&mut self, id: FileId) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        let was_there = std::mem::replace(&mut entry.present, true);
        if !was_there && entry.judged.is_some() {
            self.let_shadows_try(id);
        }
    }

    /// Handles a file that is being written to. It is judged when it has settled. Until then its
    /// acceptance, and every acceptance that rests on it, is withdrawn from the gate.
    pub(super) fn unfinished(
        &mut self,
        path: &Arc<Path>,
        stamp: Option<Stamp>,
        actions: &mut Actions,
    ) {
        for dependent in self.files.dependents(path) {
            let read = self.reading_of(dependent, path);
            if matches!(read, Some(Dependence::Read { stamp: read, .. }) if read != stamp) {
                self.unpublish(dependent, actions);
                self.stale_until_settled(dependent);
            }
        }
        let Some(id) = self.files.id(path) else {
            return;
        };
        let judged = self.files.get(id).and_then(|it| it.judged.as_ref());
        let read = judged.and_then(|it| it.inputs.first()?.content.stamp());
        if read != stamp {
            self.unpublish(id, actions);
            if let Some(entry) = self.files.get_mut(id) {
                entry.stale = true;
            }
        }
    }

    /// Marks a verdict as stale while a file that it depends on is being written to. The verdict is not reported
    /// before that file has settled. An active job notices the change by itself when it is stored.
    fn stale_until_settled(&mut self, id: FileId) {
        if let Some(entry) = self.files.get_mut(id)
            && !matches!(entry.stage(), Stage::Active(_))
        {
            entry.stale = true;
        }
    }

    /// Checks whether an event has reported the file as present and settled with this stamp.
    pub fn is_settled(&self, path: &Path, stamp: Stamp) -> bool {
        let entry = self.files.id(path).and_then(|id| self.files.get(id));
        entry.is_some_and(|it| it.present && it.stamp == stamp)
    }

    /// Handles a settled file: rechecks the verdicts that depend on it.
    pub(super) fn touched(&mut self, path: &Arc<Path>, stamp: Stamp, actions: &mut Actions) {
        for dependent in self.files.dependents(path) {
            match self.reading_of(dependent, path) {
                // The dependent file read this file by a link. The link itself is watched too.
                Some(Dependence::ByLink) => {}
                Some(Dependence::Read { stamp: read, racy }) if read == Some(stamp) => {
                    let entry = self.files.get(dependent);
                    if racy || entry.is_some_and(|it| it.stale) {
                        self.look_again(dependent);
                    }
                }
                Some(Dependence::Read { .. }) | None => self.make_stale(dependent, actions),
            }
        }
    }

    /// Returns how a file was read for the verdict on another file. An active job takes precedence
    /// over the last verdict.
    fn reading_of(&self, dependent: FileId, path: &Path) -> Option<Dependence> {
        let entry = self.files.get(dependent)?;
        let job = match entry.stage() {
            Stage::Active(job) => self.jobs.get(job).and_then(|job| job.prepared.as_ref()),
            _ => None,
        };
        let judged = entry.judged.as_ref();
        let (inputs, racy) = match (job, judged) {
            (Some(prepared), _) => (&prepared.inputs, prepared.racy),
            (None, Some(judged)) => (&judged.inputs, judged.racy),
            (None, None) => return None,
        };
        if let Some(input) = inputs.iter().find(|input| *input.path == *path) {
            let stamp = input.content.stamp();
            return Some(Dependence::Read { stamp, racy });
        }
        let by_link = match (job, judged) {
            (Some(prepared), _) => prepared.rests_on.iter().any(|it| *it.path == *path),
            (None, judged) => {
                let under = judged.and_then(|it| it.rests_on.as_ref());
                under.is_some_and(|all| all.iter().any(|it| *it.path == *path))
            }
        };
        by_link.then_some(Dependence::ByLink)
    }

    /// Handles an event that a file exists and has settled.
    pub(super) fn written(&mut self, path: &Arc<Path>, stamp: Stamp, actions: &mut Actions) {
        let id = self.files.id(path);
        let entry = id.and_then(|id| self.files.get_mut(id));
        if let Some(entry) = entry.filter(|it| it.stamp == stamp)
            && let Stage::Active(job) = *entry.stage()
        {
            entry.touched = true;
            let read = self.jobs.get(&job).and_then(|job| job.prepared.as_ref());
            entry.stale |= read.is_some_and(|it| it.racy);
        }
        self.settled(path, stamp, actions);
    }

    /// Handles a file that exists and has settled.
    pub(super) fn settled(&mut self, path: &Arc<Path>, stamp: Stamp, actions: &mut Actions) {
        self.touched(path, stamp, actions);
        let Some(kind) = FileKind::of_path(path) else {
            return;
        };
        let known = self.files.id(path);
        let id = known.unwrap_or_else(|| self.files.insert(path, kind, stamp));
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        let judged = entry.judged.as_ref();
        let read = judged.and_then(|it| it.inputs.first()?.content.stamp());
        let racy = judged.is_some_and(|it| it.racy);
        let as_judged = read == Some(stamp);
        let at_work = !matches!(entry.stage(), Stage::Idle);
        let same = entry.present && entry.stamp == stamp && (as_judged || at_work);
        let is_stale = entry.stale && !at_work;
        entry.stamp = stamp;
        entry.asked = self.now;
        self.is_there(id);
        if !as_judged {
            self.unpublish(id, actions);
        }
        if !same || racy || is_stale {
            self.changed(id);
        }
        if !same {
            self.wait_no_longer(id, actions);
        }
        self.seen(id, actions);
    }

    /// Marks a verdict as stale because a file that it depends on has changed. The file's own stamp
    /// does not show this. The verdict is valid again only after everything was read again.
    fn make_stale(&mut self, id: FileId, actions: &mut Actions) {
        self.unpublish(id, actions);
        self.look_again(id);
        self.wait_no_longer(id, actions);
    }

    /// Requests that everything a verdict depends on is read again, regardless of the file's stamp.
    fn look_again(&mut self, id: FileId) {
        if let Some(entry) = self.files.get_mut(id) {
            entry.stale = true;
        }
        self.changed(id);
    }

    /// Restarts a job that waits for other verdicts, because a file that it has read has changed.
    fn wait_no_longer(&mut self, id: FileId, actions: &mut Actions) {
        if let Some(Stage::Active(job)) = self.files.get(id).map(FileEntry::stage) {
            let job = *job;
            if self.is_held_up(job) {
                self.begin_anew(job, actions);
            }
        }
    }

    /// Withdraws an accepted file from the gate at once, before a new verdict exists.
    fn unpublish(&mut self, id: FileId, actions: &mut Actions) {
        let accepted = |judged: &Judged| judged.verdict == Verdict::Accepted;
        if let Some(entry) = self.files.get_mut(id)
            && entry.judged.as_deref().is_some_and(accepted)
            && !std::mem::replace(&mut entry.unpublished, true)
        {
            let path = entry.path.clone();
            actions.push(Action::CloseGate { path });
        }
    }

    /// Notes that the file, or a file that it depends on, has changed.
    fn changed(&mut self, id: FileId) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        if !entry.present {
            return;
        }
        entry.not_before = Duration::ZERO;
        match entry.stage() {
            Stage::Active(_) => entry.stale = true,
            Stage::Idle | Stage::Waiting(..) => self.files.enqueue(id, Priority::Fresh, self.now),
        }
    }

    pub(super) fn vanished(&mut self, path: &Arc<Path>, actions: &mut Actions) {
        for dependent in self.files.dependents(path) {
            self.make_stale(dependent, actions);
        }
        match self.files.id(path) {
            Some(id) => self.vanished_file(id, actions),
            // The file was removed before it had settled.
            None => self.answer_gone(path, actions),
        }
    }

    /// Handles a removed file. Its result is withdrawn once it has no job left.
    pub(super) fn vanished_file(&mut self, id: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        entry.present = false;
        if let Stage::Active(job) = *entry.stage() {
            // The result stays until the job is over, but the gate is cleared at once.
            self.unpublish(id, actions);
            // No result is stored for a removed file. A job that is already with the writers
            // notices the removal itself.
            if self
                .jobs
                .get(&job)
                .is_some_and(|it| it.stage.is_before_storing())
            {
                self.end_job(job, actions);
            }
            return;
        }
        let path = entry.path.clone();
        self.forget_trials(&path, actions);
        let reporters = self.void_reports(id);
        self.files.remove(id);
        self.forget_dependencies(actions);
        *self.withdrawing.entry(path.clone()).or_default() += 1;
        actions.push(Action::Withdraw {
            path: path.clone(),
            reporters,
        });
        self.answer_gone(&path, actions);
    }

    /// Handles results or copies behind the gate that another process has removed or changed. The
    /// files that they belong to are judged again, which writes them again.
    pub(super) fn outputs_lost(&mut self, lost: &[LostOutput], actions: &mut Actions) {
        let mut files = BTreeSet::new();
        for it in lost {
            match self.files.id(&it.file) {
                Some(id) => drop(files.insert(id)),
                // The file is a part of other files and lies behind the gate for them.
                None => files.extend(self.files.dependents(&it.file)),
            }
        }
        if files.is_empty() {
            return;
        }
        for id in files {
            self.write_again(id, actions);
        }
        if let Some(text) = told_of(lost) {
            self.notice(Notice::Storing(text), actions);
        }
    }

    fn write_again(&mut self, id: FileId, actions: &mut Actions) {
        self.unpublish(id, actions);
        let Some(entry) = self.files.get_mut(id).filter(|it| it.present) else {
            return;
        };
        match *entry.stage() {
            Stage::Active(job) => {
                let job = self.jobs.get(&job);
                // In an earlier stage the job has yet to write its result.
                let is_late = job.is_some_and(|job| job.stage == JobStage::Storing);
                (entry.anew, entry.stale) = (true, entry.stale || is_late);
            }
            Stage::Idle | Stage::Waiting(..) => self.judge_anew(id),
        }
    }

    /// Notes that the journal has recorded the removal of a file.
    pub(super) fn withdrawn(&mut self, path: &Path, actions: &mut Actions) {
        if let Some(times) = self.withdrawing.get_mut(path) {
            *times -= 1;
            if *times == 0 {
                self.withdrawing.remove(path);
                self.deliver_everything(actions);
            }
        }
    }

    /// Handles the end of the first scan. Files that the journal knows and the scan did not find were removed.
    pub(super) fn scanned(&mut self, actions: &mut Actions) {
        self.scanned = true;
        let gone: Vec<FileId> = self
            .files
            .iter()
            .filter(|(_, entry)| !entry.present)
            .map(|(id, _)| id)
            .collect();
        for id in gone {
            self.vanished_file(id, actions);
        }
        self.all_are_known();
        self.count_again();
    }
}

/// Returns the message for the user about lost outputs.
fn told_of(lost: &[LostOutput]) -> Option<String> {
    let (first, others) = lost.split_first()?;
    let (output, others) = (to_text(&first.output), others.len());
    Some(match others {
        0 => format!(
            "{output} was removed or changed by another process; {} is judged again to restore it",
            to_text(&first.file)
        ),
        _ => format!(
            "{output} and {others} more files of this broker were removed or changed by another process; the \
             affected files are judged again to restore them"
        ),
    })
}
