//! Bundles and a reporter: processes that join, answer, hang, die and outlive brokers.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use qcbus_bus::{HostEvent, MappedImage, PeerId};
use qcbus_document::FileKind;
use qcbus_formats::manifest::May;
use qcbus_formats::pool::{Ending, RuleUids};
use qcbus_formats::xqar::{Issue, Level};
use qcbus_messages::{
    Catalogue, CheckerEnd, CheckerInfo, DocId, FromPeer, Hello, Job, JobId, PROTOCOL_VERSION,
    PeerReport, Role,
};
use qcbus_types::{ChildEnd, ChildSpec, Event, Launch, Restart};
use tokio::sync::mpsc::UnboundedSender;

use super::backend::word;
use super::disk::found_in;

/// Child bundle that checks the file itself.
pub const FIRST: &str = "First";
/// Bundle that joins by hand and checks the files that are referred to.
pub const SECOND: &str = "Second";
/// Child that is the reporter.
pub const REPORTER: &str = "text";

/// Returns the children that the broker starts.
pub fn children() -> Vec<ChildSpec> {
    let child = |name: &str, role| ChildSpec {
        name: name.to_owned(),
        role,
        version: (role == Role::Bundle).then(|| "1".to_owned()),
        command: vec![name.to_owned()],
        restart: Restart::Always,
        may: May::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    };
    vec![child(FIRST, Role::Bundle), child(REPORTER, Role::Reporter)]
}

/// A job of a bundle, with its findings.
pub struct Work {
    pub job: JobId,
    finds: bool,
    begun: bool,
}

/// A request to a reporter.
pub enum Letter {
    Write(String, JobId),
    TakeBack(String),
}

/// A process.
pub struct Process {
    pub name: &'static str,
    launch: Option<u64>,
    peer: Option<PeerId>,
    pub works: Vec<Work>,
    letters: VecDeque<Letter>,
    pub hangs: bool,
    drained: bool,
}

/// All processes and the messages on the bus.
#[derive(Default)]
pub struct Peers {
    pub processes: BTreeMap<u32, Process>,
    pub words: VecDeque<HostEvent>,
    pub exits: Option<UnboundedSender<Event>>,
    /// Reports written by the reporter: the job of the report on each file.
    pub reports: BTreeMap<String, JobId>,
    /// Number of bundle processes that died with unfinished work.
    pub deaths: usize,
    /// Step since which the second bundle is required.
    pub second_since: Option<usize>,
    starting: Vec<(u64, &'static str)>,
    last_pid: u32,
    last_peer: u64,
}

impl Peers {
    pub fn launched(&mut self, launch: Launch, spec: &ChildSpec) {
        let name = if spec.name == FIRST { FIRST } else { REPORTER };
        self.starting.push((launch.0, name));
    }

    pub fn pid_of(&self, launch: Launch) -> Option<u32> {
        let launch = launch.0;
        let mut all = self.processes.iter();
        all.find(|(_, it)| it.launch == Some(launch))
            .map(|it| *it.0)
    }

    pub fn has_starting(&self) -> bool {
        !self.starting.is_empty()
    }

    /// Starts a process that the broker has launched, and lets it say hello.
    pub fn arrive(&mut self) {
        if !self.starting.is_empty() {
            let (launch, name) = self.starting.remove(0);
            self.begin(name, Some(launch));
        }
    }

    pub fn begin(&mut self, name: &'static str, launch: Option<u64>) {
        self.last_pid += 1;
        let process = Process {
            name,
            launch,
            peer: None,
            works: Vec::new(),
            letters: VecDeque::new(),
            hangs: false,
            drained: false,
        };
        self.processes.insert(self.last_pid, process);
        self.say_hello(self.last_pid);
    }

    fn say_hello(&mut self, pid: u32) {
        self.last_peer += 1;
        let peer = PeerId(self.last_peer);
        let Some(process) = self.processes.get_mut(&pid) else {
            return;
        };
        process.peer = Some(peer);
        let is_reporter = process.name == REPORTER;
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            role: if is_reporter {
                Role::Reporter
            } else {
                Role::Bundle
            },
            name: process.name.to_owned(),
            version: "1".to_owned(),
            incarnation: pid.into(),
            pid,
            launch: process.launch,
            capacity: 2,
            threads: 1,
        };
        self.words.push_back(HostEvent::Hello {
            peer,
            hello,
            process: None,
            launch: String::new(),
        });
    }

    fn of(&mut self, peer: PeerId) -> Option<&mut Process> {
        self.processes.values_mut().find(|it| it.peer == Some(peer))
    }

    pub fn accepted(&mut self, peer: PeerId) {
        if let Some(process) = self.of(peer)
            && process.name != REPORTER
        {
            let catalogue = Box::new(catalogue(process.name));
            self.words
                .push_back(word(peer, FromPeer::Catalogue(catalogue)));
        }
    }

    /// Ends a process because the broker has ended its session.
    pub fn dropped(&mut self, peer: PeerId) {
        self.words.retain(|it| peer_of(it) != Some(peer));
        let of = |it: &(&u32, &Process)| it.1.peer == Some(peer);
        let pid = self.processes.iter().find(of).map(|it| *it.0);
        if let Some(pid) = pid {
            self.dies(pid);
        }
    }

    pub fn dies(&mut self, pid: u32) {
        let Some(process) = self.processes.remove(&pid) else {
            return;
        };
        self.deaths += usize::from(!process.works.is_empty());
        if let Some(peer) = process.peer {
            self.words.push_back(HostEvent::Gone { peer });
        }
        if let (Some(launch), Some(exits)) = (process.launch, &self.exits) {
            let end = ChildEnd::Failed("it was killed by signal 9".to_owned());
            let launch = Launch(launch);
            // The receiver may be gone.
            let _ = exits.send(Event::Exited { launch, end });
        }
    }

    pub fn has_job(&mut self, peer: PeerId, job: &Job, images: &[(DocId, MappedImage)]) {
        if let Some(process) = self.of(peer) {
            let finds = finds(process.name, job, images);
            let job = job.job;
            process.works.push(Work {
                job,
                finds,
                begun: false,
            });
        }
    }

    /// Cancels a job. `heard`: the process hears of it before it has sent all its findings on the job.
    pub fn cancelled(&mut self, peer: PeerId, job: JobId, heard: bool) {
        if let Some(process) = self.of(peer).filter(|_| heard) {
            process.works.retain(|it| it.job != job);
        }
    }

    pub fn has_letter(&mut self, peer: PeerId, letter: Letter) {
        if let Some(process) = self.of(peer) {
            process.letters.push_back(letter);
        }
    }

    pub fn is_told_to_go(&mut self, peer: PeerId) {
        if let Some(process) = self.of(peer) {
            process.drained = true;
        }
    }

    /// Resets all processes because the broker is dead.
    pub fn are_alone(&mut self) {
        self.words.clear();
        self.exits = None;
        self.starting.clear();
        for process in self.processes.values_mut() {
            process.peer = None;
            process.works.clear();
            process.letters.clear();
        }
        self.processes.retain(|_, it| !it.drained);
    }

    /// Connects a process that outlived its broker to the next broker.
    pub fn return_one(&mut self, n: usize) -> bool {
        let alone = self.processes.iter().filter(|it| it.1.peer.is_none());
        let alone: Vec<u32> = alone.map(|it| *it.0).collect();
        let Some(pid) = alone.get(n % alone.len().max(1)) else {
            return false;
        };
        self.say_hello(*pid);
        true
    }

    pub fn is_there(&self, name: &str) -> bool {
        let mut all = self.processes.values();
        all.any(|it| it.name == name && !it.drained)
    }

    /// Returns the processes that could do something.
    pub fn at_work(&self) -> Vec<u32> {
        let busy = |it: &Process| !it.works.is_empty() || !it.letters.is_empty() || it.drained;
        let all = self.processes.iter();
        let able = all.filter(|it| !it.1.hangs && it.1.peer.is_some() && busy(it.1));
        able.map(|it| *it.0).collect()
    }

    /// Lets a process do its next step. `at_once`: it sends all its findings at once.
    pub fn act(&mut self, pid: u32, n: usize, at_once: bool) -> String {
        let Some(process) = self.processes.get_mut(&pid) else {
            return String::new();
        };
        let (Some(peer), name) = (process.peer, process.name) else {
            return String::new();
        };
        let mut say = |message| self.words.push_back(word(peer, message));
        if let Some(letter) = process.letters.pop_front() {
            return match letter {
                Letter::Write(input, job) => {
                    self.reports.insert(input.clone(), job);
                    let report = PeerReport::Written;
                    say(FromPeer::ResultDone { job, report });
                    format!("{name} reports {input}")
                }
                Letter::TakeBack(input) => {
                    self.reports.remove(&input);
                    let text = format!("{name} takes back {input}");
                    let report = PeerReport::Written;
                    say(FromPeer::WithdrawalDone { input, report });
                    text
                }
            };
        }
        if process.works.is_empty() {
            if process.drained {
                say(FromPeer::Leaving);
                process.drained = false;
                process.hangs = true;
            }
            return format!("{name} leaves");
        }
        let at = n % process.works.len();
        let work = &mut process.works[at];
        let job = work.job;
        if !std::mem::replace(&mut work.begun, true) {
            if work.finds {
                let (checker, issues) = (0, vec![issue()]);
                say(FromPeer::Issues {
                    job,
                    checker,
                    issues,
                });
            }
            if !at_once {
                return format!("{name} begins job {}", job.0);
            }
        }
        let ended = vec![completed()];
        say(FromPeer::CheckersDone { job, ended });
        say(FromPeer::JobDone { job, micros: 1 });
        process.works.remove(at);
        format!("{name} ends job {}", job.0)
    }
}

fn completed() -> CheckerEnd {
    CheckerEnd {
        checker: 0,
        ending: Ending::Completed,
        params: Vec::new(),
        metadata: Vec::new(),
    }
}

fn peer_of(event: &HostEvent) -> Option<PeerId> {
    match event {
        HostEvent::Hello { peer, .. }
        | HostEvent::Message { peer, .. }
        | HostEvent::Garbage { peer, .. }
        | HostEvent::Gone { peer } => Some(*peer),
        HostEvent::TurnedAway { .. } => None,
    }
}

/// Checks whether a bundle finds an error. It looks only at images.
fn finds(name: &str, job: &Job, images: &[(DocId, MappedImage)]) -> bool {
    let image = |doc: DocId| images.iter().find(|it| it.0 == doc).map(|it| &*it.1);
    let mut documents = job.documents.iter();
    let root = documents.next();
    if name == FIRST {
        return root.is_none_or(|it| image(it.doc).is_none_or(|it| found_in(it).is_faulty()));
    }
    documents.any(|it| {
        let is_map = Path::new(&it.path)
            .extension()
            .is_some_and(|it| it == "xodr");
        is_map && image(it.doc).is_none_or(|it| found_in(it).is_unfit())
    })
}

fn issue() -> Issue {
    Issue {
        id: 0,
        description: "it is faulty".to_owned(),
        level: Level::Error,
        rule_uid: String::new(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}

fn catalogue(name: &str) -> Catalogue {
    let checker = CheckerInfo {
        id: format!("{name}.looks").into(),
        description: "".into(),
        rule_uids: RuleUids::default(),
        kinds: vec![FileKind::Xodr, FileKind::Xosc],
        default_on: true,
        level: Level::Error,
        params: Vec::new(),
    };
    Catalogue {
        alias: name.to_lowercase(),
        kinds: vec![FileKind::Xodr, FileKind::Xosc],
        checkers: vec![checker],
        ..Catalogue::default()
    }
}
