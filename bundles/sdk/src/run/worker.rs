//! The thread that checks, so that the loop on the bus stays free to talk.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Instant;

use qcbus_bus::Held;
use qcbus_document::{Document, FileKind};
use qcbus_formats::xqar::Issue;
use qcbus_messages::{DocumentRole, JobId, MissingDocument};
use tokio::sync::mpsc;

use crate::{Linked, Listener, Outcome, Plan, Subject, check};

/// One job, with everything that checking it takes.
pub(super) struct Work {
    pub job: JobId,
    pub kind: FileKind,
    pub plan: Arc<Plan>,
    pub root: Held,
    pub linked: Vec<LinkedHeld>,
    pub missing: Vec<MissingDocument>,
    pub cancelled: Arc<AtomicBool>,
    pub checker: Arc<CheckerAtWork>,
}

/// A document that the root refers to, as it is held.
pub(super) struct LinkedHeld {
    pub role: DocumentRole,
    pub path: String,
    pub referred_at: u32,
    pub image: Held,
}

/// Which checker the thread is at.
pub(super) struct CheckerAtWork(AtomicU32);

impl CheckerAtWork {
    /// Its index; `None` before the first one begins.
    pub fn get(&self) -> Option<u32> {
        Some(self.0.load(Ordering::Relaxed)).filter(|index| *index != u32::MAX)
    }
}

impl Default for CheckerAtWork {
    fn default() -> CheckerAtWork {
        CheckerAtWork(AtomicU32::new(u32::MAX))
    }
}

/// What the thread has to say.
pub(super) enum Progress {
    Ended {
        job: JobId,
        checker: u32,
        issues: Vec<Issue>,
        outcome: Outcome,
    },
    /// The job is over: `failed` says why nothing was checked.
    Finished {
        job: JobId,
        micros: u64,
        failed: Option<String>,
    },
}

/// Starts the thread. It ends when the sender of its work is dropped.
pub(super) fn start(
    progress: mpsc::UnboundedSender<Progress>,
) -> std::io::Result<std::sync::mpsc::Sender<Work>> {
    let (sender, works) = std::sync::mpsc::channel::<Work>();
    std::thread::Builder::new()
        .name("checker".to_owned())
        .spawn(move || {
            for work in works {
                let start = Instant::now();
                let failed = one(&work, &progress).err();
                let micros = u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX);
                let job = work.job;
                // The documents are let go before the broker hears that the job is done.
                drop(work);
                if progress
                    .send(Progress::Finished {
                        job,
                        micros,
                        failed,
                    })
                    .is_err()
                {
                    return;
                }
            }
        })?;
    Ok(sender)
}

fn one(work: &Work, progress: &mpsc::UnboundedSender<Progress>) -> Result<(), String> {
    let root = open(&work.root, "the root")?;
    let linked = work.linked.iter().map(|linked| {
        let document = open(&linked.image, &linked.path)?;
        Ok(Linked {
            document,
            role: linked.role,
            path: linked.path.clone(),
            referred_at: linked.referred_at,
        })
    });
    let linked = linked.collect::<Result<Vec<_>, String>>()?;
    let subject = Subject::new(root, work.kind, (work.plan.bundle().version_of)(&root))
        .with(linked, work.missing.clone());
    let mut reporter = Reporter { work, progress };
    check(&work.plan, &subject, &mut reporter);
    Ok(())
}

fn open<'h>(held: &'h Held, what: &str) -> Result<Document<'h>, String> {
    Document::open(held).map_err(|error| format!("failed to {error} ({what})"))
}

struct Reporter<'w> {
    work: &'w Work,
    progress: &'w mpsc::UnboundedSender<Progress>,
}

impl Listener for Reporter<'_> {
    fn is_cancelled(&mut self) -> bool {
        self.work.cancelled.load(Ordering::Relaxed)
    }

    fn begins(&mut self, checker: usize) {
        self.work.checker.0.store(index(checker), Ordering::Relaxed);
    }

    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome) {
        let job = self.work.job;
        let _ = self.progress.send(Progress::Ended {
            job,
            checker: index(checker),
            issues,
            outcome,
        });
    }
}

fn index(checker: usize) -> u32 {
    u32::try_from(checker).unwrap_or(u32::MAX)
}
