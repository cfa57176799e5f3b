//! Runs a bundle as a daemon on the bus: one loop communicates, and threads check.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use qcbus_bus::{Instance, JoinError, Peer, PeerEvent};
use qcbus_document::Image;
use qcbus_formats::config::Config;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Issue;
use qcbus_messages::path_text::to_text;
use qcbus_messages::{
    CheckerEnd, Digest, DocId, FromPeer, Hello, IS_STOPPING, Job, JobId, PROTOCOL_VERSION, Role,
    ToPeer, codec,
};
use tokio::sync::mpsc;

use super::Exit;
use super::batches::{batches, batches_of_ends};
use super::file::complain;
use super::module::configured;
use super::stand::{Ended, Sandbox, Sessions, Stand, sandboxed};
use super::worker::{CheckerAtWork, Finished, Work, Workers};
use crate::cached::CachedModels;
use crate::subject::LinkedImage;
use crate::{Bundle, Outcome, Permits, Plan, UserFiles};

/// Options for joining the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusOptions {
    /// Name of the instance.
    pub instance: String,
    /// Directory of the instance, if it is not the one that belongs to the name.
    pub instance_dir: Option<PathBuf>,
    /// Number of the launch, given by the supervisor that started this process.
    pub launch: Option<u64>,
    /// Ends this process when its parent ends.
    pub die_with_parent: bool,
    /// Directory of the user's schemas.
    pub schema_dir: Option<PathBuf>,
    /// Disables the sandbox.
    pub no_sandbox: bool,
    /// Threads that check at the same time.
    pub threads: usize,
    /// Files that the program of the bundle reads while it checks.
    pub own: OwnFiles,
}

/// Files that the program of a bundle reads while it checks, such as the modules of an interpreter.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OwnFiles {
    /// Files and directories.
    pub reads: Vec<PathBuf>,
    /// Directories whose entries it may list, but not read.
    pub lists: Vec<PathBuf>,
    /// Whether the permissions of the manifest apply only to processes that it started before it
    /// joined. The bundle itself then runs without them.
    pub restricted: bool,
}

impl Default for BusOptions {
    fn default() -> BusOptions {
        BusOptions {
            instance: "default".to_owned(),
            instance_dir: None,
            launch: None,
            die_with_parent: false,
            schema_dir: None,
            no_sandbox: false,
            threads: Permits::available(),
            own: OwnFiles::default(),
        }
    }
}

/// Returns how many jobs the broker may send ahead. The next jobs are then ready while others are
/// checked.
fn capacity(threads: usize) -> u16 {
    u16::try_from((2 * threads + 4).clamp(8, 64)).unwrap_or(64)
}

/// Interval of heartbeats. Missing documents are requested again at the same interval.
const HEARTBEAT: Duration = Duration::from_secs(1);
/// Maximum time from the welcome of a broker to its configuration.
const CONFIGURED_WITHIN: Duration = Duration::from_secs(2);

pub(super) fn run(bundle: &'static Bundle, options: BusOptions, given: Option<&UserFiles>) -> Exit {
    if options.die_with_parent && !follow_parent() {
        return Exit::Accepted;
    }
    let instance = match options.instance_dir {
        Some(dir) => Ok(Instance::at(dir)),
        None => Instance::named(&options.instance),
    };
    let instance = match instance {
        Ok(instance) => instance,
        Err(error) => return fail(&error.to_string(), Exit::Usage),
    };
    let supervised = options.launch.is_some() || options.die_with_parent;
    let sessions = Sessions {
        only_one: options.die_with_parent,
        supervised,
        unfenced: options.no_sandbox,
    };
    let threads = options.threads;
    let hello = hello(bundle, options.launch, threads);
    let own = options.own;
    sandboxed(&instance, &sessions, |stand| {
        // A bundle is confined before its first thread starts, so the runtime must not start any.
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime = match runtime {
            Ok(runtime) => runtime,
            Err(error) => {
                return Ended::With(fail(&format!("failed to start: {error}"), Exit::Internal));
            }
        };
        runtime.block_on(async {
            let stops = Stops::listen(supervised);
            let bundle = Checking {
                bundle,
                given: given.cloned(),
                own: &own,
            };
            serve(bundle, &stand, hello.clone(), stops).await
        })
    })
}

/// Asks the system to end this process with its parent. Returns `false` if the parent has already
/// ended.
fn follow_parent() -> bool {
    use rustix::process::{Signal, getppid, set_parent_process_death_signal};
    let parent = getppid();
    if let Err(error) = set_parent_process_death_signal(Some(Signal::TERM)) {
        tracing::warn!(%error, "cannot follow the parent process");
    }
    // The parent may have died between the two calls. Then this process has another parent now.
    parent.is_some() && getppid() == parent
}

fn hello(bundle: &Bundle, launch: Option<u64>, threads: usize) -> Hello {
    Hello {
        protocol: PROTOCOL_VERSION,
        role: Role::Bundle,
        name: bundle.name.to_owned(),
        version: bundle.version.to_owned(),
        incarnation: incarnation(),
        pid: std::process::id(),
        launch,
        capacity: capacity(threads),
        threads: u16::try_from(threads).unwrap_or(u16::MAX),
    }
}

/// Returns a number that no other process has, because the hasher's keys are random.
fn incarnation() -> u64 {
    use std::hash::BuildHasher as _;
    std::hash::RandomState::new().hash_one((std::process::id(), std::time::SystemTime::now()))
}

/// Signals by which a person stops a bundle that was started by hand. The broker drains a bundle
/// that a supervisor started. Such a bundle ends immediately on a signal.
struct Stops(Vec<tokio::signal::unix::Signal>);

impl Stops {
    fn listen(supervised: bool) -> Stops {
        use tokio::signal::unix::{SignalKind, signal};
        let kinds = [SignalKind::terminate(), SignalKind::interrupt()];
        let kinds = kinds.into_iter().filter(|_| !supervised);
        // If the system refuses a handler, the signal ends the process by default.
        Stops(kinds.filter_map(|kind| signal(kind).ok()).collect())
    }

    /// Cancel-safe.
    async fn next(&mut self) {
        std::future::poll_fn(|context| {
            let told = |it: &mut tokio::signal::unix::Signal| it.poll_recv(context).is_ready();
            if self.0.iter_mut().any(told) {
                std::task::Poll::Ready(())
            } else {
                std::task::Poll::Pending
            }
        })
        .await;
    }
}

/// Inputs of a session for checking.
struct Checking<'a> {
    bundle: &'static Bundle,
    given: Option<UserFiles>,
    own: &'a OwnFiles,
}

async fn serve(
    Checking { bundle, given, own }: Checking<'_>,
    stand: &Stand<'_>,
    hello: Hello,
    mut stops: Stops,
) -> Ended {
    let (was_started, threads) = (hello.launch.is_some(), hello.threads);
    let ready = Ready::new(bundle, given.as_ref());
    let mut peer = match Peer::join(stand.instance, hello, stand.options()).await {
        Ok(peer) => peer,
        Err(error @ JoinError::NoBroker { .. }) => {
            return Ended::With(fail(&error.to_string(), Exit::NoBroker));
        }
        // A broker without files to check may end before the bundles that it started have joined.
        Err(JoinError::Refused(reason)) if was_started && reason == IS_STOPPING => {
            return Ended::With(Exit::Accepted);
        }
        Err(error) => return Ended::With(fail(&error.to_string(), Exit::Internal)),
    };
    // The sandbox must be set up before the first thread starts. It would not cover threads that
    // already exist.
    let heard = until_configured(&mut peer).await;
    let named = || files_of(bundle, given.as_ref(), &peer, &ready);
    let sandbox = stand.confine(peer.memory(), named, own);
    let (sender, mut progress) = mpsc::unbounded_channel();
    let models = CachedModels::default();
    let threads = usize::from(threads);
    let workers = match Workers::start(threads, models.clone(), sender) {
        Ok(workers) => workers,
        Err(error) => {
            let why = format!("failed to start a thread: {error}");
            return Ended::With(fail(&why, Exit::Internal));
        }
    };
    let mut daemon = Daemon {
        bundle,
        given,
        ready,
        peer,
        workers,
        models,
        plans: BTreeMap::new(),
        waiting: VecDeque::new(),
        running: BTreeMap::new(),
        runs: 0,
        asked_for: None,
        draining: false,
        stopped: false,
        sandbox,
        outgrown: false,
    };
    for event in heard {
        if let Some(ended) = daemon.hear(event) {
            return ended;
        }
    }
    let mut ticks = tokio::time::interval(HEARTBEAT);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        let ended = tokio::select! {
            event = daemon.peer.next() => daemon.hear(event),
            Some(finished) = progress.recv() => { daemon.finished(finished); None }
            _ = ticks.tick() => { daemon.tick(); None }
            () = stops.next() => daemon.stop(),
        };
        if let Some(ended) = ended {
            return ended;
        }
        daemon.start_next();
        if daemon.outgrown {
            return Ended::Again;
        }
        if daemon.draining && daemon.is_idle() {
            daemon.peer.send(&FromPeer::Leaving);
            daemon.peer.leave().await;
            return Ended::With(Exit::Accepted);
        }
    }
}

/// Collects events until the configuration arrives, because it may name files. The bundle can check
/// nothing before.
async fn until_configured(peer: &mut Peer) -> Vec<PeerEvent> {
    let mut heard = Vec::new();
    let configured = async {
        while peer.config().is_none() {
            heard.push(peer.next().await);
            if matches!(heard.last(), Some(PeerEvent::Closed { .. })) {
                return;
            }
        }
    };
    // A broker always sends a configuration. If one does not, its jobs show this later.
    let _ = tokio::time::timeout(CONFIGURED_WITHIN, configured).await;
    heard
}

/// Returns the files and directories that the configuration in force names, and those of the user.
fn files_of(
    bundle: &'static Bundle,
    given: Option<&UserFiles>,
    peer: &Peer,
    ready: &Ready,
) -> Vec<PathBuf> {
    let config = peer
        .config()
        .and_then(|(_, bytes)| codec::decode(&bytes).ok());
    let config: Option<Config> = config.flatten();
    match &config {
        Some(config) => configured(bundle, Some(config), given).files(),
        None => ready.plan.files(),
    }
}

/// Data that is the same for every broker. It is prepared before the first broker exists, because a
/// run of `check` waits for its bundles.
struct Ready {
    /// Catalogue of the bundle.
    catalogue: FromPeer,
    /// Plan that applies without a configuration.
    plan: Arc<Plan>,
}

impl Ready {
    fn new(bundle: &'static Bundle, given: Option<&UserFiles>) -> Ready {
        let mut catalogue = bundle.catalogue();
        if let Some(given) = given {
            given.tell(&mut catalogue);
        }
        Ready {
            catalogue: FromPeer::Catalogue(Box::new(catalogue)),
            plan: Arc::new(configured(bundle, None, given)),
        }
    }
}

struct Daemon {
    bundle: &'static Bundle,
    given: Option<UserFiles>,
    ready: Ready,
    peer: Peer,
    workers: Workers,
    models: CachedModels,
    /// Configurations with their plans. A plan is made once, unless files that its configuration
    /// names change.
    plans: BTreeMap<Digest, (Option<Config>, Arc<Plan>)>,
    waiting: VecDeque<Job>,
    /// Jobs that the threads are checking, by the number of the run.
    running: BTreeMap<u64, Running>,
    /// Number of runs so far.
    runs: u64,
    /// First waiting job, if its missing documents were requested since the last heartbeat because
    /// no other job was ready.
    asked_for: Option<JobId>,
    draining: bool,
    /// Set when a person has stopped the bundle.
    stopped: bool,
    /// Files that it may read, if it is confined.
    sandbox: Option<Sandbox>,
    /// Set when the configuration names files that this process can no longer read.
    outgrown: bool,
}

struct Running {
    job: Job,
    plan: Arc<Plan>,
    cancelled: Arc<AtomicBool>,
    checker: Arc<CheckerAtWork>,
}

impl Daemon {
    /// Handles an event from the bus. Returns `Some` if the session is over.
    fn hear(&mut self, event: PeerEvent) -> Option<Ended> {
        match event {
            PeerEvent::Message(message) => self.obey(message),
            PeerEvent::Rejoined => self.forget_everything(),
            PeerEvent::LetGo => self.keep_nothing(),
            PeerEvent::Document(_) | PeerEvent::Config(_) => {}
            PeerEvent::Closed { reason } => {
                tracing::info!(reason, "the session has ended");
                // A supervisor distinguishes a drained bundle from one that no broker came back
                // for.
                return Some(match (self.draining, self.peer.has_lost_its_session()) {
                    (true, _) => Ended::With(Exit::Accepted),
                    (false, true) => Ended::Again,
                    (false, false) => Ended::With(Exit::NoBroker),
                });
            }
        }
        None
    }

    fn obey(&mut self, message: ToPeer) {
        match message {
            ToPeer::Welcome { .. } => {
                self.forget_everything();
                self.peer.send(&self.ready.catalogue);
            }
            // The broker does not yet know of the stop. `Leaving` tells it that this job is not
            // done.
            ToPeer::Job(_) if self.stopped => {}
            ToPeer::Job(job) => {
                self.ask_for_documents(&job);
                self.waiting.push_back(job);
            }
            ToPeer::Cancel { job } => {
                let cancelled = self.waiting.iter().position(|it| it.job == job);
                if let Some(job) = cancelled.and_then(|at| self.waiting.remove(at)) {
                    self.finished_with(&job);
                }
                for running in self.running.values().filter(|it| it.job.job == job) {
                    running.cancelled.store(true, Ordering::Relaxed);
                }
            }
            ToPeer::Drain => self.draining = true,
            // The broker ends the session after `Refused`, and `Closed` follows. Results are for
            // reporters.
            ToPeer::Refused { reason } => tracing::error!(reason, "the broker refused this bundle"),
            ToPeer::Result(_) | ToPeer::Withdrawn(_) => {}
        }
    }

    /// Stops the bundle for a person: it finishes running jobs and drops waiting ones. A second
    /// request ends it immediately.
    fn stop(&mut self) -> Option<Ended> {
        if self.stopped {
            return Some(Ended::With(Exit::Accepted));
        }
        self.stopped = true;
        self.draining = true;
        self.waiting.clear();
        None
    }

    /// Drops the cached models of documents that no job needs any more.
    fn keep_nothing(&self) {
        self.models.clear();
    }

    /// Resets the state for a new session, because earlier requests are no longer valid.
    fn forget_everything(&mut self) {
        self.waiting.clear();
        self.keep_nothing();
        for running in self.running.values() {
            running.cancelled.store(true, Ordering::Relaxed);
        }
    }

    fn tick(&mut self) {
        // This is the job that has been running for the longest time.
        let running = self.running.values().next();
        self.peer.send(&FromPeer::Heartbeat {
            job: running.map(|running| running.job.job),
            checker: running.and_then(|running| running.checker.get()),
        });
        self.asked_for = None;
    }

    /// Requests the missing documents of the first job again, because no job can start. They were
    /// lost on the way or were evicted here.
    fn ask_for_what_the_first_lacks(&mut self) {
        let Some(job) = self.waiting.front() else {
            return;
        };
        if self.asked_for.replace(job.job) != Some(job.job) {
            let missing = self.missing_documents(job);
            self.ask_for(&missing);
        }
    }

    fn ask_for_documents(&mut self, job: &Job) {
        let missing = self.missing_documents(job);
        self.ask_for(&missing);
    }

    fn missing_documents(&self, job: &Job) -> BTreeSet<DocId> {
        let docs = job.documents.iter().map(|document| document.doc);
        docs.filter(|&doc| self.peer.document(doc).is_none())
            .collect()
    }

    fn ask_for(&mut self, docs: &BTreeSet<DocId>) {
        for &doc in docs {
            self.peer.send(&FromPeer::NeedDocument { doc });
        }
    }

    /// Hands complete jobs to threads, as long as there are idle ones.
    fn start_next(&mut self) {
        while self.running.len() < self.workers.count() && !self.waiting.is_empty() {
            if !self.start_one() {
                self.ask_for_what_the_first_lacks();
                return;
            }
        }
    }

    /// Hands the first complete job to a thread. Returns `false` if there is none.
    fn start_one(&mut self) -> bool {
        for index in 0..self.waiting.len() {
            let job = self.waiting.get(index).cloned();
            let Some((plan, work)) = job.and_then(|job| self.prepare(&job)) else {
                continue;
            };
            let Some(job) = self.waiting.remove(index) else {
                return false;
            };
            self.runs += 1;
            let running = Running {
                job,
                plan,
                cancelled: work.cancelled.clone(),
                checker: work.checker.clone(),
            };
            self.running.insert(self.runs, running);
            if !self.workers.check(Box::new(work)) {
                tracing::error!("the checking threads have ended");
                self.draining = true;
                self.running.clear();
            }
            return true;
        }
        false
    }

    /// Returns the work of a job if its configuration and all its documents are available.
    fn prepare(&mut self, job: &Job) -> Option<(Arc<Plan>, Work)> {
        let held = |doc| self.peer.document(doc);
        let (root, linked) = job.documents.split_first()?;
        let links = root.links.clone();
        let root = held(root.doc)?;
        let linked = linked.iter().map(|document| {
            let held = held(document.doc)?;
            let (generation, doc) = held.identity();
            Some(LinkedImage {
                role: document.role,
                path: document.path.clone(),
                referred_at: document.referred_at,
                links: document.links.clone(),
                id: (generation, doc.0),
                image: Image::new(held),
            })
        });
        let linked = linked.collect::<Option<_>>()?;
        // The plan comes last, because it may access files.
        let plan = self.plan(job.config)?;
        let work = Work {
            run: self.runs + 1,
            kind: job.kind,
            plan: plan.clone(),
            root: Image::new(root),
            links,
            linked,
            missing: job.missing.clone(),
            cancelled: Arc::default(),
            checker: Arc::default(),
        };
        Some((plan, work))
    }

    fn plan(&mut self, digest: Digest) -> Option<Arc<Plan>> {
        let config = match self.plans.remove(&digest) {
            Some((config, plan)) if !plan.is_outdated() => {
                self.plans.insert(digest, (config, plan.clone()));
                return Some(plan);
            }
            Some((config, _)) => config,
            None => self.read_config(digest)?,
        };
        let plan = if config.is_none() && !self.ready.plan.is_outdated() {
            self.ready.plan.clone()
        } else {
            let (config, given) = (config.as_ref(), self.given.as_ref());
            Arc::new(configured(self.bundle, config, given))
        };
        if let Some(sandbox) = &self.sandbox
            && let Some(outside) = plan.files().iter().find(|it| sandbox.keeps_out(it))
        {
            let file = to_text(outside);
            tracing::info!(
                file,
                "the configuration names files that only a new process may read"
            );
            self.outgrown = true;
            return None;
        }
        self.plans.insert(digest, (config, plan.clone()));
        Some(plan)
    }

    fn read_config(&self, digest: Digest) -> Option<Option<Config>> {
        let (_, bytes) = self
            .peer
            .config()
            .filter(|(current, _)| *current == digest)?;
        let config = codec::decode::<Option<Config>>(&bytes);
        let config =
            config.inspect_err(|error| tracing::error!(%error, "cannot read the configuration"));
        config.ok()
    }

    fn finished(&mut self, finished: Finished) {
        let Finished {
            run,
            micros,
            outcome,
        } = finished;
        if let Some(job) = self.counts(run) {
            match outcome {
                Ok(ended) => self.send_outcome(job, ended),
                Err(reason) => self.send_failure(run, &reason),
            }
            self.peer.send(&FromPeer::JobDone { job, micros });
        }
        self.let_go(run);
    }

    /// Returns the job of a run if it was not cancelled.
    fn counts(&self, run: u64) -> Option<JobId> {
        let running = self.running.get(&run)?;
        let counts = !running.cancelled.load(Ordering::Relaxed);
        counts.then_some(running.job.job)
    }

    fn send_outcome(&mut self, job: JobId, ended: Vec<(u32, Vec<Issue>, Outcome)>) {
        let mut ends = Vec::with_capacity(ended.len());
        for (checker, issues, outcome) in ended {
            for issues in batches(issues) {
                self.peer.send(&FromPeer::Issues {
                    job,
                    checker,
                    issues,
                });
            }
            ends.push(CheckerEnd {
                checker,
                ending: outcome.ending,
                params: outcome.params,
                metadata: outcome.metadata,
            });
        }
        self.send_ends(job, ends);
    }

    fn send_ends(&mut self, job: JobId, ends: Vec<CheckerEnd>) {
        for ended in batches_of_ends(ends) {
            self.peer.send(&FromPeer::CheckersDone { job, ended });
        }
    }

    /// Reports that nothing could be checked: every demanded checker has failed.
    fn send_failure(&mut self, run: u64, reason: &str) {
        let running = self.running.get(&run);
        let Some((job, plan)) = running.map(|it| (it.job.job, it.plan.clone())) else {
            return;
        };
        let demanded = (0..plan.checkers().len()).filter(|&index| plan.is_demanded(index));
        let demanded = demanded.filter_map(|index| u32::try_from(index).ok());
        let ends = demanded.map(|checker| CheckerEnd {
            checker,
            ending: Ending::Failed {
                reason: reason.to_owned(),
            },
            params: Vec::new(),
            metadata: Vec::new(),
        });
        self.send_ends(job, ends.collect());
    }

    /// Ends a job and releases its documents, unless another job needs them.
    fn let_go(&mut self, run: u64) {
        if let Some(running) = self.running.remove(&run) {
            self.finished_with(&running.job);
        }
    }

    fn finished_with(&mut self, job: &Job) {
        let running = self.running.values().map(|running| &running.job);
        let others = self.waiting.iter().chain(running);
        let needed: BTreeSet<DocId> = others
            .flat_map(|job| &job.documents)
            .map(|document| document.doc)
            .collect();
        for document in &job.documents {
            if !needed.contains(&document.doc) {
                self.peer.forget(document.doc);
            }
        }
    }

    fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.running.is_empty()
    }
}

fn fail(text: &str, exit: Exit) -> Exit {
    complain(&format!("{text}\n"));
    exit
}
