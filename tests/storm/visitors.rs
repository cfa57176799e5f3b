//! Actions of the driver on the configuration, the misbehaving bundles and the custom bundle.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use qcbus_control::ask_broker;
use qcbus_messages::control::Request;

use super::driver::Driver;
use super::failures::{self, ANIMALS, GUEST_LIMITS, GUESTS};
use super::verdicts::JUDGE;
use crate::support::farm::zoo;

/// Shell functions of well-behaved modules.
const MANNERS: &str = include_str!("../../bundles/asam-adapter/tests/modules/guests/manners.sh");

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
            // A shadow has no weight, so it must never change anything.
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

    /// Adds an ASAM module, as a required bundle or as a shadow.
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

    /// Returns the directory of the programs of modules.
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

    /// Requests a reload of the unchanged configuration and manifests. The driver does not wait for
    /// the answer, because the broker may be stopped until the driver continues it.
    pub fn reload(&mut self) {
        let instance = self.farm.instance();
        std::thread::spawn(move || drop(ask_broker(&instance, &Request::Reload)));
        self.tally.note("reload", "");
    }

    /// Returns the custom bundle's program: a removable link to the zoo program or one in Python.
    fn program(&self) -> PathBuf {
        self.farm.base().join("program/zoo")
    }

    /// Returns the script that starts the bundle in Python, if it is tested.
    fn python(&self) -> PathBuf {
        self.farm.base().join("judge")
    }

    /// Installs the custom bundle in its next version.
    pub fn install(&mut self) {
        self.install_guests();
        std::fs::create_dir_all(self.farm.base().join("program")).unwrap();
        if let Some(python) = std::env::var_os(PYTHON) {
            let python = PathBuf::from(python);
            assert!(python.is_absolute(), "{PYTHON} must be an absolute path");
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

    /// Gives the custom bundle another version, unless its manifest is removed.
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

    /// Removes the manifest of the custom bundle for a while.
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

    /// Restores the manifest of the custom bundle.
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

    /// Removes the program from the disk for a while, usually together with the running process.
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

    /// Checks whether the driver may have caused the broker's kill of a bundle at this time.
    pub fn was_stopped(&self, name: &str, at: Duration) -> bool {
        let hand = |stop: &Stop| {
            let whose = stop.name.is_none_or(|it| it == name);
            whose && stop.from <= at && at <= stop.to + AFTERMATH
        };
        self.stops.iter().any(hand)
    }
}

/// Interpreter with the package `qcbus`. If set, the custom bundle runs in Python.
const PYTHON: &str = "QCBUS_STORM_PYTHON";

/// A period in which a bundle could not run.
pub struct Stop {
    /// Name of the bundle, or `None` for all bundles.
    pub name: Option<&'static str>,
    pub from: Duration,
    pub to: Duration,
}

/// Time in which a process may still be killed for a stop or a full shared memory.
const AFTERMATH: Duration = Duration::from_secs(10);
