//! Common code of all animals: joining the bus, receiving messages, and the correct answer to a
//! job.

use std::collections::VecDeque;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use qcbus_bus::{Claims, Instance, JoinError, Peer, PeerEvent, PeerOptions};
use qcbus_confine::{After, Orders, Sandboxed};
use qcbus_document::FileKind;
use qcbus_formats::manifest::May;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Level;
use qcbus_messages::{
    Catalogue, CheckerEnd, CheckerInfo, FromPeer, Hello, Job, JobDocument, JobId, PROTOCOL_VERSION,
    PeerReport, Role, ToPeer,
};

use crate::{Args, complain};

/// An animal: its data and its behaviour.
#[derive(Debug, Clone, Copy)]
pub struct Animal {
    /// Its behaviour in words, which is also its name on the bus.
    pub name: &'static str,
    /// Bundle or reporter.
    pub role: Role,
    /// Its claims: the version of the messages and its identity.
    pub claims: Claims,
    /// Its behaviour.
    pub manners: Manners,
}

/// Behaviour of an animal. Everything else is done correctly.
#[derive(Debug, Clone, Copy)]
pub struct Manners {
    /// Called after the welcome.
    pub welcomed: fn(&mut Peer) -> Mood,
    /// Called when a job must be checked. Its documents are available.
    pub job: fn(&mut Peer, &Job) -> Mood,
    /// Called when a result must be reported.
    pub result: fn(&mut Peer, JobId) -> Mood,
}

/// Next step after an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mood {
    /// The loop continues.
    GoOn,
    /// The process stays but does nothing any more. It does not even read.
    Freeze,
    /// The process ends like a crashed one.
    Die,
}

/// True claims.
pub const HONEST: Claims = Claims {
    protocol: PROTOCOL_VERSION,
    proves: true,
};

/// An animal with correct behaviour, as a base for the others.
pub const GOOD: Animal = Animal {
    name: "",
    role: Role::Bundle,
    claims: HONEST,
    manners: Manners {
        welcomed: introduce,
        job: check,
        result: acknowledge,
    },
};

/// Sends its catalogue: two checkers for every kind of file.
pub fn introduce(peer: &mut Peer) -> Mood {
    peer.send(&FromPeer::Catalogue(Box::new(catalogue())));
    Mood::GoOn
}

/// Reports that it found no issues.
pub fn check(peer: &mut Peer, job: &Job) -> Mood {
    answer(peer, job.job);
    Mood::GoOn
}

/// Acknowledges a result without writing anything.
pub fn acknowledge(peer: &mut Peer, job: JobId) -> Mood {
    let report = PeerReport::Written;
    peer.send(&FromPeer::ResultDone { job, report });
    Mood::GoOn
}

/// Sends the whole answer to a job without findings.
pub fn answer(peer: &mut Peer, job: JobId) {
    for checker in 0..CHECKERS {
        checker_done(peer, job, checker);
    }
    peer.send(&FromPeer::JobDone { job, micros: 1 });
}

/// Reports that one checker has ended without findings.
pub fn checker_done(peer: &mut Peer, job: JobId, checker: u32) {
    peer.send(&FromPeer::CheckersDone {
        job,
        ended: vec![CheckerEnd {
            checker,
            ending: Ending::Completed,
            params: Vec::new(),
            metadata: Vec::new(),
        }],
    });
}

/// Number of checkers of every animal.
pub const CHECKERS: u32 = 2;

/// Returns the catalogue of every animal.
pub fn catalogue() -> Catalogue {
    let checker = |number: u32| CheckerInfo {
        id: format!("check_zoo_{number}").into(),
        description: "looks at nothing".into(),
        rule_uids: [format!("example.org:xodr:1.0.0:zoo.{number}")]
            .into_iter()
            .collect(),
        kinds: FileKind::ALL.to_vec(),
        default_on: true,
        level: Level::Warning,
        params: Vec::new(),
    };
    Catalogue {
        alias: String::new(),
        description: "an animal of the zoo".to_owned(),
        build_date: "2026-11-21".to_owned(),
        kinds: FileKind::ALL.to_vec(),
        checkers: (0..CHECKERS).map(checker).collect(),
    }
}

/// Interval of heartbeats, and of repeated requests for missing documents.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Runs an animal until the broker releases it or its behaviour ends it.
pub fn run(animal: &'static Animal, args: &Args) -> ExitCode {
    if args.die_with_parent {
        use rustix::process::{Signal, set_parent_process_death_signal};
        if let Err(error) = set_parent_process_death_signal(Some(Signal::KILL)) {
            complain(&format!("cannot follow the parent process: {error}"));
        }
    }
    let instance = match &args.instance_dir {
        Some(dir) => Ok(Instance::at(dir.clone())),
        None => Instance::named(&args.instance),
    };
    let instance = match instance {
        Ok(instance) => instance,
        Err(error) => return fail(&error.to_string(), 2),
    };
    let may = match Orders::given() {
        Ok(Orders::On(may)) if animal.role == Role::Bundle => may,
        Ok(_) => return outside(animal, args, &instance),
        Err(error) => return fail(&error.to_string(), 2),
    };
    let supervised = args.launch.is_some() || args.die_with_parent;
    let hello = hello(animal, args);
    let kept = qcbus_confine::run_sessions(!supervised, |number| {
        let stand = Stand {
            instance: &instance,
            may: Some(&may),
            number,
        };
        session(animal, args, hello.clone(), &stand)
    });
    match kept {
        Ok(kept) => kept.end(),
        Err(error) => {
            complain(&format!("not confined: {error}"));
            outside(animal, args, &instance)
        }
    }
}

/// Runs a session outside the sandbox, as for bundles that must not be confined.
fn outside(animal: &'static Animal, args: &Args, instance: &Instance) -> ExitCode {
    let stand = Stand {
        instance,
        may: None,
        number: 0,
    };
    match session(animal, args, hello(animal, args), &stand) {
        After::End(code) => ExitCode::from(code),
        After::Again => ExitCode::from(4),
    }
}

/// Context of a session.
struct Stand<'a> {
    instance: &'a Instance,
    /// Permissions that the manifest declares. With `None` the session is not confined.
    may: Option<&'a May>,
    number: u32,
}

fn session(animal: &'static Animal, args: &Args, hello: Hello, stand: &Stand<'_>) -> After {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    match runtime {
        Ok(runtime) => runtime.block_on(live(animal, args, hello, stand)),
        Err(error) => ended(&error.to_string(), 5),
    }
}

async fn live(animal: &'static Animal, args: &Args, hello: Hello, stand: &Stand<'_>) -> After {
    let usual = PeerOptions::default();
    let options = PeerOptions {
        rejoins: stand.may.is_none(),
        patience: [usual.patience, usual.grace][usize::from(stand.number > 0)],
        ..usual
    };
    let joined = Peer::join_claiming(animal.claims, stand.instance, hello, options);
    let peer = match joined.await {
        Ok(peer) => peer,
        Err(error @ JoinError::NoBroker { .. }) => return ended(&error.to_string(), 4),
        Err(error) => return ended(&error.to_string(), 5),
    };
    if let Some(may) = stand.may {
        let sandboxed = Sandboxed {
            memory: peer.memory().map(Path::to_path_buf),
            may: may.clone(),
            ..Sandboxed::default()
        };
        if let Err(error) = qcbus_confine::confine(&sandboxed) {
            complain(&format!("not wholly confined: {error}"));
        }
    }
    let mut cage = Cage {
        animal,
        takes: args.takes.unwrap_or_default(),
        peer,
        jobs: VecDeque::new(),
        begun: None,
        draining: false,
    };
    let mut beat = tokio::time::interval(HEARTBEAT);
    beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        let pause = cage.pause();
        let mood = tokio::select! {
            event = cage.peer.next() => match cage.hear(event) {
                Ok(mood) => mood,
                Err(_) if cage.peer.has_lost_its_session() => return After::Again,
                Err(why) => return ended(&why, 4),
            },
            _ = beat.tick() => cage.beat(),
            () = tokio::time::sleep(pause.unwrap_or_default()), if pause.is_some() => cage.work(),
        };
        match mood {
            Mood::GoOn => {}
            Mood::Freeze => {
                complain("from now on it does nothing any more");
                std::future::pending::<()>().await;
            }
            Mood::Die => std::process::abort(),
        }
        if cage.draining && cage.jobs.is_empty() {
            cage.peer.send(&FromPeer::Leaving);
            cage.peer.leave().await;
            return After::End(0);
        }
    }
}

fn hello(animal: &Animal, args: &Args) -> Hello {
    use std::hash::BuildHasher as _;
    Hello {
        protocol: PROTOCOL_VERSION,
        role: animal.role,
        name: args.name.clone().unwrap_or_else(|| animal.name.to_owned()),
        version: args.version.clone(),
        incarnation: std::hash::RandomState::new().hash_one(std::process::id()),
        pid: std::process::id(),
        launch: args.launch,
        capacity: 4,
        threads: 1,
    }
}

struct Cage {
    animal: &'static Animal,
    takes: Duration,
    peer: Peer,
    jobs: VecDeque<Job>,
    begun: Option<Instant>,
    draining: bool,
}

impl Cage {
    fn hear(&mut self, event: PeerEvent) -> Result<Mood, String> {
        let message = match event {
            PeerEvent::Message(message) => message,
            PeerEvent::Rejoined => {
                self.jobs.clear();
                return Ok(Mood::GoOn);
            }
            PeerEvent::Closed { reason } => return Err(reason),
            PeerEvent::Document(_) | PeerEvent::LetGo | PeerEvent::Config(_) => {
                return Ok(Mood::GoOn);
            }
        };
        Ok(match message {
            ToPeer::Welcome { .. } if self.animal.role == Role::Bundle => {
                (self.animal.manners.welcomed)(&mut self.peer)
            }
            ToPeer::Job(job) => {
                self.jobs.push_back(job);
                self.ask_for_documents();
                Mood::GoOn
            }
            ToPeer::Cancel { job } => {
                self.jobs.retain(|it| it.job != job);
                self.begun = None;
                Mood::GoOn
            }
            ToPeer::Result(result) => (self.animal.manners.result)(&mut self.peer, result.job),
            ToPeer::Withdrawn(gone) => {
                let (input, report) = (gone.input, PeerReport::Written);
                self.peer.send(&FromPeer::WithdrawalDone { input, report });
                Mood::GoOn
            }
            ToPeer::Drain => {
                self.draining = true;
                Mood::GoOn
            }
            ToPeer::Welcome { .. } | ToPeer::Refused { .. } => Mood::GoOn,
        })
    }

    fn beat(&mut self) -> Mood {
        let job = self.jobs.front().map(|job| job.job);
        self.peer.send(&FromPeer::Heartbeat { job, checker: None });
        self.ask_for_documents();
        Mood::GoOn
    }

    fn ask_for_documents(&mut self) {
        let Some(job) = self.jobs.front() else { return };
        for document in &job.documents {
            if self.peer.document(document.doc).is_none() {
                let doc = document.doc;
                self.peer.send(&FromPeer::NeedDocument { doc });
            }
        }
    }

    /// Returns the time until the current job is done, or `None` if there is nothing to do.
    fn pause(&mut self) -> Option<Duration> {
        let documents = &self.jobs.front()?.documents;
        let there = |document: &JobDocument| self.peer.document(document.doc).is_some();
        if !documents.iter().all(there) {
            return None;
        }
        let begun = *self.begun.get_or_insert_with(Instant::now);
        Some(self.takes.saturating_sub(begun.elapsed()))
    }

    fn work(&mut self) -> Mood {
        self.begun = None;
        let Some(job) = self.jobs.pop_front() else {
            return Mood::GoOn;
        };
        let mood = (self.animal.manners.job)(&mut self.peer, &job);
        for document in &job.documents {
            self.peer.forget(document.doc);
        }
        mood
    }
}

fn fail(why: &str, code: u8) -> ExitCode {
    complain(why);
    ExitCode::from(code)
}

fn ended(why: &str, code: u8) -> After {
    complain(why);
    After::End(code)
}
