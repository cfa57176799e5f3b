//! The driver: it knows what is in every file, and what it has done to whom.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, UNIX_EPOCH};

use rustix::process::Signal;

use super::tally::Tally;
use super::trouble::{self, ANIMALS, Trouble};
use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::dice::Dice;
use crate::support::farm::Farm;
use crate::support::inside::is_inside;
use crate::support::judge::Files;
use crate::support::processes::{Process, ProcessKind, signal_pid};
use crate::support::watchdog::{pause, until_or};

/// Files that there are about.
const FILES: usize = 80;
/// Longest pause between two deeds, in milliseconds.
const PAUSE: u64 = 90;
/// Before and after 1970: times that some files say they are from.
const LONG_AGO: Duration = Duration::from_secs(1_000_000);
/// What the filler leaves of the shared memory, in bytes.
const LEFT: u64 = 2 << 20;
/// Where the filler lies.
const FILLER: &str = "/dev/shm/filler-of-the-chaos-test";

/// The driver.
pub struct Driver {
    pub farm: Farm,
    pub broker: Option<Broker>,
    pub files: Files,
    pub dice: Dice,
    pub tally: Tally,
    pub peak_kib: u64,
    /// When the broker is started again.
    start_at: Option<Instant>,
    stopped: Vec<(i32, Instant)>,
    animals: Vec<&'static str>,
    full_until: Option<Instant>,
    /// The shared memory has been full at some time.
    filled: bool,
    config: &'static str,
    next_file: u64,
}

impl Driver {
    pub fn new(farm: Farm, seed: u64) -> Driver {
        Driver {
            farm,
            broker: None,
            files: Files::new(),
            dice: Dice::new(seed),
            tally: Tally::new(),
            peak_kib: 0,
            start_at: None,
            stopped: Vec::new(),
            animals: Vec::new(),
            full_until: None,
            filled: false,
            config: trouble::CALM,
            next_file: 0,
        }
    }

    pub fn start_broker(&mut self) {
        // With a configuration that cannot be used no broker starts: somebody has mended it.
        if self.config == trouble::BROKEN {
            self.write_config(trouble::CALM);
        }
        self.broker = Some(self.farm.serve());
        self.start_at = None;
    }

    pub fn write_some(&mut self, count: usize) {
        for _ in 0..count {
            self.write_new();
        }
    }

    /// One deed.
    pub fn step(&mut self) {
        let wait = self.dice.millis(PAUSE);
        pause(wait);
        self.mend();
        match trouble::any(&mut self.dice) {
            Trouble::KillBroker => self.kill_broker(),
            Trouble::KillBundle => self.kill(ProcessKind::Bundle, "kill bundle"),
            Trouble::KillReporter => self.kill(ProcessKind::Reporter, "kill reporter"),
            Trouble::KillAnimal => self.kill(ProcessKind::Animal, "kill animal"),
            Trouble::Stop => self.stop(),
            Trouble::Animal => self.animal(),
            Trouble::Configure => self.configure(),
            Trouble::Write => self.write(),
            Trouble::WriteTorn => self.write_torn(),
            Trouble::Rename => self.rename_into_place(),
            Trouble::Move => self.move_file(),
            Trouble::Truncate => self.truncate(),
            Trouble::Delete => self.delete(),
            Trouble::Rewrite => self.rewrite(),
            Trouble::Fill => self.fill(),
        }
    }

    /// What has lasted long enough ends.
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
    }

    /// It did not end by our hand. A shared memory that somebody else fills may take it down (a
    /// page that cannot be had is a bus error); nothing else may.
    fn ended_by_itself(&mut self, how: std::process::ExitStatus) {
        use std::os::unix::process::ExitStatusExt;
        if how.signal() == Some(Signal::BUS.as_raw()) && self.filled {
            self.tally
                .note("kill broker by full memory", &how.to_string());
        } else if self.is_refusal(how) {
            self.tally.note("refuses to start", &how.to_string());
        } else {
            let log = crate::tail(&self.farm.log());
            panic!(
                "the broker ended by itself: {how}\n{}\n{log}",
                self.tally.last_lines()
            );
        }
        self.start_broker();
    }

    /// Whether it refused to start for a good reason: a configuration that was broken or half
    /// written when it first looked, or no room in the shared memory.
    fn is_refusal(&self, how: std::process::ExitStatus) -> bool {
        let log = self.farm.log();
        // Its children, who share the log, may have said something since.
        let said = |words: &str| log.lines().rev().take(20).any(|line| line.contains(words));
        match how.code() {
            Some(2) => said("config.xml:"),
            Some(5) => self.filled && said("error: not enough shared memory"),
            _ => false,
        }
    }

    /// Everything goes on as it should, and the farm comes to rest.
    pub fn calm_down(&mut self) {
        for (pid, _) in std::mem::take(&mut self.stopped) {
            signal_pid(pid, Signal::CONT);
        }
        self.empty();
        for animal in std::mem::take(&mut self.animals) {
            self.farm.send_away(animal);
        }
        self.write_config(trouble::CALM);
        if self.broker.as_mut().is_none_or(|broker| !broker.is_alive()) {
            self.start_broker();
        }
        self.tally.note("calm", "");
        let explain = || format!("{}\n{:#?}", self.tally.last_lines(), self.farm.status());
        until_or(
            "the animals have gone and the calm is in force",
            || self.is_calm(),
            explain,
        );
        self.farm.settle(self.files.len());
    }

    fn is_calm(&self) -> Option<()> {
        let status = self.farm.status()?;
        let animal = |name: &str| ANIMALS.contains(&name);
        let there = status
            .peers
            .iter()
            .filter(|it| it.pid != 0 && it.state != "down");
        let calm = there.clone().all(|it| !animal(&it.name))
            && there.filter(|it| it.name.ends_with("Bundle")).count() >= 2;
        // Asking to reload answers when the present files of the configuration are in force.
        let reload = qcbus_messages::control::Request::Reload;
        let answer = self.farm.ask(&reload)?;
        let reloaded = matches!(answer, qcbus_messages::control::Response::Reloaded { .. });
        (calm && reloaded).then_some(())
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
        // Mostly at once, sometimes so late that the others have given up.
        let late = if self.dice.below(12) == 0 {
            11_000
        } else {
            600
        };
        self.start_at = Some(Instant::now() + self.dice.millis(late));
    }

    fn kill(&mut self, part: ProcessKind, kind: &'static str) {
        let Some(process) = self.any_process(|it| it.kind() == part) else {
            return;
        };
        process.signal(Signal::KILL);
        self.tally.note(
            kind,
            &format!("{} {}", process.pid, process.words[1..].join(" ")),
        );
    }

    fn any_process(&mut self, wanted: impl Fn(&Process) -> bool) -> Option<Process> {
        let all: Vec<Process> = self.farm.processes().into_iter().filter(wanted).collect();
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
        self.tally
            .note("stop", &format!("{} {:?}", process.pid, process.kind()));
    }

    fn animal(&mut self) {
        if self.animals.len() >= 3 || (!self.animals.is_empty() && self.dice.below(2) == 0) {
            let at = usize::try_from(self.dice.below(self.animals.len() as u64)).unwrap();
            let animal = self.animals.swap_remove(at);
            self.farm.send_away(animal);
            self.tally.note("animal goes", animal);
        } else if let Some(animal) = self.dice.pick(ANIMALS).copied()
            && !self.animals.contains(&animal)
        {
            let arguments = if animal == "slow" { "--millis 5" } else { "" };
            self.farm.let_in(animal, arguments);
            self.animals.push(animal);
            self.tally.note("animal comes", animal);
        }
    }

    fn configure(&mut self) {
        let texts = [trouble::CALM, trouble::WILD, trouble::BROKEN];
        let Some(text) = self.dice.pick(&texts).copied() else {
            return;
        };
        self.write_config(text);
        self.tally
            .note("configure", text.lines().nth(2).unwrap_or("broken"));
    }

    fn write_config(&mut self, text: &'static str) {
        self.config = text;
        std::fs::write(self.farm.base().join("config.xml"), text).unwrap();
    }

    fn write(&mut self) {
        if self.files.len() < FILES {
            self.write_new();
        } else if let Some(name) = self.any_file() {
            let content = Content::any(&mut self.dice);
            self.put(&name, content, "write");
        }
    }

    fn write_new(&mut self) {
        let name = self.new_name();
        let content = Content::any(&mut self.dice);
        self.put(&name, content, "write");
    }

    fn put(&mut self, name: &str, content: Content, kind: &'static str) {
        self.farm.write(name, &content.bytes());
        let path = self.path(name);
        self.age(&path);
        self.tally.note(kind, name);
        self.files.insert(name.to_owned(), content);
    }

    /// One file in three says that it was last written to long ago, as a copy may; all these say the
    /// same, some that it was before 1970.
    fn age(&mut self, path: &Path) {
        let time = match self.dice.below(6) {
            0 => UNIX_EPOCH - LONG_AGO,
            1 => UNIX_EPOCH + LONG_AGO,
            _ => return,
        };
        let file = std::fs::File::options().write(true).open(path).unwrap();
        file.set_modified(time).unwrap();
    }

    fn new_name(&mut self) -> String {
        self.next_file += 1;
        format!("{}.xodr", self.next_file)
    }

    fn any_file(&mut self) -> Option<String> {
        let names: Vec<String> = self.files.keys().cloned().collect();
        self.dice.pick(&names).cloned()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.farm.root().join(name)
    }

    fn write_torn(&mut self) {
        use std::io::Write;
        let Some(name) = self.any_file() else { return };
        let content = Content::any(&mut self.dice);
        let bytes = content.bytes();
        let (first, second) = bytes.split_at(bytes.len() / 2);
        let mut file = std::fs::File::create(self.path(&name)).unwrap();
        file.write_all(first).unwrap();
        let wait = self.dice.millis(400);
        pause(wait);
        file.write_all(second).unwrap();
        self.tally.note("write torn", &name);
        self.files.insert(name, content);
    }

    fn rename_into_place(&mut self) {
        let name = match self.any_file() {
            Some(name) if self.dice.below(2) == 0 => name,
            _ => self.new_name(),
        };
        let content = Content::any(&mut self.dice);
        let unfinished = self.path(&format!("{name}.part"));
        std::fs::write(&unfinished, content.bytes()).unwrap();
        self.age(&unfinished);
        std::fs::rename(&unfinished, self.path(&name)).unwrap();
        self.tally.note("rename into place", &name);
        self.files.insert(name, content);
    }

    fn move_file(&mut self) {
        let Some(from) = self.any_file() else { return };
        let to = self.new_name();
        std::fs::rename(self.path(&from), self.path(&to)).unwrap();
        if let Some(content) = self.files.remove(&from) {
            self.files.insert(to.clone(), content);
        }
        self.tally.note("move", &format!("{from} {to}"));
    }

    fn truncate(&mut self) {
        let Some(name) = self.any_file() else { return };
        let Some(torn) = self
            .files
            .get(&name)
            .cloned()
            .map(|it| it.torn(&mut self.dice))
        else {
            return;
        };
        let file = std::fs::OpenOptions::new()
            .write(true)
            .open(self.path(&name))
            .unwrap();
        file.set_len(u64::try_from(torn.bytes().len()).unwrap())
            .unwrap();
        self.tally.note("truncate", &name);
        self.files.insert(name, torn);
    }

    fn delete(&mut self) {
        let Some(name) = self.any_file() else { return };
        std::fs::remove_file(self.path(&name)).unwrap();
        self.files.remove(&name);
        self.tally.note("delete", &name);
    }

    fn rewrite(&mut self) {
        let Some(name) = self.any_file() else { return };
        for _ in 0..self.dice.below(6) + 2 {
            let content = Content::any(&mut self.dice);
            self.put(&name, content, "rewrite");
            let wait = self.dice.millis(30);
            pause(wait);
        }
    }

    fn fill(&mut self) {
        // Only a shared memory of its own may be filled.
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
        self.filled = true;
        self.full_until = Some(Instant::now() + self.dice.millis(1500));
    }

    fn empty(&mut self) {
        if self.full_until.take().is_some() {
            let _ = std::fs::remove_file(FILLER);
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.empty();
        self.broker = None;
    }
}
