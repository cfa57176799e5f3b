//! Bundles: their sessions, their messages and the handling of a dead bundle.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::shown::moves;
use qcbus_messages::{Catalogue, DocId, FromPeer, Hello, IS_STOPPING, JobId, Role, ToPeer};
use qcbus_types::{Action, Launch, Member, Notice, Origin, SessionId, VersionDigest};

use super::draining::LEAVE_LIMIT;
use super::queue::Queue;
use super::registration::Registration;
use super::{Actions, State};

/// A bundle, identified by its name. It outlives its processes.
#[derive(Debug, Default)]
pub(super) struct Bundle {
    pub version: String,
    pub session: Option<SessionId>,
    pub incarnation: u64,
    pub pid: u32,
    pub launch: Option<Launch>,
    pub catalogue: Option<Arc<Catalogue>>,
    /// Its registration while that is distrusted.
    pub pending_registration: Option<Registration>,
    /// Digest of the started program at the last accepted registration.
    pub accepted_spec: Option<u64>,
    /// Documents that it was missing, each with the time of its last report.
    pub lacks: BTreeMap<DocId, Duration>,
    /// Reason why it is in the registry. `None`: it is not in the registry and is not required.
    pub origin: Option<Origin>,
    /// Version digest of the version and catalogue in the registry.
    pub version_digest: Option<VersionDigest>,
    pub ready: bool,
    pub capacity: usize,
    /// Number of threads as reported by the bundle. Shown in the status only.
    pub threads: u16,
    /// The process has not received any job yet.
    pub fresh_process: bool,
    /// The process has finished a job, so it is not broken from the start.
    pub proved: bool,
    pub active: BTreeMap<JobId, Given>,
    pub queue: Queue,
    pub quarantine: VecDeque<JobId>,
    /// The highest job that this session has received.
    pub highest: Option<JobId>,
    /// Number of jobs sent in this session.
    pub given: u64,
    /// Time of the last message of any kind.
    pub heard: Duration,
    /// Time when it last received or finished a job.
    pub moved: Duration,
    pub joined: Duration,
    /// Time since which no process with this name has been connected.
    pub away_since: Option<Duration>,
    /// It is draining and takes no part in new jobs.
    pub draining: bool,
    pub done: u64,
    pub offences: u32,
    pub note: String,
}

/// A job that was sent to a bundle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Given {
    /// Sequence number of the job in its session.
    pub number: u64,
    /// Time when a job that was sent later finished first.
    pub overtaken: Option<Duration>,
}

/// Validity of a message about a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    /// The bundle has the job.
    Due,
    /// The bundle had the job or may have had it. The message was already sent when the job was cancelled.
    Late,
    /// The bundle never received such a job.
    Lie,
}

/// Maximum length of a peer's version in bytes.
const MOST_OF_A_VERSION: usize = 128;
/// Maximum number of bundles in the registry, and of reporters that have received results.
const MOST_NAMES: usize = 256;

/// Number of false messages about jobs and checkers beyond which a bundle is stopped.
const LIES_FORGIVEN: u32 = 64;

impl Bundle {
    /// Returns the registry entry for the journal, or `None` as long as the catalogue is unknown.
    pub fn as_member(&self, name: &str) -> Option<Member> {
        Some(Member {
            name: name.to_owned(),
            version: self.version.clone(),
            catalogue: Some(self.catalogue.clone()?),
            origin: self.origin?,
        })
    }

    /// Queues a job for this bundle.
    pub fn expect(&mut self, id: JobId, is_on_demand: bool) {
        self.queue.push(id, is_on_demand);
    }

    /// Notes that the bundle has received a job.
    pub fn give(&mut self, id: JobId, now: Duration) {
        self.given += 1;
        let (number, overtaken) = (self.given, None);
        self.active.insert(id, Given { number, overtaken });
        self.highest = self.highest.max(Some(id));
        self.fresh_process = false;
        self.moved = now;
    }

    /// Notes that the bundle has finished a job. Jobs that it received earlier are overtaken.
    pub fn take(&mut self, id: JobId, now: Duration) {
        let Some(ended) = self.active.remove(&id) else {
            return;
        };
        for given in self
            .active
            .values_mut()
            .filter(|it| it.number < ended.number)
        {
            given.overtaken.get_or_insert(now);
        }
        self.done += 1;
        self.moved = now;
        self.proved = true;
    }

    fn word(&self, about: JobId) -> Word {
        if self.active.contains_key(&about) {
            Word::Due
        } else if Some(about) <= self.highest {
            Word::Late
        } else {
            Word::Lie
        }
    }
}

impl State {
    /// Handles the hello of a process.
    pub(super) fn hello(&mut self, session: SessionId, hello: &Hello, actions: &mut Actions) {
        if self.draining() {
            let reason = IS_STOPPING.to_owned();
            actions.push(Action::Refuse { session, reason });
            return;
        }
        if let Some(reason) = self.refusal(hello) {
            self.notice(Notice::TurnedAway(reason.clone()), actions);
            actions.push(Action::Refuse { session, reason });
            return;
        }
        match hello.role {
            Role::Bundle => self.bundle_joins(session, hello, actions),
            Role::Reporter => self.reporter_joins(session, hello, actions),
        }
    }

    fn refusal(&self, hello: &Hello) -> Option<String> {
        let ours = qcbus_messages::PROTOCOL_VERSION;
        let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        let known = || match hello.role {
            Role::Bundle => (self.bundles.contains_key(&hello.name), self.bundles.len()),
            Role::Reporter => (
                self.reporter_named(&hello.name).is_some(),
                self.reporters.len(),
            ),
        };
        if hello.protocol != ours {
            Some(format!(
                "{} {} uses protocol {}, this broker uses protocol {ours}: use a build of the bundle that was \
                 made for this version of qcbus",
                hello.name, hello.version, hello.protocol
            ))
        } else if hello.name.is_empty() || hello.name.len() > 64 || !hello.name.chars().all(good) {
            Some(format!(
                "`{}` is not a valid peer name: use 1 to 64 of A-Z a-z 0-9 . _ -",
                hello.name
            ))
        } else if hello.version.len() > MOST_OF_A_VERSION || hello.version.chars().any(moves) {
            Some(format!(
                "the version of `{}` contains control characters or has more than {MOST_OF_A_VERSION} bytes",
                hello.name
            ))
        } else if let (false, MOST_NAMES..) = known() {
            Some(format!(
                "there is no room for `{}`: {MOST_NAMES} names are already known; remove bundles that are no \
                 longer required with `qcbus bundle remove`",
                hello.name
            ))
        } else {
            self.taken(hello)
        }
    }

    /// Returns the reason why a name is taken, or `None`. A name is taken while another live
    /// process uses it, unless the new process replaces that one. The names of children are always
    /// reserved, so no other process may judge in their place.
    fn taken(&self, hello: &Hello) -> Option<String> {
        if hello.launch.is_none() && self.children.contains_key(&hello.name) {
            return Some(format!(
                "the broker itself starts `{}`, from a manifest or because it comes with qcbus, so no other \
                 process may use this name; give this process another name (to run bundles that come with qcbus \
                 manually, start the broker with --no-standard-bundles)",
                hello.name
            ));
        }
        let (incarnation, pid) = match hello.role {
            Role::Bundle => {
                let bundle = self.bundles.get(&hello.name)?;
                bundle.session?;
                (bundle.incarnation, bundle.pid)
            }
            Role::Reporter => {
                let reporter = self.reporter_named(&hello.name)?;
                reporter.session?;
                (reporter.incarnation, reporter.pid)
            }
        };
        let replaces = hello
            .launch
            .is_some_and(|launch| self.is_successor(&hello.name, Launch(launch)));
        // The process id is 0 if the process cannot be seen from here.
        let same = incarnation == hello.incarnation || (pid == hello.pid && pid != 0);
        (!same && !replaces)
            .then(|| format!("`{}` has already joined as process {pid}", hello.name))
    }

    fn bundle_joins(&mut self, session: SessionId, hello: &Hello, actions: &mut Actions) {
        let launch = hello.launch.map(Launch);
        let there = self
            .bundles
            .get(&hello.name)
            .filter(|it| it.session.is_some());
        if let Some(old) = there {
            let same_process = old.pid == hello.pid && old.pid != 0;
            self.replace_session(&hello.name, same_process, actions);
        }
        self.child_joined(&hello.name, launch, &hello.version, actions);
        let now = self.now;
        let bundle = self.bundles.entry(hello.name.clone()).or_default();
        bundle.version.clone_from(&hello.version);
        bundle.session = Some(session);
        bundle.incarnation = hello.incarnation;
        bundle.pid = hello.pid;
        bundle.launch = launch;
        bundle.ready = false;
        bundle.pending_registration = None;
        bundle.lacks.clear();
        bundle.capacity = usize::from(hello.capacity).clamp(1, 64);
        bundle.threads = hello.threads;
        bundle.fresh_process = true;
        bundle.proved = false;
        bundle.draining = false;
        (bundle.highest, bundle.given) = (None, 0);
        (bundle.heard, bundle.moved, bundle.joined) = (now, now, now);
        bundle.away_since = None;
        bundle.offences = 0;
        bundle.note.clear();
        self.sessions
            .insert(session, (Role::Bundle, hello.name.as_str().into()));
        actions.push(Action::Accept { session });
        self.drain_unwanted(&hello.name, launch, actions);
    }

    /// Lets a newer process of the same name take over. It gets the tasks of the old process.
    fn replace_session(&mut self, name: &str, same_process: bool, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        let Some(old) = bundle.session.take() else {
            return;
        };
        let launch = bundle.launch;
        self.sessions.remove(&old);
        self.take_back(name, false);
        if same_process {
            actions.push(Action::Disconnect { session: old });
        } else {
            self.retire(old, launch);
            actions.push(Action::Send {
                session: old,
                message: ToPeer::Drain,
            });
        }
    }

    /// Handles a message of a bundle. Returns `false` if the message was only added to the pending findings.
    pub(super) fn bundle_says(
        &mut self,
        name: &str,
        message: FromPeer,
        actions: &mut Actions,
    ) -> bool {
        let now = self.now;
        let Some(bundle) = self.bundles.get_mut(name) else {
            return true;
        };
        bundle.heard = now;
        match about(&message).map(|job| bundle.word(job)) {
            None | Some(Word::Due) => {}
            Some(Word::Late) => return true,
            Some(Word::Lie) => {
                self.lie(name, actions);
                return true;
            }
        }
        let put_aside = matches!(
            message,
            FromPeer::Issues { .. } | FromPeer::CheckersDone { .. }
        );
        let is_true = match message {
            FromPeer::Catalogue(catalogue) => {
                self.catalogue(name, *catalogue, actions);
                true
            }
            FromPeer::NeedDocument { doc } => {
                self.need_document(name, doc, actions);
                true
            }
            FromPeer::Issues {
                job,
                checker,
                issues,
            } => self.issues(name, job, checker, issues),
            FromPeer::CheckersDone { job, ended } => {
                // All entries are processed, even if one of them is false.
                let ended = ended.into_iter();
                let lies = ended.filter_map(|end| {
                    let is_true = self.checker_done(name, job, end);
                    (!is_true).then_some(())
                });
                lies.count() == 0
            }
            FromPeer::JobDone { job, micros } => self.job_done(name, job, micros, actions),
            FromPeer::Heartbeat { .. } => true,
            FromPeer::Leaving => {
                self.bundle_left(name, actions);
                true
            }
            FromPeer::ResultDone { .. } | FromPeer::WithdrawalDone { .. } => false,
        };
        if !is_true {
            self.lie(name, actions);
        }
        !(put_aside && is_true)
    }

    fn lie(&mut self, name: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        bundle.offences += 1;
        if bundle.offences > LIES_FORGIVEN {
            let why = "it refers to jobs or checkers that it was never given";
            self.bundle_fails(name, why, actions);
        }
    }

    /// Handles the message of a bundle that it leaves.
    fn bundle_left(&mut self, name: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        if let Some(session) = bundle.session.take() {
            self.sessions.remove(&session);
            actions.push(Action::Disconnect { session });
        }
        (bundle.ready, bundle.away_since) = (false, Some(self.now));
        bundle.note = "it has left".to_owned();
        let stays = bundle.origin == Some(Origin::Supervised) && !bundle.draining;
        self.take_back(name, false);
        self.child_left(name);
        // During the shutdown of the broker no bundle leaves the registry. The same holds for a
        // child as long as its manifest exists.
        if !stays && !self.draining() {
            self.drop_bundle(name, actions);
        }
    }

    /// Removes a bundle from the registry. Jobs that still wait for it continue without it.
    pub(super) fn drop_bundle(&mut self, name: &str, actions: &mut Actions) {
        self.strike(name, actions);
        self.reseat = true;
    }

    /// Handles the death of the process of a session.
    pub(super) fn bundle_died(&mut self, name: &str, why: &str, actions: &mut Actions) {
        let notice = Notice::ended(name, why);
        self.bundle_is_down(name, notice, actions);
    }

    /// Handles a misbehaving bundle. Its session ends, and its process is killed if the broker
    /// started it. All other steps are the same as after its death.
    pub(super) fn bundle_fails(&mut self, name: &str, why: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        let launch = bundle.launch;
        actions.extend(launch.map(|launch| Action::Kill { launch }));
        let notice = Notice::killed(name, why);
        self.bundle_is_down(name, notice, actions);
    }

    fn bundle_is_down(&mut self, name: &str, notice: Notice, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        if let Some(session) = bundle.session.take() {
            self.sessions.remove(&session);
            actions.push(Action::Disconnect { session });
        }
        bundle.ready = false;
        bundle.away_since = Some(self.now);
        bundle.note = notice.why();
        let (proved, why) = (bundle.proved, bundle.note.clone());
        let nobody_misses_it = bundle.origin.is_none() || bundle.draining;
        self.notice(notice, actions);
        self.take_back(name, true);
        self.condemn(name, &why);
        self.refuse_quarantined(actions);
        self.child_down(name, proved, &why, actions);
        if nobody_misses_it && !self.children.contains_key(name) {
            self.drop_bundle(name, actions);
        }
    }

    /// Looks for bundles that hang, are silent, forget a job or never get ready.
    pub(super) fn watch_bundles(&mut self, actions: &mut Actions) {
        let there = self.bundles.iter().filter(|(_, it)| it.session.is_some());
        let failing = there.filter_map(|(name, it)| Some((name.clone(), self.fault_of(it)?)));
        for (name, why) in failing.collect::<Vec<_>>() {
            self.bundle_fails(&name, &why, actions);
        }
    }

    /// Returns the fault of a joined bundle, or `None`.
    fn fault_of(&self, bundle: &Bundle) -> Option<String> {
        let since = |then: Duration| self.now.saturating_sub(then);
        let (deadline, silence) = (self.settings.job_deadline, self.settings.silence_limit);
        let still = since(bundle.moved);
        if bundle.draining && bundle.active.is_empty() && still > LEAVE_LIMIT {
            return Some("it was asked to leave but did not".to_owned());
        }
        if bundle.pending_registration.is_some() {
            return None;
        }
        if !bundle.ready {
            let late = since(bundle.joined) > silence;
            return late.then(|| "it joined but did not register its checkers".to_owned());
        }
        if bundle.active.is_empty() {
            return None;
        }
        let mut given = bundle.active.values();
        if given.any(|it| it.overtaken.is_some_and(|then| since(then) > deadline)) {
            let limit = deadline.as_secs_f64();
            return Some(format!(
                "it did not finish a job, but finished a later one more than {limit} s ago"
            ));
        }
        if still > deadline {
            let limit = deadline.as_secs_f64();
            return Some(format!("it did not finish a job within {limit} s"));
        }
        let silent = since(bundle.heard).min(still) > silence;
        silent.then(|| format!("it sent nothing for {} s", silence.as_secs_f64()))
    }
}

/// Returns the job that a message of a bundle refers to.
fn about(message: &FromPeer) -> Option<JobId> {
    match message {
        FromPeer::Issues { job, .. }
        | FromPeer::CheckersDone { job, .. }
        | FromPeer::JobDone { job, .. } => Some(*job),
        _ => None,
    }
}
