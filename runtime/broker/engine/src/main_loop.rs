//! Main loop: turns inputs into events and executes the actions of the state machine.

mod act;
mod asked;
mod early;
mod looks;
mod remains;
mod start;
mod status;
mod stores;
mod systemd;
mod turns;
mod watching;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use qcbus_bus::{HostEvent, PeerId, Process, StartError as BusError};
use qcbus_messages::control::{Response, Unseen};
use qcbus_messages::{Hello, JobId, ToPeer};
use tokio::sync::{mpsc, oneshot};

use self::remains::Remains;
use self::stores::StateDirectory;
pub use self::turns::{Source, Turn};
use self::watching::Watching;
use crate::backend::{Bus, Control, Processes};
use crate::intake::Intake;
use crate::options::Options;
use looks::{Looked, Looks};
use qcbus_configuration::InForce;
use qcbus_configuration::{Fingerprint, LoadError, Loaded, Sources};
use qcbus_control::Asked;
use qcbus_environment::reached;
use qcbus_environment::{now, spawn_blocking};
use qcbus_publish::directory_lock::LockError;
use qcbus_publish::gate::GateError;
use qcbus_publish::journal::JournalError;
use qcbus_publish::outputs::OutputWatch;
use qcbus_publish::store::Store;
use qcbus_publish::writers::Writers;
use qcbus_state::State;
use qcbus_types::{Event, Judged, Launch, Notice, RequestId, SessionId};
use qcbus_watch::{Seen, Watcher, Why};

/// Reason why a broker cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The bus failed.
    #[error("{0}")]
    Bus(#[from] BusError),
    /// The journal failed.
    #[error("{0}")]
    Journal(#[from] JournalError),
    /// The configuration or a manifest is invalid.
    #[error("{0}")]
    Load(#[from] LoadError),
    /// The results directory is locked by another process.
    #[error("{0}")]
    Results(#[from] LockError),
    /// The gate cannot be used.
    #[error("{0}")]
    Gate(#[from] GateError),
    /// The system has returned an error.
    #[error("{what}: {source}")]
    System {
        /// The failed operation.
        what: String,
        /// Error of the system.
        source: std::io::Error,
    },
}

/// Request of a user at the keyboard or of a service manager.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OperatorSignal {
    /// Finish the active work and stop.
    Drain,
    /// Stop at once.
    Quit,
    /// Read configuration and manifests again and continue.
    Reload,
}

/// A verdict for the owner of the loop.
#[derive(Debug, Clone)]
pub struct Announcement {
    /// The file.
    pub path: Arc<Path>,
    /// Its verdict.
    pub judged: Arc<Judged>,
    /// `false` if the verdict was already valid before.
    pub fresh: bool,
}

/// Message of the running loop to its owner.
#[derive(Debug, Clone)]
pub enum Told {
    /// A verdict.
    Verdict(Announcement),
    /// A notice for the user.
    Notice(Notice),
    /// The first scan is complete.
    Scanned {
        /// The known files, sorted by path.
        files: Vec<Arc<Path>>,
    },
}

/// A running broker.
pub struct Broker {
    options: Options,
    started: Instant,
    clock: AttendedTime,
    host: Box<dyn Bus>,
    state: State,
    intake: Arc<Intake>,
    store: Arc<Store>,
    writers: Writers,
    children: Box<dyn Processes>,
    sources: Sources,
    loaded: Loaded,
    /// Reason why the present configuration or a present manifest is not in force.
    not_in_force: Option<String>,
    in_force: Arc<InForce>,
    /// Fingerprint of the files that were last checked for the configuration in force. The first
    /// one is taken before they are read, because later changes are not in force.
    fingerprint: Fingerprint,
    watcher: Option<Watcher>,
    watching: Option<Watching>,
    output_watch: Option<OutputWatch>,
    watch_mode: String,
    /// Paths that could not be read, each with the reason.
    unseen: BTreeMap<PathBuf, String>,
    /// Files that are being written to and are judged when they have settled.
    unfinished: BTreeMap<Arc<Path>, Why>,
    looks: Looks,
    sessions: Sessions,
    request_ids: HashMap<RequestId, oneshot::Sender<Response>>,
    downs: Vec<oneshot::Sender<Response>>,
    next_request_id: u64,
    /// Paths of withdrawn results, by reporter and file. They are kept until the reporter has withdrawn its report.
    left: HashMap<(String, Arc<Path>), PathBuf>,
    /// Results were stored or delivered since free memory was last returned.
    untrimmed: bool,
    /// A registry change could not be recorded at once. From then on a writer records the changes, in order.
    journal_is_behind: bool,
    inbox: Inbox,
    tell: Box<dyn FnMut(Told) + Send>,
    control: Box<dyn Control>,
    state_directory: StateDirectory,
    remains: Remains,
}

impl std::fmt::Debug for Broker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Broker")
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

struct Inbox {
    events: mpsc::UnboundedReceiver<Event>,
    events_in: mpsc::UnboundedSender<Event>,
    seen: mpsc::UnboundedReceiver<Seen>,
    asked: mpsc::UnboundedReceiver<Asked>,
    notices: mpsc::UnboundedReceiver<Notice>,
    notices_in: mpsc::UnboundedSender<Notice>,
    looked: mpsc::UnboundedReceiver<Looked>,
    looked_in: mpsc::UnboundedSender<Looked>,
    deliveries: mpsc::UnboundedReceiver<Ready>,
    deliveries_in: mpsc::UnboundedSender<Ready>,
}

/// A result that was read back for a reporter, or the reason why this failed.
pub struct Ready {
    session: SessionId,
    job: JobId,
    message: Result<Box<ToPeer>, String>,
}

/// Mapping between the session numbers of the state machine and of the bus.
#[derive(Debug, Default)]
struct Sessions {
    peers: BTreeMap<SessionId, PeerId>,
    sessions: BTreeMap<PeerId, SessionId>,
    next: u64,
}

impl Sessions {
    fn add(&mut self, peer: PeerId) -> SessionId {
        self.next += 1;
        let session = SessionId(self.next);
        self.peers.insert(session, peer);
        self.sessions.insert(peer, session);
        session
    }

    fn remove(&mut self, session: SessionId) -> Option<PeerId> {
        let peer = self.peers.remove(&session)?;
        self.sessions.remove(&peer);
        Some(peer)
    }
}

/// Time during which the loop was running. While the broker stands still, it cannot receive
/// messages of bundles. Therefore they do not count as silent, and no deadline of theirs passes.
#[derive(Debug)]
struct AttendedTime {
    last: Instant,
    sum: Duration,
}

impl AttendedTime {
    /// Longer than any iteration of the loop takes.
    const LONGEST_TURN: Duration = Duration::from_secs(1);

    fn new() -> AttendedTime {
        AttendedTime {
            last: now(),
            sum: Duration::ZERO,
        }
    }

    fn now(&mut self, now: Instant) -> Duration {
        let turn = now.saturating_duration_since(self.last);
        self.last = self.last.max(now);
        self.sum += turn.min(AttendedTime::LONGEST_TURN);
        self.sum
    }
}

/// Interval of the loop's timer.
const TICK: Duration = Duration::from_millis(50);

/// Interval of the checks of configuration and manifests.
const RELOAD_INTERVAL: Duration = Duration::from_secs(1);

/// Interval of pruning the history of jobs.
const PRUNE_INTERVAL: Duration = Duration::from_secs(3600);

/// Interval of returning free memory while files are judged.
const TRIM_INTERVAL: Duration = Duration::from_secs(10);

impl Broker {
    /// Runs until all files are judged (`once`) or a user requests the end.
    pub async fn run(mut self, mut signals: mpsc::Receiver<OperatorSignal>) {
        self.begin();
        for notice in self.loaded.notices.clone() {
            self.say(Notice::Loading(notice));
        }
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut next_reload = now() + RELOAD_INTERVAL;
        // A single run without a state directory has no history.
        let lasts = self.options.state.is_some();
        let mut next_prune = now();
        let mut next_trim = now() + TRIM_INTERVAL;
        loop {
            let turn = tokio::select! {
                event = self.host.next() => Turn::Bus(event),
                Some(event) = self.inbox.events.recv() => Turn::Event(event),
                Some(seen) = self.inbox.seen.recv() => Turn::Seen(seen),
                Some(asked) = self.inbox.asked.recv() => Turn::Asked(asked),
                Some(notice) = self.inbox.notices.recv() => Turn::Notice(notice),
                Some(ready) = self.inbox.deliveries.recv() => Turn::Delivery(ready),
                Some(signal) = signals.recv() => Turn::Signal(signal),
                Some(looked) = self.inbox.looked.recv() => Turn::Looked(looked),
                _ = tick.tick() => Turn::Tick,
            };
            let quit = matches!(turn, Turn::Signal(OperatorSignal::Quit));
            if matches!(turn, Turn::Tick) {
                self.look_around();
            }
            if !self.turn(turn) {
                return self.end(quit).await;
            }
            if now() >= next_reload {
                next_reload = now() + RELOAD_INTERVAL;
                self.look_for_changes();
                self.forget_clients();
                self.notify_watchdog();
                self.children.look_for_descendants();
                if self.remains.are_expected() {
                    self.sweep_dead();
                }
            }
            if lasts && now() >= next_prune {
                next_prune = now() + PRUNE_INTERVAL;
                self.prune();
            }
            if self.untrimmed && now() >= next_trim {
                next_trim = now() + TRIM_INTERVAL;
                self.untrimmed = false;
                spawn_blocking(crate::memory::give_back);
            }
        }
    }

    async fn end(mut self, quit: bool) {
        self.watcher = None;
        self.output_watch = None;
        self.children.kill_all();
        self.children.kill_descendants();
        if !quit {
            // A disk that does not respond must not block the shutdown.
            for writer in self.writers.finish(self.options.settings.drain_limit) {
                let what =
                    format!("{writer} hangs; its missing writes are completed at the next start");
                (self.tell)(Told::Notice(Notice::Storing(what)));
            }
        }
        // The children have had time to end.
        self.children.bury_all();
        self.children.forget_launches();
        for down in self.downs.drain(..) {
            // The error is ignored, because a client that has disconnected needs no answer.
            let _ = down.send(Response::Stopped);
        }
        self.request_ids.clear();
        self.control.flush().await;
        // The process ends now and nothing outlives it, so its documents are freed with it.
        if self.options.die_with_broker && self.host.end_with_process() {
            std::mem::forget(self.intake);
        }
    }

    /// Prunes the history of jobs beyond the retention time, outside the loop.
    fn prune(&self) {
        let (store, keep) = (self.store.clone(), self.options.retention);
        let notices = self.inbox.notices_in.clone();
        spawn_blocking(move || {
            if let Err(why) = store.prune(keep) {
                // The error is ignored: after the end of the loop the notice is not needed.
                let _ = notices.send(Notice::Storing(why));
            }
        });
    }

    /// Passes one event to the state machine and executes its actions. Returns `false` at the end.
    fn handle(&mut self, event: Event) -> bool {
        let now = self.clock.now(now());
        let actions = self.state.handle(now, event);
        // This precedes all actions, because results stored from now on belong to this epoch.
        self.store
            .epoch
            .store(self.state.epoch().0, Ordering::Release);
        actions
            .into_iter()
            .fold(true, |go_on, action| go_on & self.act(action))
    }

    fn own_event(&mut self, event: Event) -> bool {
        if let Event::Exited { launch, .. } = &event {
            self.children.ended(*launch);
            self.sweep_dead();
        }
        if let Event::OutputsLost { lost } = event {
            let outputs = &self.store.outputs;
            let lost = lost.into_iter().filter(|it| outputs.is_told(&it.output));
            let lost = lost.collect();
            return self.handle(Event::OutputsLost { lost });
        }
        self.handle(event)
    }

    /// Removes half-written files of dead processes, outside the loop. A killed process may have
    /// been writing a report.
    fn sweep_dead(&self) {
        let remains = self.remains.clone();
        spawn_blocking(move || remains.sweep_dead());
    }

    /// Searches all processes of the machine for stale children and kills them, outside the loop.
    fn kill_stale_children(&self, joined: BTreeSet<Launch>) {
        let Some(stale_children) = self.children.stale_children() else {
            return;
        };
        let notices = self.inbox.notices_in.clone();
        spawn_blocking(move || {
            for (pid, name) in stale_children.kill_but(&joined) {
                let why = format!(
                    "process {pid}, which an earlier broker started, did not join this one"
                );
                // The error is ignored: after the end of the loop the notice is not needed.
                let _ = notices.send(Notice::Killed { name, why });
            }
        });
    }

    fn bus_event(&mut self, event: HostEvent) -> bool {
        let known = |peer, sessions: &Sessions| sessions.sessions.get(&peer).copied();
        match event {
            HostEvent::Hello {
                peer,
                hello,
                process,
                launch,
            } => self.peer_says_hello(peer, hello, process.as_ref(), &launch),
            HostEvent::TurnedAway { why } => {
                self.say(Notice::TurnedAway(why));
                true
            }
            HostEvent::Message { peer, message } => match known(peer, &self.sessions) {
                Some(session) => self.handle(Event::Message { session, message }),
                None => true,
            },
            HostEvent::Garbage { peer, what } => match known(peer, &self.sessions) {
                Some(session) => self.handle(Event::Garbage { session, what }),
                None => true,
            },
            HostEvent::Gone { peer } => match known(peer, &self.sessions) {
                Some(session) => {
                    self.sessions.remove(session);
                    self.sweep_dead();
                    self.handle(Event::Gone { session })
                }
                None => true,
            },
        }
    }

    /// Handles the hello of a peer with a proven process. `proof` shows the broker that started it.
    fn peer_says_hello(
        &mut self,
        peer: PeerId,
        hello: Hello,
        process: Option<&Process>,
        proof: &str,
    ) -> bool {
        if let Some(launch) = hello.launch.map(Launch) {
            // A process that has died since its hello would block its name for the next one.
            if process.is_some_and(|it| !it.is_alive()) {
                self.host.disconnect(peer);
                return true;
            }
            if let Err(why) = self.children.joined(launch, &hello.name, process, proof) {
                self.host.refuse(peer, &why);
                self.say(Notice::TurnedAway(why));
                return true;
            }
        }
        let session = self.sessions.add(peer);
        self.handle(Event::Hello { session, hello })
    }

    fn seen(&mut self, seen: Seen) -> bool {
        if let Seen::Settled(path, _) | Seen::Touched(path, _) | Seen::Vanished(path) = &seen {
            self.unfinished.remove(path);
        }
        match seen {
            Seen::Unfinished(path, stamp, why) => {
                self.unfinished.insert(path.clone(), why);
                self.handle(Event::Unfinished { path, stamp })
            }
            Seen::Settled(path, stamp) => {
                reached("settled", &path);
                self.handle(Event::Settled { path, stamp })
            }
            Seen::Touched(path, stamp) => self.handle(Event::Touched { path, stamp }),
            Seen::Present(path) => self.handle(Event::Present { path }),
            Seen::Vanished(path) if self.state.is_awaited(&path) => {
                self.look_whether_it_is_back(path)
            }
            Seen::Vanished(path) => self.handle(Event::Vanished { path }),
            // The path and the reason were already reported.
            Seen::Unseen(unseen) if self.looks.is_hanging(&unseen.path) => true,
            Seen::Unseen(unseen) => {
                self.unseen(unseen);
                true
            }
            Seen::Away(unseen) => {
                self.unseen.insert(unseen.path, unseen.why);
                true
            }
            Seen::SeenAgain(path) => {
                self.unseen.remove(&path);
                true
            }
            Seen::Scanned => {
                let files = self.state.present_files();
                self.notify_ready(files.len());
                (self.tell)(Told::Scanned { files });
                self.handle(Event::Scanned)
            }
            Seen::Mode(mode) => {
                self.watch_mode = mode;
                true
            }
            Seen::Notice(notice) => {
                self.say(Notice::Watching(notice));
                true
            }
        }
    }

    fn look_around(&mut self) {
        self.give_up_the_overdue();
        self.watch_again();
        if let Some(lost) = self.host.loss() {
            self.say(Notice::Lost(lost));
        }
    }

    fn unseen(&mut self, unseen: Unseen) {
        self.unseen.insert(unseen.path.clone(), unseen.why.clone());
        self.say(Notice::Unseen(unseen));
    }

    fn say(&mut self, notice: Notice) {
        self.state.remark(notice.clone());
        (self.tell)(Told::Notice(notice));
    }
}

struct Senders {
    seen: mpsc::UnboundedSender<Seen>,
    asked: mpsc::UnboundedSender<Asked>,
    notices: mpsc::UnboundedSender<Notice>,
}

impl Inbox {
    fn new() -> (Inbox, Senders) {
        let (events_in, events) = mpsc::unbounded_channel();
        let (seen_in, seen) = mpsc::unbounded_channel();
        let (asked_in, asked) = mpsc::unbounded_channel();
        let (notices_in, notices) = mpsc::unbounded_channel();
        let (looked_in, looked) = mpsc::unbounded_channel();
        let (deliveries_in, deliveries) = mpsc::unbounded_channel();
        let inbox = Inbox {
            events,
            events_in,
            seen,
            asked,
            notices,
            notices_in: notices_in.clone(),
            looked,
            looked_in,
            deliveries,
            deliveries_in,
        };
        (
            inbox,
            Senders {
                seen: seen_in,
                asked: asked_in,
                notices: notices_in,
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_while_broker_is_suspended_does_not_count() {
        let mut clock = AttendedTime::new();
        let start = clock.last;
        let at = |millis| start + Duration::from_millis(millis);
        assert_eq!(clock.now(at(50)), Duration::from_millis(50));
        assert_eq!(
            clock.now(at(40)),
            Duration::from_millis(50),
            "time never goes back"
        );
        assert_eq!(clock.now(at(30_050)), Duration::from_millis(1050));
        assert_eq!(clock.now(at(30_150)), Duration::from_millis(1150));
    }
}
