//! What happens to files: they come, change and go, and so does what verdicts depend on.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;

use super::action::Action;
use super::files::{FileEntry, FileId, Priority, Stage};
use super::jobs::JobStage;
use super::notice::Notice;
use super::types::{Judged, LostOutput, Stamp};
use super::{Actions, State};

/// How a verdict depends on a file.
enum Dependence {
    /// The file was read, or looked for.
    Read {
        /// What it was then; `None` if it was not there.
        stamp: Option<Stamp>,
        /// The stamp proves nothing.
        racy: bool,
    },
    /// The file has the verdict, and a link to it was read.
    ByLink,
}

impl State {
    /// A file is there and may still be written to.
    pub(super) fn present(&mut self, path: &Arc<Path>) {
        if let Some(id) = self.files.id(path) {
            self.is_there(id);
        }
    }

    /// A file is there. When it has a verdict from before a restart, a shadow that was ready sooner than the watcher
    /// does not know of it yet.
    fn is_there(&mut self, id: FileId) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        let was_there = std::mem::replace(&mut entry.present, true);
        if !was_there && entry.judged.is_some() {
            self.let_shadows_try(id);
        }
    }

    /// A file is being written to. It is judged when it has settled, and what was accepted of it, or rests on it, goes
    /// from behind the gate until then.
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

    /// Something that a verdict depends on is being written to: nobody is told the verdict before that has settled.
    /// A job that is under way finds out by itself, when it is stored.
    fn stale_until_settled(&mut self, id: FileId) {
        if let Some(entry) = self.files.get_mut(id)
            && !matches!(entry.stage(), Stage::Active(_))
        {
            entry.stale = true;
        }
    }

    /// Whether it was told of a file that it is there, quiet, and what it is now.
    pub fn is_settled(&self, path: &Path, stamp: Stamp) -> bool {
        let entry = self.files.id(path).and_then(|id| self.files.get(id));
        entry.is_some_and(|it| it.present && it.stamp == stamp)
    }

    /// A file is there and quiet: whose verdict depends on it?
    pub(super) fn touched(&mut self, path: &Arc<Path>, stamp: Stamp, actions: &mut Actions) {
        for dependent in self.files.dependents(path) {
            match self.reading_of(dependent, path) {
                // It rests on the file and has read it by a link, which is watched, too.
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

    /// How a file was read for the verdict on another one: for the one that is on its way, else for the last.
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

    /// An event tells that a file is there and quiet.
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

    /// A file is there and quiet.
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

    /// Something that the verdict on a file depends on is not what it was. The file's own stamp
    /// does not tell, so the verdict is doubted: it stands only after everything was read again.
    fn make_stale(&mut self, id: FileId, actions: &mut Actions) {
        self.unpublish(id, actions);
        self.look_again(id);
        self.wait_no_longer(id, actions);
    }

    /// Everything that a verdict depends on is to be read again, whatever the file's stamp says.
    fn look_again(&mut self, id: FileId) {
        if let Some(entry) = self.files.get_mut(id) {
            entry.stale = true;
        }
        self.changed(id);
    }

    /// A job that waits for other verdicts begins anew when something that it has read is another by now.
    fn wait_no_longer(&mut self, id: FileId, actions: &mut Actions) {
        if let Some(Stage::Active(job)) = self.files.get(id).map(FileEntry::stage) {
            let job = *job;
            if self.is_held_up(job) {
                self.begin_anew(job, actions);
            }
        }
    }

    /// What was accepted goes from behind the gate at once, before there is a new verdict.
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

    /// The file, or something it depends on, is not what it was.
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
            // It has gone before it was finished.
            None => self.answer_gone(path, actions),
        }
    }

    /// A file has gone: its result is withdrawn once no job of it is left.
    pub(super) fn vanished_file(&mut self, id: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        entry.present = false;
        if let Stage::Active(job) = *entry.stage() {
            // The result stays until the job is over, what lies behind the gate does not.
            self.unpublish(id, actions);
            // Nothing is stored for a file that is not there; a job at the writers' will notice.
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

    /// Somebody has removed or changed results, or copies behind the gate: the files that they are about are judged
    /// again, which writes them again.
    pub(super) fn outputs_lost(&mut self, lost: &[LostOutput], actions: &mut Actions) {
        let mut files = BTreeSet::new();
        for it in lost {
            match self.files.id(&it.file) {
                Some(id) => drop(files.insert(id)),
                // A part of other files, which lies behind the gate for them.
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
                // Before that its result is still to be written.
                let is_late = job.is_some_and(|job| job.stage == JobStage::Storing);
                (entry.anew, entry.stale) = (true, entry.stale || is_late);
            }
            Stage::Idle | Stage::Waiting(..) => self.judge_anew(id),
        }
    }

    /// It is in the journal that a file has gone.
    pub(super) fn withdrawn(&mut self, path: &Path, actions: &mut Actions) {
        if let Some(times) = self.withdrawing.get_mut(path) {
            *times -= 1;
            if *times == 0 {
                self.withdrawing.remove(path);
                self.deliver_everything(actions);
            }
        }
    }

    /// The first scan is complete: what the journal knew and the scan did not see has gone.
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

/// What a person is told of outputs that are lost.
fn told_of(lost: &[LostOutput]) -> Option<String> {
    let (first, others) = lost.split_first()?;
    let (output, others) = (to_text(&first.output), others.len());
    Some(match others {
        0 => format!(
            "{output} was removed or changed by another process; {} is judged again, which writes it again",
            to_text(&first.file)
        ),
        _ => format!(
            "{output} and {others} more files of this broker were removed or changed by another process; what they are \
             about is judged again, which writes them again"
        ),
    })
}
