//! The checking threads, which leave the loop on the bus free to communicate. Each thread checks
//! one job after the other. Idle threads help with large jobs (`crate::permits`).

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use qcbus_document::{FileKind, Image};
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Issue;
use qcbus_messages::{Link, MissingDocument};
use tokio::sync::mpsc;

use crate::cached::{CachedModels, JobModels};
use crate::check::catch;
use crate::permits::Permits;
use crate::subject::LinkedImage;
use crate::{Listener, Outcome, Plan, Subject, check_with};

/// One job, with everything that is needed to check it.
pub(super) struct Work {
    /// Distinguishes two runs of the same job.
    pub run: u64,
    pub kind: FileKind,
    pub plan: Arc<Plan>,
    pub root: Image,
    pub links: Vec<Link>,
    pub linked: Vec<LinkedImage>,
    pub missing: Vec<MissingDocument>,
    pub cancelled: Arc<AtomicBool>,
    pub checker: Arc<CheckerAtWork>,
}

/// Index of the checker that started last.
pub(super) struct CheckerAtWork(AtomicU32);

impl CheckerAtWork {
    /// Returns the index, or `None` before the first checker starts.
    pub fn get(&self) -> Option<u32> {
        Some(self.0.load(Ordering::Relaxed)).filter(|index| *index != u32::MAX)
    }
}

impl Default for CheckerAtWork {
    fn default() -> CheckerAtWork {
        CheckerAtWork(AtomicU32::new(u32::MAX))
    }
}

/// Result of a finished job.
pub(super) struct Finished {
    pub run: u64,
    pub micros: u64,
    /// Findings and ends of the checkers, by their index, or the reason why nothing was checked.
    pub outcome: Result<Vec<(u32, Vec<Issue>, Outcome)>, String>,
}

/// The threads. They end when this value is dropped and all their jobs are done.
pub(super) struct Workers {
    jobs: Sender<Box<Work>>,
    shared: Arc<Shared>,
    threads: usize,
}

struct Shared {
    jobs: Mutex<Receiver<Box<Work>>>,
    permits: Permits,
    models: CachedModels,
    progress: mpsc::UnboundedSender<Finished>,
    /// Jobs that were given and are not done.
    busy: AtomicUsize,
}

impl Workers {
    /// Prepares one thread per permit. The first one starts now, and the others start when there
    /// are as many jobs.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(
        permits: usize,
        models: CachedModels,
        progress: mpsc::UnboundedSender<Finished>,
    ) -> std::io::Result<Workers> {
        let (jobs, receiver) = channel();
        let shared = Arc::new(Shared {
            jobs: Mutex::new(receiver),
            permits: Permits::idle(permits),
            models,
            progress,
            busy: AtomicUsize::new(0),
        });
        let mut workers = Workers {
            jobs,
            shared,
            threads: 0,
        };
        workers.one_more()?;
        Ok(workers)
    }

    /// Returns how many jobs are checked at the same time.
    pub fn count(&self) -> usize {
        self.shared.permits.count()
    }

    /// Hands a job to the threads. Returns `false` if no thread is left.
    pub fn check(&mut self, work: Box<Work>) -> bool {
        let busy = self.shared.busy.fetch_add(1, Ordering::Relaxed) + 1;
        if busy > self.threads && self.threads < self.count() {
            // If no further thread can be started, the existing threads check the job later.
            let started = self.one_more();
            let _ = started.inspect_err(|error| tracing::warn!(%error, "cannot start a thread"));
        }
        self.jobs.send(work).is_ok()
    }

    fn one_more(&mut self) -> std::io::Result<()> {
        let shared = self.shared.clone();
        let thread = std::thread::Builder::new().name("checker".to_owned());
        thread.spawn(move || shared.work())?;
        self.threads += 1;
        Ok(())
    }
}

impl Shared {
    fn work(&self) {
        loop {
            let next = {
                let jobs = self.jobs.lock().unwrap_or_else(PoisonError::into_inner);
                jobs.recv()
            };
            let Ok(work) = next else { return };
            // The documents are released before the broker learns that the job is done. Only those
            // of a few cached models remain.
            let permit = self.permits.take();
            // Panics of rules and models are caught elsewhere. Any other panic must also lead to an
            // answer for the job.
            let finished = catch(|| finish(&work, self)).unwrap_or_else(|panic| Finished {
                run: work.run,
                micros: 0,
                outcome: Err(format!("the bundle panicked: {panic}")),
            });
            drop((permit, work));
            self.busy.fetch_sub(1, Ordering::Relaxed);
            if self.progress.send(finished).is_err() {
                return;
            }
        }
    }
}

/// Checks one job.
fn finish(work: &Work, shared: &Shared) -> Finished {
    let start = Instant::now();
    let models = shared.models.for_job();
    let outcome = one(work, &models, shared);
    // Models that were in use when a rule or a model panicked are not passed on to the next job.
    let is_failed = |(_, _, outcome): &(u32, Vec<Issue>, Outcome)| {
        matches!(outcome.ending, Ending::Failed { .. })
    };
    if outcome
        .as_ref()
        .is_ok_and(|ended| !ended.iter().any(is_failed))
    {
        models.keep();
    } else {
        shared.models.clear();
    }
    Finished {
        run: work.run,
        micros: u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX),
        outcome,
    }
}

fn one(
    work: &Work,
    models: &JobModels,
    shared: &Shared,
) -> Result<Vec<(u32, Vec<Issue>, Outcome)>, String> {
    let unopened = |what: &str, error| format!("failed to {error} ({what})");
    let linked = work.linked.iter().map(|linked| {
        let opened = linked.open(models);
        opened.map_err(|error| unopened(&linked.path, error))
    });
    let linked = linked.collect::<Result<Vec<_>, String>>()?;
    let bundle = work.plan.bundle();
    let subject = Subject::new(&work.root, work.kind, bundle.version_of)
        .map_err(|error| unopened("the root", error))?
        .with(linked, work.missing.clone())
        .with_links(work.links.clone())
        .read(bundle.reads);
    let mut heard = Heard {
        work,
        ended: Vec::new(),
    };
    check_with(&work.plan, &subject, &shared.permits, &mut heard);
    Ok(heard.ended)
}

struct Heard<'w> {
    work: &'w Work,
    ended: Vec<(u32, Vec<Issue>, Outcome)>,
}

impl Listener for Heard<'_> {
    fn is_cancelled(&self) -> bool {
        self.work.cancelled.load(Ordering::Relaxed)
    }

    fn begins(&self, checker: usize) {
        self.work.checker.0.store(index(checker), Ordering::Relaxed);
    }

    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome) {
        self.ended.push((index(checker), issues, outcome));
    }
}

fn index(checker: usize) -> u32 {
    u32::try_from(checker).unwrap_or(u32::MAX)
}
