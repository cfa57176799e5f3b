//! The thread that checks, so that the loop on the bus stays free to talk.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Instant;

use qcbus_bus::Held;
use qcbus_document::{Document, FileKind};
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Issue;
use qcbus_messages::{JobId, Link, MissingDocument};
use tokio::sync::mpsc;

use crate::kept::KeptModels;
use crate::subject::LinkedImage;
use crate::{Listener, Outcome, Plan, Subject, check};

/// What the thread is told.
pub(super) enum Order {
    /// A job.
    Check(Box<Work>),
    /// The broker needs shared memory: documents that are only kept go.
    LetGo,
}

/// One job, with everything that checking it takes.
pub(super) struct Work {
    pub job: JobId,
    pub kind: FileKind,
    pub plan: Arc<Plan>,
    pub root: Held,
    pub links: Vec<Link>,
    pub linked: Vec<LinkedImage>,
    pub missing: Vec<MissingDocument>,
    pub cancelled: Arc<AtomicBool>,
    pub checker: Arc<CheckerAtWork>,
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

/// Starts the thread. It ends when the sender of its orders is dropped.
pub(super) fn start(
    models: KeptModels,
    progress: mpsc::UnboundedSender<Progress>,
) -> std::io::Result<std::sync::mpsc::Sender<Order>> {
    let (sender, orders) = std::sync::mpsc::channel::<Order>();
    std::thread::Builder::new()
        .name("checker".to_owned())
        .spawn(move || {
            for order in orders {
                // The documents are let go before the broker hears that the job is done, but for
                // those of a few models.
                let finished = match order {
                    Order::Check(work) => finish(&work, &models, &progress),
                    Order::LetGo => {
                        models.clear();
                        continue;
                    }
                };
                if progress.send(finished).is_err() {
                    return;
                }
            }
        })?;
    Ok(sender)
}

/// Does one job.
fn finish(
    work: &Work,
    models: &KeptModels,
    progress: &mpsc::UnboundedSender<Progress>,
) -> Progress {
    let start = Instant::now();
    let outcome = one(work, models, progress);
    // What was at hand when a rule or a model panicked is not given to the next job.
    if outcome == Ok(Trust::All) {
        models.tidy();
    } else {
        models.clear();
    }
    Progress::Finished {
        job: work.job,
        micros: u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX),
        failed: outcome.err(),
    }
}

/// What may be used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trust {
    All,
    /// A checker has failed.
    Nothing,
}

fn one(
    work: &Work,
    models: &KeptModels,
    progress: &mpsc::UnboundedSender<Progress>,
) -> Result<Trust, String> {
    let unopened = |what: &str, error| format!("failed to {error} ({what})");
    let root = Document::open(&work.root).map_err(|error| unopened("the root", error))?;
    let linked = work.linked.iter().map(|linked| {
        let opened = linked.open(models);
        opened.map_err(|error| unopened(&linked.path, error))
    });
    let linked = linked.collect::<Result<Vec<_>, String>>()?;
    let bundle = work.plan.bundle();
    let subject = Subject::new(root, work.kind, (bundle.version_of)(&root))
        .with(linked, work.missing.clone())
        .with_links(work.links.clone())
        .read(bundle.reads);
    let mut reporter = Reporter {
        work,
        progress,
        trust: Trust::All,
    };
    check(&work.plan, &subject, &mut reporter);
    Ok(reporter.trust)
}

struct Reporter<'w> {
    work: &'w Work,
    progress: &'w mpsc::UnboundedSender<Progress>,
    trust: Trust,
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
        if matches!(outcome.ending, Ending::Failed { .. }) {
            self.trust = Trust::Nothing;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept::tests::{First, image};

    #[test]
    fn what_is_only_kept_goes_when_the_broker_needs_memory() {
        let models = KeptModels::default();
        let (told, mut progress) = mpsc::unbounded_channel();
        let orders = start(models.clone(), told).unwrap();
        models.get::<First>((1, 1), &image(1, 1)).unwrap();
        assert_eq!(models.len(), 1);
        orders.send(Order::LetGo).unwrap();
        drop(orders);
        assert!(progress.blocking_recv().is_none(), "the thread has ended");
        assert_eq!(models.len(), 0);
    }
}
