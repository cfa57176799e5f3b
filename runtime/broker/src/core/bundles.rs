//! Bundles: who is there, who must take part in a job, and what happens when one dies.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::{Catalogue, FromPeer, Hello, JobId, Role, ToPeer};

use super::action::Action;
use super::children::LEAVE_LIMIT;
use super::files::Priority;
use super::jobs::{Share, ShareState};
use super::outcome::signature;
use super::types::{Judged, Launch, SessionId};
use super::{Actions, State};

/// A bundle by name: it outlives its processes.
#[derive(Debug, Default)]
pub(super) struct Bundle {
    pub version: String,
    pub session: Option<SessionId>,
    pub incarnation: u64,
    pub pid: u32,
    pub launch: Option<Launch>,
    pub supervised: bool,
    pub catalogue: Option<Arc<Catalogue>>,
    pub ready: bool,
    pub capacity: usize,
    /// The process has not been given any job yet.
    pub fresh_process: bool,
    /// The process has finished a job, so it is not broken from the start.
    pub proved: bool,
    pub active: BTreeSet<JobId>,
    pub queue: VecDeque<JobId>,
    pub suspects: VecDeque<JobId>,
    /// Last word of any kind.
    pub heard: Duration,
    /// Last time that it was given or ended a job.
    pub moved: Duration,
    pub joined: Duration,
    /// Since when nobody of this name is there.
    pub away_since: Option<Duration>,
    /// It leaves by drain and takes no part in new jobs.
    pub leaving: bool,
    pub done: u64,
    pub offences: u32,
    /// A job that was just cancelled: late words on it are no offence.
    pub forgiven: Option<JobId>,
    pub note: String,
}

/// Words on jobs that a bundle does not have: this many are put down to crossing messages.
const OFFENCES_FORGIVEN: u32 = 64;

/// Deaths of a bundle, alone with a file in a fresh process, until it is not tried again.
const STRIKES: u8 = 2;

impl State {
    /// A process says hello.
    pub(super) fn hello(&mut self, session: SessionId, hello: &Hello, actions: &mut Actions) {
        if self.draining() {
            // Nobody's fault and of no interest to anyone: it came as the broker went.
            let reason = "this broker is stopping".to_owned();
            actions.push(Action::Refuse { session, reason });
            return;
        }
        if let Some(reason) = self.turn_away(hello) {
            self.notice(format!("turned away: {reason}"), actions);
            actions.push(Action::Refuse { session, reason });
            return;
        }
        match hello.role {
            Role::Bundle => self.bundle_joins(session, hello, actions),
            Role::Reporter => self.reporter_joins(session, hello, actions),
        }
    }

    fn turn_away(&self, hello: &Hello) -> Option<String> {
        let ours = qcbus_messages::PROTOCOL_VERSION;
        let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        if hello.protocol != ours {
            Some(format!(
                "{} {} speaks protocol {}, this broker speaks protocol {ours}: use a build of the \
                 bundle that was made for this version of qcbus",
                hello.name, hello.version, hello.protocol
            ))
        } else if hello.name.is_empty() || hello.name.len() > 64 || !hello.name.chars().all(good) {
            Some(format!(
                "`{}` is no name for a peer: 1 to 64 of A-Z a-z 0-9 . _ -",
                hello.name
            ))
        } else {
            self.taken(hello)
        }
    }

    /// A name is taken while another live process bears it, unless the newcomer replaces it.
    fn taken(&self, hello: &Hello) -> Option<String> {
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
        (incarnation != hello.incarnation && pid != hello.pid && !replaces)
            .then(|| format!("`{}` has already joined, as process {pid}", hello.name))
    }

    fn bundle_joins(&mut self, session: SessionId, hello: &Hello, actions: &mut Actions) {
        let launch = hello.launch.map(Launch);
        if let Some(old) = self
            .bundles
            .get(&hello.name)
            .filter(|it| it.session.is_some())
        {
            let same_process = old.pid == hello.pid;
            self.replace_session(&hello.name, same_process, actions);
        }
        self.child_joined(&hello.name, launch);
        let now = self.now;
        let bundle = self.bundles.entry(hello.name.clone()).or_default();
        bundle.version.clone_from(&hello.version);
        bundle.session = Some(session);
        bundle.incarnation = hello.incarnation;
        bundle.pid = hello.pid;
        bundle.launch = launch;
        bundle.supervised = launch.is_some();
        bundle.ready = false;
        bundle.capacity = usize::from(hello.capacity).clamp(1, 64);
        bundle.fresh_process = true;
        bundle.proved = false;
        bundle.leaving = false;
        bundle.heard = now;
        bundle.moved = now;
        bundle.joined = now;
        bundle.away_since = None;
        bundle.offences = 0;
        bundle.note.clear();
        self.sessions
            .insert(session, (Role::Bundle, hello.name.clone()));
        actions.push(Action::Accept { session });
        self.drain_unwanted(&hello.name, launch, actions);
    }

    /// A newer process of the same name takes over: what the old one had goes to the new one.
    fn replace_session(&mut self, name: &str, same_process: bool, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        let Some(old) = bundle.session.take() else {
            return;
        };
        let (launch, pid) = (bundle.launch, bundle.pid);
        self.sessions.remove(&old);
        self.take_back(name, false);
        if same_process {
            actions.push(Action::Disconnect { session: old });
        } else {
            self.retire(old, launch, pid);
            actions.push(Action::Send {
                session: old,
                message: ToPeer::Drain,
            });
        }
    }

    /// Something from a bundle.
    pub(super) fn bundle_says(&mut self, name: &str, message: FromPeer, actions: &mut Actions) {
        let now = self.now;
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        bundle.heard = now;
        let (known, about) = match message {
            FromPeer::Catalogue(catalogue) => (self.catalogue(name, *catalogue, actions), None),
            FromPeer::NeedDocument { doc } => {
                self.need_document(name, doc, actions);
                (true, None)
            }
            FromPeer::Issues {
                job,
                checker,
                issues,
            } => (self.issues(name, job, checker, issues), Some(job)),
            FromPeer::CheckerDone {
                job,
                checker,
                status,
                reason,
                params,
                metadata,
            } => (
                self.checker_done(name, job, checker, status, reason, params, metadata),
                Some(job),
            ),
            FromPeer::JobDone { job, micros } => {
                (self.job_done(name, job, micros, actions), Some(job))
            }
            FromPeer::Heartbeat { .. } => (true, None),
            FromPeer::Leaving => {
                self.bundle_left(name, actions);
                (true, None)
            }
            FromPeer::ResultDone { .. } | FromPeer::WithdrawalDone { .. } => (false, None),
        };
        if !known {
            self.offence(name, about, actions);
        }
    }

    fn offence(&mut self, name: &str, about: Option<JobId>, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        if about.is_some() && about == bundle.forgiven {
            return;
        }
        bundle.offences += 1;
        if bundle.offences > OFFENCES_FORGIVEN {
            self.bundle_fails(
                name,
                "it speaks of jobs or checkers that it does not have",
                actions,
            );
        }
    }

    fn catalogue(&mut self, name: &str, catalogue: Catalogue, actions: &mut Actions) -> bool {
        let mut ids = BTreeSet::new();
        let sound = catalogue.checkers.len() <= 4096
            && catalogue
                .checkers
                .iter()
                .all(|it| !it.id.is_empty() && ids.insert(it.id.as_str()));
        if !sound {
            self.bundle_fails(
                name,
                "its catalogue names a checker twice or not at all",
                actions,
            );
            return true;
        }
        let Some(bundle) = self.bundles.get_mut(name) else {
            return false;
        };
        bundle.catalogue = Some(Arc::new(catalogue));
        bundle.ready = true;
        self.adapt_shares(name);
        self.requeue_outdated();
        self.dispatch(name, actions);
        self.fail_absent(actions);
        true
    }

    /// Parts that wait for this bundle are measured against what it offers now.
    fn adapt_shares(&mut self, name: &str) {
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        let (catalogue, version) = (bundle.catalogue.clone(), bundle.version.clone());
        for job in self.jobs.values_mut() {
            let kind = job.kind;
            if let Some(share) = job.shares.get_mut(name)
                && share.state == ShareState::Queued
            {
                share.demanded = catalogue
                    .as_deref()
                    .map_or_else(Vec::new, |it| self.demand.checkers(name, it, kind));
                share.catalogue.clone_from(&catalogue);
                share.version.clone_from(&version);
            }
        }
    }

    /// A bundle goes of its own will: it is demanded no longer.
    fn bundle_left(&mut self, name: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        if let Some(session) = bundle.session.take() {
            self.sessions.remove(&session);
            actions.push(Action::Disconnect { session });
        }
        self.drop_bundle(name, actions);
        self.child_left(name);
        // Verdicts that it took part in are outdated, unless it comes back at once.
        if !self.child_is_coming(name) {
            self.requeue_outdated();
        }
    }

    /// Forgets a bundle; jobs that still wait for it go on without it.
    pub(super) fn drop_bundle(&mut self, name: &str, actions: &mut Actions) {
        self.bundles.remove(name);
        let ids: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in ids {
            if let Some(job) = self.jobs.get_mut(&id)
                && let Some(share) = job.shares.get_mut(name)
                && !matches!(share.state, ShareState::Done | ShareState::Failed(_))
            {
                // It is not demanded any more, so the job goes on without it.
                job.shares.remove(name);
                self.finish_if_over(id, actions);
            }
        }
    }

    /// The process of a session is dead.
    pub(super) fn bundle_died(&mut self, name: &str, why: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        if let Some(session) = bundle.session.take() {
            self.sessions.remove(&session);
            actions.push(Action::Disconnect { session });
        }
        bundle.ready = false;
        bundle.away_since = Some(self.now);
        bundle.note = why.to_owned();
        let proved = bundle.proved;
        let not_demanded = bundle.catalogue.is_none() || bundle.leaving;
        self.notice(format!("{name}: {why}"), actions);
        self.take_back(name, true);
        self.condemn(name, why, actions);
        self.child_down(name, proved, why, actions);
        if not_demanded && !self.children.contains_key(name) {
            self.drop_bundle(name, actions);
            self.requeue_outdated();
        }
    }

    /// A bundle misbehaves: its session ends, its process is killed when it is one of ours, and
    /// the rest is as if it had died.
    pub(super) fn bundle_fails(&mut self, name: &str, why: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        if bundle.supervised {
            actions.push(Action::Kill {
                launch: bundle.launch,
                pid: bundle.pid,
            });
        }
        self.bundle_died(name, why, actions);
    }

    /// Takes the jobs of a session that has ended back into the bundle's queue. After a death
    /// each of them is under suspicion.
    fn take_back(&mut self, name: &str, died: bool) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        for id in std::mem::take(&mut bundle.active).into_iter().rev() {
            let Some(job) = self.jobs.get_mut(&id) else {
                continue;
            };
            let Some(share) = job.shares.get_mut(name) else {
                continue;
            };
            if let ShareState::Sent {
                alone_and_fresh, ..
            } = share.state
                && died
            {
                share.strikes += u8::from(alone_and_fresh);
                share.suspect = true;
            }
            share.unstage();
            share.state = ShareState::Queued;
            if share.suspect {
                bundle.suspects.push_front(id);
            } else {
                bundle.queue.push_front(id);
            }
        }
    }

    /// Pairs of file and bundle that have had all their chances end here.
    fn condemn(&mut self, name: &str, why: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        let mut over = Vec::new();
        for id in bundle.suspects.iter().copied() {
            if let Some(share) = self
                .jobs
                .get_mut(&id)
                .and_then(|job| job.shares.get_mut(name))
                && share.strikes >= STRIKES
            {
                share.state = ShareState::Failed(format!(
                    "{name} failed {STRIKES} times on this file alone in a fresh process: {why}"
                ));
                over.push(id);
            }
        }
        bundle.suspects.retain(|id| !over.contains(id));
        for id in over {
            self.finish_if_over(id, actions);
        }
    }

    /// The bundles that must check a file of this kind, each with its checkers.
    pub(super) fn shares_for(&self, kind: FileKind) -> BTreeMap<String, Share> {
        let share = |version: &str, catalogue: Option<Arc<Catalogue>>, demanded| Share {
            state: ShareState::Queued,
            version: version.to_owned(),
            catalogue,
            demanded,
            staged: BTreeMap::new(),
            staged_bytes: 0,
            micros: 0,
            suspect: false,
            strikes: 0,
            absent: false,
        };
        let mut shares = BTreeMap::new();
        for (name, bundle) in &self.bundles {
            let Some(catalogue) = &bundle.catalogue else {
                continue;
            };
            let demanded = self.demand.checkers(name, catalogue, kind);
            if self.takes(name, bundle, catalogue, kind) && !demanded.is_empty() {
                shares.insert(
                    name.clone(),
                    share(&bundle.version, Some(catalogue.clone()), demanded),
                );
            }
        }
        for named in self.absent_by_name() {
            shares.insert(named, share("", None, Vec::new()));
        }
        shares
    }

    fn takes(&self, name: &str, bundle: &Bundle, catalogue: &Catalogue, kind: FileKind) -> bool {
        !bundle.leaving
            && catalogue.kinds.contains(&kind)
            && self.demand.wants_bundle(name, &catalogue.alias)
    }

    /// Bundles that the configuration names and nobody has seen.
    fn absent_by_name(&self) -> Vec<String> {
        let seen = |named: &String| {
            self.bundles.iter().any(|(name, bundle)| {
                let alias = bundle.catalogue.as_ref().map_or("", |it| it.alias.as_str());
                bundle.catalogue.is_some() && self.demand.means(named, name, alias)
            })
        };
        self.demand
            .named()
            .into_iter()
            .filter(|named| !seen(named))
            .collect()
    }

    /// What [`Judged::bundles`] is when a file of this kind is judged now with everybody there.
    pub(super) fn signature(&self, kind: FileKind) -> u64 {
        let shares = self.shares_for(kind);
        signature(shares.iter().map(|(name, share)| {
            (
                name.as_str(),
                share.version.as_str(),
                share.catalogue.as_deref(),
            )
        }))
    }

    /// Whether a verdict was given under the present configuration by the present bundles.
    pub(super) fn stands(&self, kind: FileKind, judged: &Judged) -> bool {
        judged.config == self.config && judged.bundles == self.signature(kind)
    }

    /// Queues every file whose verdict was given under another configuration or by other bundles.
    pub(super) fn requeue_outdated(&mut self) {
        if !self.may_judge() {
            return;
        }
        let now_valid: BTreeMap<FileKind, u64> = FileKind::ALL
            .into_iter()
            .map(|kind| (kind, self.signature(kind)))
            .collect();
        let outdated = |judged: &Judged, kind: FileKind| {
            judged.config != self.config || now_valid.get(&kind) != Some(&judged.bundles)
        };
        let ids: Vec<u32> = self
            .files
            .iter()
            .filter(|(_, entry)| {
                entry
                    .judged
                    .as_ref()
                    .is_some_and(|it| outdated(it, entry.kind))
            })
            .map(|(id, _)| id)
            .collect();
        for id in ids {
            self.files.enqueue(id, Priority::Background, self.now);
        }
    }

    /// Fails the shares of bundles that are not there and will not come in time.
    pub(super) fn fail_absent(&mut self, actions: &mut Actions) {
        let names: BTreeSet<String> = self
            .jobs
            .values()
            .flat_map(|job| job.shares.iter())
            .filter(|(_, share)| share.state == ShareState::Queued)
            .map(|(name, _)| name.clone())
            .collect();
        for name in names {
            if let Some(why) = self.hopeless(&name) {
                self.fail_queued(&name, &why, actions);
            }
        }
    }

    /// Why there is no use in waiting for this bundle, if there is none.
    fn hopeless(&self, name: &str) -> Option<String> {
        let Some(bundle) = self.bundles.get(name) else {
            let starting = self.child_is_coming(name);
            return (!starting)
                .then(|| format!("the configuration demands {name}, which has not joined"));
        };
        let since = bundle.away_since.filter(|_| bundle.session.is_none())?;
        let away = self.now.saturating_sub(since);
        let note = &bundle.note;
        if self.child_gave_up(name) {
            Some(format!(
                "{name} keeps failing and is not started for the time being: {note}"
            ))
        } else if away >= self.settings.absence_limit {
            Some(format!("{name} is not there: {note}"))
        } else {
            None
        }
    }

    fn fail_queued(&mut self, name: &str, why: &str, actions: &mut Actions) {
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.queue.clear();
            bundle.suspects.clear();
        }
        let ids: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in ids {
            if let Some(share) = self
                .jobs
                .get_mut(&id)
                .and_then(|job| job.shares.get_mut(name))
                && share.state == ShareState::Queued
            {
                share.state = ShareState::Failed(why.to_owned());
                share.absent = true;
                self.finish_if_over(id, actions);
            }
        }
    }

    /// Looks for bundles that hang, are silent, or never get ready.
    pub(super) fn watch_bundles(&mut self, actions: &mut Actions) {
        let mut failing: Vec<(String, String)> = Vec::new();
        for (name, bundle) in &mut self.bundles {
            if bundle.session.is_none() {
                continue;
            }
            let since = |then: Duration| self.now.saturating_sub(then);
            let quiet = since(bundle.heard);
            if bundle.leaving && bundle.active.is_empty() && since(bundle.moved) > LEAVE_LIMIT {
                failing.push((name.clone(), "it was told to go and did not".into()));
            } else if !bundle.ready {
                if since(bundle.joined) > self.settings.silence_limit {
                    failing.push((
                        name.clone(),
                        "it joined and never said what it checks".into(),
                    ));
                }
            } else if !bundle.active.is_empty() && since(bundle.moved) > self.settings.job_deadline
            {
                let limit = self.settings.job_deadline.as_secs_f64();
                failing.push((
                    name.clone(),
                    format!("it did not end a job within {limit} s"),
                ));
            } else if !bundle.active.is_empty()
                && quiet.min(since(bundle.moved)) > self.settings.silence_limit
            {
                let limit = self.settings.silence_limit.as_secs_f64();
                failing.push((name.clone(), format!("it said nothing for {limit} s")));
            }
        }
        for (name, why) in failing {
            self.bundle_fails(&name, &why, actions);
        }
    }
}
