//! The driver knows the content of every file, and records what it did to each process.

use std::collections::BTreeMap;
use std::process::Command;
use std::time::{Duration, Instant};

use qcbus_messages::control::{PeerStatus, Request, Response};
use rustix::process::Signal;

use super::failures::{self, ANIMALS, Failure, GUESTS};
use super::files::Writer;
use super::ledger::Ledger;
use super::tally::Tally;
use super::verdicts::JUDGE;
use super::visitors::Stop;
use crate::support::broker::Broker;
use crate::support::dice::Dice;
use crate::support::farm::Farm;
use crate::support::inside::is_inside;
use crate::support::judge::Files;
use crate::support::processes::{Process, ProcessKind, all_with, signal_pid};
use crate::support::watchdog::{pause, until_or};

/// Longest pause between two actions, in milliseconds.
const PAUSE: u64 = 90;
/// Shared memory that the filler leaves free, in bytes.
const LEFT: u64 = 2 << 20;
/// Time after a full shared memory in which a broker may still end because of it. Its end is
/// noticed between two actions.
const LATE: Duration = Duration::from_secs(2);
/// Path of the filler.
const FILLER: &str = "/dev/shm/filler-of-the-chaos-test";

/// Executes the actions of the storm.
pub struct Driver {
    pub farm: Farm,
    pub broker: Option<Broker>,
    pub files: Files,
    /// Files that others depend on and that are not checked themselves.
    pub parts: Files,
    pub ledger: Ledger,
    pub dice: Dice,
    pub tally: Tally,
    pub peak_kib: u64,
    /// Number of times that standard bundles were killed or stopped, by name.
    pub harmed: BTreeMap<String, u64>,
    /// Times in which a standard bundle was stopped, or the shared memory was full.
    pub(super) stops: Vec<Stop>,
    /// Time of the next start of the broker.
    start_at: Option<Instant>,
    stopped: Vec<(i32, Instant)>,
    pub(super) animals: Vec<&'static str>,
    full_until: Option<Instant>,
    /// Last time at which the shared memory was full.
    full_at: Option<Instant>,
    pub(super) config: &'static str,
    pub(super) next_file: u64,
    /// Version of the custom bundle.
    pub(super) version: u64,
    /// Time at which its program comes back.
    pub(super) gone_until: Option<Instant>,
    /// Time at which its manifest comes back.
    pub(super) removed_until: Option<Instant>,
    /// Periods without its manifest: start and end.
    pub(super) removals: Vec<(Duration, Duration)>,
    /// Whether the program that brokers are started from was replaced.
    pub(super) is_replaced: bool,
    /// Files that are being written to.
    pub(super) writers: Vec<Writer>,
}

impl Driver {
    pub fn new(farm: Farm, seed: u64) -> Driver {
        Driver {
            farm,
            broker: None,
            files: Files::new(),
            parts: Files::new(),
            ledger: Ledger::new(),
            harmed: BTreeMap::new(),
            stops: Vec::new(),
            dice: Dice::new(seed),
            tally: Tally::new(),
            peak_kib: 0,
            start_at: None,
            stopped: Vec::new(),
            animals: Vec::new(),
            full_until: None,
            full_at: None,
            config: failures::CALM,
            next_file: 0,
            version: 0,
            gone_until: None,
            removed_until: None,
            removals: Vec::new(),
            // The program is not installed yet.
            is_replaced: true,
            writers: Vec::new(),
        }
    }

    pub fn start_broker(&mut self) {
        // A broker does not start with an invalid configuration, so the driver fixes it.
        if self.config == failures::BROKEN {
            self.write_config(failures::CALM);
        }
        let mut command = Command::new(self.installed());
        let serve = self.farm.serve_command();
        command.args(serve.get_args()).env("NO_COLOR", "1");
        self.broker = Some(Broker::start(&mut command, &self.farm.log_path()));
        self.start_at = None;
    }

    /// Executes one action.
    pub fn step(&mut self) {
        let wait = self.dice.millis(PAUSE);
        pause(wait);
        self.mend();
        match failures::any(&mut self.dice) {
            Failure::KillBroker => self.kill_broker(),
            Failure::KillBundle => self.kill(ProcessKind::Bundle, "kill bundle"),
            Failure::KillReporter => self.kill(ProcessKind::Reporter, "kill reporter"),
            Failure::KillAnimal => self.kill(ProcessKind::Animal, "kill animal"),
            Failure::Stop => self.stop(),
            Failure::Animal => self.animal(),
            Failure::Configure => self.configure(),
            Failure::Write => self.write(),
            Failure::WriteTorn => self.write_torn(),
            Failure::Rename => self.rename_into_place(),
            Failure::Move => self.move_file(),
            Failure::Truncate => self.truncate(),
            Failure::Delete => self.delete(),
            Failure::Rewrite => self.rewrite(),
            Failure::Fill => self.fill(),
            Failure::Share => self.share(),
            Failure::Unshare => self.unshare(),
            Failure::Link => self.link(),
            Failure::Reload => self.reload(),
            Failure::Upgrade => self.upgrade(),
            Failure::Vanish => self.vanish(),
            Failure::Remove => self.remove(),
            Failure::LoseOutput => self.lose_output(),
            Failure::Hide => self.hide(),
            Failure::WriteSlowly => self.write_slowly(),
            Failure::Replace => self.replace_program(),
        }
    }

    /// Ends the failures that have lasted long enough.
    fn mend(&mut self) {
        let now = Instant::now();
        if self.start_at.is_some_and(|at| at <= now) {
            self.start_broker();
            self.tally.note("start", "broker");
        }
        if let Some(broker) = &mut self.broker
            && !broker.is_alive()
        {
            let how = broker.wait();
            self.ended_by_itself(how);
        }
        let (over, rest) = self.stopped.drain(..).partition(|(_, until)| *until <= now);
        self.stopped = rest;
        let over: Vec<(i32, Instant)> = over;
        for (pid, _) in over {
            signal_pid(pid, Signal::CONT);
        }
        if self.full_until.is_some_and(|until| until <= now) {
            self.empty();
        }
        self.bring_back_when_due(now);
        self.want_again_when_due(now);
        self.end_writers(|writer| writer.until <= now);
    }

    /// Handles a broker that the driver did not end. It may end by a full shared memory, because a
    /// missing page is a bus error. No other reason is allowed.
    fn ended_by_itself(&mut self, how: std::process::ExitStatus) {
        use std::os::unix::process::ExitStatusExt;
        if how.signal() == Some(Signal::BUS.as_raw()) && self.is_full() {
            self.tally
                .note("kill broker by full memory", &how.to_string());
        } else if self.is_refusal(how) {
            self.tally.note("refuses to start", &how.to_string());
        } else {
            let log = crate::tail(&self.farm.log());
            panic!(
                "the broker must not end on its own: {how}\n{}\n{log}",
                self.tally.last_lines()
            );
        }
        self.start_broker();
    }

    /// Checks whether the broker refused to start for a valid reason. The configuration was broken
    /// or half written when it was first read, or the shared memory was full.
    fn is_refusal(&self, how: std::process::ExitStatus) -> bool {
        let log = self.farm.log();
        // Its children share the log and may have written to it since.
        let said = |words: &str| log.lines().rev().take(20).any(|line| line.contains(words));
        match how.code() {
            Some(2) => said("config.xml:"),
            Some(5) => {
                let full = ["not enough shared memory", "No space left on device"];
                self.is_full() && full.into_iter().any(said)
            }
            _ => false,
        }
    }

    pub(super) fn is_full(&self) -> bool {
        let lately = |at: Instant| at.elapsed() < LATE;
        self.full_until.is_some() || self.full_at.is_some_and(lately)
    }

    /// Ends all failures and waits until the farm is at rest.
    pub fn calm_down(&mut self) {
        for (pid, _) in std::mem::take(&mut self.stopped) {
            signal_pid(pid, Signal::CONT);
        }
        self.empty();
        for animal in std::mem::take(&mut self.animals) {
            self.farm.send_away(animal);
        }
        self.bring_back();
        self.end_writers(|_| true);
        self.share_what_has_gone();
        self.write_config(failures::CALM);
        if self.broker.as_mut().is_none_or(|broker| !broker.is_alive()) {
            self.start_broker();
        }
        until_or(
            "a broker answers",
            || self.farm.status(),
            || self.farm.log(),
        );
        // A new version is started immediately, even if the previous one keeps failing. Without a
        // broker, an upgrade would be missed if a process of the previous version still runs.
        self.want_again();
        self.upgrade();
        self.tally.note("calm", "");
        until_or(
            "the animals have gone and the calm is in force",
            || self.is_calm(),
            || self.what_is(),
        );
        self.farm.settle(self.files.len());
    }

    fn is_calm(&self) -> Option<()> {
        let status = self.farm.status()?;
        let guest = |name: &str| GUESTS.iter().any(|(guest, _)| *guest == name);
        let animal = |name: &str| ANIMALS.contains(&name) || guest(name);
        let there = status
            .peers
            .iter()
            .filter(|it| it.pid != 0 && it.state != "down");
        let version = format!("{}.0.0", self.version);
        let judge = |it: &PeerStatus| it.name == JUDGE && it.version == version;
        let calm = there.clone().all(|it| !animal(&it.name))
            && there.clone().any(judge)
            && there.filter(|it| it.name.ends_with("Bundle")).count() >= 2;
        // The answer to a reload arrives when the present configuration files are in force.
        let answer = self.farm.ask(&Request::Reload)?;
        let reloaded = matches!(answer, Response::Reloaded { .. });
        (calm && reloaded).then_some(())
    }

    /// Returns the last actions, the log of the broker and its current state.
    pub(super) fn what_is(&self) -> String {
        let status = self.farm.status();
        let peers = status.iter().flat_map(|it| &it.peers);
        let peers: Vec<String> = peers.map(|it| format!("{it:?}")).collect();
        let (deeds, log) = (self.tally.last_lines(), crate::tail(&self.farm.log()));
        let (peers, version) = (peers.join("\n"), self.version);
        let reload = self.farm.ask(&Request::Reload);
        format!("{deeds}\n{log}\n{JUDGE} should be {version}\n{reload:?}\n{peers}")
    }

    fn kill_broker(&mut self) {
        self.sample();
        let Some(mut broker) = self.broker.take() else {
            return;
        };
        let pid = broker.pid();
        broker.kill();
        self.stopped
            .retain(|(stopped, _)| u32::try_from(*stopped) != Ok(pid));
        self.tally.note("kill broker", &pid.to_string());
        self.handle_state();
        // The restart is usually immediate, but sometimes so late that the other processes have
        // given up.
        let late = if self.dice.below(12) == 0 {
            11_000
        } else {
            600
        };
        self.start_at = Some(Instant::now() + self.dice.millis(late));
    }

    fn kill(&mut self, whom: ProcessKind, kind: &'static str) {
        let Some(process) = self.any_process(|it| it.kind() == whom) else {
            return;
        };
        process.signal(Signal::KILL);
        self.harm(&process);
        self.tally.note(
            kind,
            &format!("{} {}", process.pid, process.words[1..].join(" ")),
        );
    }

    /// Counts an action against a standard bundle. Returns its name if it is one.
    fn harm(&mut self, process: &Process) -> Option<&'static str> {
        let names = [("xodr", "xodrBundle"), ("xosc", "xoscBundle")];
        let whose = |word: &str| process.words.iter().any(|it| it == word);
        let (_, name) = names.into_iter().find(|(word, _)| whose(word))?;
        *self.harmed.entry(name.to_owned()).or_default() += 1;
        Some(name)
    }

    pub(super) fn any_process(&mut self, wanted: impl Fn(&Process) -> bool) -> Option<Process> {
        // Processes that modules have started do not know the instance.
        let guests = all_with(&self.guests().to_string_lossy());
        let all = self.farm.processes().into_iter().chain(guests);
        let all: Vec<Process> = all.filter(wanted).collect();
        self.dice.pick(&all).cloned()
    }

    fn stop(&mut self) {
        let Some(process) = self.any_process(|it| it.kind() != ProcessKind::Other) else {
            return;
        };
        process.signal(Signal::STOP);
        let long = if self.dice.below(6) == 0 { 7000 } else { 900 };
        let until = Instant::now() + self.dice.millis(long);
        self.stopped.push((process.pid, until));
        if process.kind() == ProcessKind::Bundle {
            let from = self.ledger.now();
            let to = from + until.duration_since(Instant::now());
            let name = self.harm(&process);
            self.stops.push(Stop { name, from, to });
        }
        self.tally
            .note("stop", &format!("{} {:?}", process.pid, process.kind()));
    }

    fn fill(&mut self) {
        // Only a private shared memory may be filled.
        if !is_inside() || self.full_until.is_some() {
            return;
        }
        let space = rustix::fs::statvfs("/dev/shm").unwrap();
        let free = space.f_bavail * space.f_frsize;
        let filler = std::fs::File::create(FILLER).unwrap();
        let size = free.saturating_sub(LEFT);
        let flags = rustix::fs::FallocateFlags::empty();
        if size > 0 && rustix::fs::fallocate(&filler, flags, 0, size).is_ok() {
            self.tally
                .note("fill", &format!("{size} bytes of /dev/shm"));
        }
        let long = self.dice.millis(1500);
        let (name, from) = (None, self.ledger.now());
        let to = from + long;
        self.stops.push(Stop { name, from, to });
        self.full_until = Some(Instant::now() + long);
    }

    fn empty(&mut self) {
        if self.full_until.take().is_some() {
            let _ = std::fs::remove_file(FILLER);
            self.full_at = Some(Instant::now());
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.empty();
        self.broker = None;
    }
}
