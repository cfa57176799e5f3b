//! What the driver does to the configuration, to animals, and to the bundle of one's own.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use qcbus_broker::control::ask_broker;
use qcbus_messages::control::Request;

use super::driver::Driver;
use super::failures::{self, ANIMALS, GUEST_LIMITS, GUESTS};
use super::verdicts::JUDGE;
use crate::support::farm::zoo;

/// How modules behave towards who starts them.
const MANNERS: &str = include_str!("../../bundles/asam-adapter/tests/guests/manners.sh");

impl Driver {
    pub fn animal(&mut self) {
        if self.animals.len() >= 3 || (!self.animals.is_empty() && self.dice.below(2) == 0) {
            let at = usize::try_from(self.dice.below(self.animals.len() as u64)).unwrap();
            let animal = self.animals.swap_remove(at);
            self.farm.send_away(animal);
            self.tally.note("animal goes", animal);
        } else if self.dice.below(4) == 0 {
            self.guest();
        } else if let Some(animal) = self.dice.pick(ANIMALS).copied()
            && !self.animals.contains(&animal)
        {
            let arguments = if animal == "slow" { "--millis 5" } else { "" };
            // What has no weight must change nothing, whatever it does.
            if !animal.starts_with("reporter") && self.dice.below(3) == 0 {
                self.farm.let_in_as_shadow(animal, arguments);
                self.tally.note("shadow comes", animal);
            } else {
                self.farm.let_in(animal, arguments);
                self.tally.note("animal comes", animal);
            }
            self.animals.push(animal);
        }
    }

    /// A one-shot module comes, with weight or without.
    fn guest(&mut self) {
        let Some((name, _)) = self.dice.pick(GUESTS).copied() else {
            return;
        };
        if self.animals.contains(&name) {
            return;
        }
        let (seconds, memory, output) = GUEST_LIMITS;
        let is_shadow = self.dice.below(3) == 0;
        let module = serde_json::json!({
            "name": name,
            "exec_type": "executable",
            "module_type": "checker_bundle",
            "exec_command": self.guests().join(name),
            "kinds": ["xodr"],
            "limits": {"seconds": seconds, "memory_mb": memory, "output_mb": output},
            "shadow": is_shadow,
        });
        self.farm.let_in_module(name, &module);
        self.animals.push(name);
        self.tally.note("module comes", name);
    }

    /// Where the programs of modules lie.
    pub fn guests(&self) -> PathBuf {
        self.farm.base().join("guests")
    }

    fn install_guests(&self) {
        std::fs::create_dir_all(self.guests()).unwrap();
        for (name, does) in GUESTS {
            let path = self.guests().join(name);
            let program = format!("#!/bin/sh\n{MANNERS}\npolite\n{does}\n");
            std::fs::write(&path, program).unwrap();
            let may = std::os::unix::fs::PermissionsExt::from_mode(0o755);
            std::fs::set_permissions(&path, may).unwrap();
        }
    }

    pub fn configure(&mut self) {
        let texts = [failures::CALM, failures::WILD, failures::BROKEN];
        let Some(text) = self.dice.pick(&texts).copied() else {
            return;
        };
        self.write_config(text);
        self.tally
            .note("configure", text.lines().nth(2).unwrap_or("broken"));
    }

    pub fn write_config(&mut self, text: &'static str) {
        self.config = text;
        std::fs::write(self.farm.base().join("config.xml"), text).unwrap();
    }

    /// Somebody asks for the configuration and the manifests to be read again, though nothing is new.
    /// The driver does not wait for the answer: the broker may stand still until the driver lets it go.
    pub fn reload(&mut self) {
        let instance = self.farm.instance();
        std::thread::spawn(move || drop(ask_broker(&instance, &Request::Reload)));
        self.tally.note("reload", "");
    }

    /// The program of the bundle of one's own: a link to the zoo's, or to one in Python, which can be taken away.
    fn program(&self) -> PathBuf {
        self.farm.base().join("program/zoo")
    }

    /// Starts the bundle in Python, when that is to be tried.
    fn python(&self) -> PathBuf {
        self.farm.base().join("judge")
    }

    /// The bundle of one's own, in its next version.
    pub fn install(&mut self) {
        self.install_guests();
        std::fs::create_dir_all(self.farm.base().join("program")).unwrap();
        if let Some(python) = std::env::var_os(PYTHON) {
            let python = PathBuf::from(python);
            assert!(python.is_absolute(), "{PYTHON} is no absolute path");
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/storm/judge.py");
            let program = format!("#!/bin/sh\nexec {} {script} \"$@\"\n", python.display());
            std::fs::write(self.python(), program).unwrap();
            let may = std::os::unix::fs::PermissionsExt::from_mode(0o755);
            std::fs::set_permissions(self.python(), may).unwrap();
            self.tally
                .note("the judge is one in Python", &python.to_string_lossy());
        }
        self.bring_back();
        self.upgrade();
    }

    /// It gets another version, if anybody wants it.
    pub fn upgrade(&mut self) {
        if self.removed_until.is_some() {
            return;
        }
        self.version += 1;
        let (program, version) = (self.program(), self.version);
        let arguments = format!("--version {version}.0.0");
        self.farm.let_in_by(&program, JUDGE, &arguments);
        self.tally.note("upgrade", &version.to_string());
    }

    /// Nobody wants the bundle of one's own for a while.
    pub fn remove(&mut self) {
        if self.removed_until.is_some() {
            return;
        }
        let begun = self.ledger.now();
        self.farm.send_away(JUDGE);
        self.removals.push((begun, Duration::MAX));
        self.removed_until = Some(Instant::now() + self.dice.millis(5000));
        self.tally.note("manifest goes", JUDGE);
    }

    /// It is wanted again.
    pub fn want_again(&mut self) {
        if self.removed_until.take().is_some() {
            self.upgrade();
            if let Some((_, back)) = self.removals.last_mut() {
                *back = self.ledger.now();
            }
        }
    }

    pub fn want_again_when_due(&mut self, now: Instant) {
        if self.removed_until.is_some_and(|until| until <= now) {
            self.want_again();
        }
    }

    /// The program goes from the disk for a while, mostly with the process that runs.
    pub fn vanish(&mut self) {
        if self.gone_until.is_some() {
            return;
        }
        std::fs::remove_file(self.program()).unwrap();
        let limit = if self.dice.below(6) == 0 {
            15_000
        } else {
            2500
        };
        self.gone_until = Some(Instant::now() + self.dice.millis(limit));
        self.tally.note("program goes", JUDGE);
        if self.dice.below(4) > 0
            && let Some(process) = self.any_process(|it| it.words.iter().any(|it| it == JUDGE))
        {
            process.signal(rustix::process::Signal::KILL);
            self.tally.note("kill judge", &process.pid.to_string());
        }
    }

    pub fn bring_back_when_due(&mut self, now: Instant) {
        if self.gone_until.is_some_and(|until| until <= now) {
            self.bring_back();
        }
    }

    pub fn bring_back(&mut self) {
        self.gone_until = None;
        if !self.program().exists() {
            let python = Some(self.python()).filter(|it| it.exists());
            std::os::unix::fs::symlink(python.unwrap_or_else(zoo), self.program()).unwrap();
            self.tally.note("program comes", JUDGE);
        }
    }

    /// Whether the driver had a hand in the death of a bundle that the broker killed at this time.
    pub fn was_stopped(&self, name: &str, at: Duration) -> bool {
        let hand = |stop: &Stop| {
            let whose = stop.name.is_none_or(|it| it == name);
            whose && stop.from <= at && at <= stop.to + AFTERMATH
        };
        self.stops.iter().any(hand)
    }
}

/// An interpreter that has the package `qcbus`: the bundle of one's own is one in Python then.
const PYTHON: &str = "QCBUS_STORM_PYTHON";

/// A time in which a bundle could not go on.
pub struct Stop {
    /// Which bundle; all of them if it is not said.
    pub name: Option<&'static str>,
    pub from: Duration,
    pub to: Duration,
}

/// So long after a process was stopped, or the shared memory was full, it may be killed for it.
const AFTERMATH: Duration = Duration::from_secs(10);
