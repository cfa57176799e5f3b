//! Starting and killing child processes. When to do so is the state machine's business.

mod ends;
mod limits;

use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd as _;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use qcbus_bus::{LAUNCH, Process, STDERR};
use qcbus_confine::{Looks, Orders, Outer, SandboxError, kernel_level, looks, own_filters};
use qcbus_messages::Role;
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use rustix::process::Rlimit;
use tokio::process::{Child, Command};
use tokio::sync::mpsc::UnboundedSender;

use crate::core::{ChildEnd, ChildSpec, Event, Launch};
use crate::descendants::{self, Strangers};
use crate::final_output::{FinalOutput, Heard, listen_to};
use crate::launches::Launches;
use crate::own_program::{OwnProgram, RUNNING};
use crate::reload::{self, ready};
use crate::stale_children::StaleChildren;
use ends::{kill_early, watch};
use limits::restrict;

/// Looks for orphans at the end, two milliseconds apart.
const DESCENDANTS_AT_MOST: u32 = 500;
/// How long one that is killed is waited for before orphans are looked for.
const DIES_WITHIN: Duration = Duration::from_millis(20);

/// What every child is given.
#[derive(Debug, Clone)]
pub struct Surroundings {
    /// Runtime directory of the instance, for `--instance-dir`.
    pub instance_dir: PathBuf,
    /// Whether children die with the broker at once (a private instance), or may outlive it and
    /// join the next one.
    pub die_with_broker: bool,
    /// Whether bundles are confined.
    pub sandbox: bool,
    /// Most private memory (data segment and anonymous mappings) of a child, in bytes. The shared
    /// segment does not count: it is mapped from a file.
    pub memory_limit: Option<u64>,
    /// How many files a child may have open, where that is not what the broker has.
    pub descriptors: Option<Rlimit>,
}

/// The children of this broker.
#[derive(Debug)]
pub struct Children {
    surroundings: Surroundings,
    launches: Launches,
    first: Launch,
    /// What was started before the state machine has asked for it, see [`Children::start_early`].
    early: BTreeMap<Launch, (ChildSpec, Started)>,
    /// What this broker has started.
    own: BTreeMap<Launch, Own>,
    /// What former brokers have started and has joined this one.
    adopted: BTreeMap<Launch, Process>,
    strangers: Strangers,
    final_output: FinalOutput,
    events: UnboundedSender<Event>,
}

/// What this broker has started, until its end was told.
#[derive(Debug)]
struct Own {
    name: String,
    /// Its id, also when it has ended and nobody has waited for it yet.
    pid: Option<u32>,
    /// `None` when it had ended before it was asked for.
    process: Option<Process>,
}

/// A child that was started.
#[derive(Debug)]
struct Started {
    child: Child,
    heard: Option<Heard>,
}

impl Children {
    /// No children yet of the broker of this generation. Their ends are told to `events`.
    pub fn new(
        surroundings: Surroundings,
        launches: Launches,
        generation: u64,
        events: UnboundedSender<Event>,
    ) -> Children {
        Children {
            strangers: descendants::adopt(),
            surroundings,
            launches,
            first: Launch::first_of(generation),
            early: BTreeMap::new(),
            own: BTreeMap::new(),
            adopted: BTreeMap::new(),
            final_output: FinalOutput::default(),
            events,
        }
    }

    /// Starts what the state machine is going to ask for first, as it will number it: processes get ready while the
    /// bus is set up, and wait for it. What it does not ask for ends with this; what cannot be started now is tried
    /// when it does.
    pub fn start_early(&mut self, specs: &[ChildSpec]) {
        let specs: BTreeMap<&str, &ChildSpec> =
            specs.iter().map(|it| (it.name.as_str(), it)).collect();
        let mut launch = self.first;
        for spec in specs.into_values() {
            launch = launch.next(spec);
            if let Ok(started) = self.start(launch, spec) {
                self.early.insert(launch, (spec.clone(), started));
            }
        }
    }

    /// Whether these are the children of the broker of this generation.
    pub fn are_of(&self, generation: u64) -> bool {
        self.first == Launch::first_of(generation)
    }

    /// Starts a child in a process group of its own.
    pub fn spawn(&mut self, launch: Launch, spec: &ChildSpec) {
        let started = match self.early.remove(&launch) {
            Some((early, started)) if early == *spec => Ok(started),
            Some((_, started)) => {
                kill_early(&started.child);
                self.start(launch, spec)
            }
            None => self.start(launch, spec),
        };
        match started {
            Ok(started) => {
                // Nobody has waited for it yet, so the id is its own.
                let pid = started.child.id();
                let own = Own {
                    name: spec.name.clone(),
                    pid,
                    process: pid.and_then(|id| Process::open(id, None)),
                };
                self.own.insert(launch, own);
                let (name, words) = (spec.name.clone(), self.final_output.clone());
                tokio::spawn(watch(launch, name, started, words, self.events.clone()));
            }
            Err(why) => {
                self.final_output.forget(&spec.name);
                let end = ChildEnd::NotStarted(why);
                // The loop that receives this is the one that called; it is there.
                let _ = self.events.send(Event::Exited { launch, end });
            }
        }
    }

    fn start(&self, launch: Launch, spec: &ChildSpec) -> Result<Started, String> {
        let words = ready(&spec.command)?;
        let Some((program, arguments)) = words.split_first() else {
            return Err("cannot start it: the command is empty".to_owned());
        };
        let mut command = command_of(program);
        command
            .args(arguments)
            .arg("--instance-dir")
            .arg(&self.surroundings.instance_dir)
            .arg("--launch")
            .arg(launch.0.to_string())
            .env(LAUNCH, self.launches.proof(launch, &spec.name))
            .env("PATH", OwnProgram::this().search_path())
            .env_remove(STDERR)
            .stdin(Stdio::null())
            .process_group(0)
            .kill_on_drop(false);
        if self.surroundings.die_with_broker {
            command.arg("--die-with-parent");
        }
        restrict(&mut command, &self.surroundings);
        if spec.role == Role::Bundle {
            self.confine(&mut command, spec)
                .map_err(|error| format!("cannot confine it: {error}"))?;
            // What this program prints are verdicts; no bundle prints any.
            let said = std::io::stderr().as_fd().try_clone_to_owned();
            command.stdout(said.map_or_else(|_| Stdio::null(), Stdio::from));
        }
        let heard = self.listens_to(spec).then(|| listen_to(&mut command));
        let child = command.spawn();
        Ok(Started {
            child: child.map_err(|error| format!("cannot start {program}: {error}"))?,
            heard: heard.flatten(),
        })
    }

    /// Whoever adds a bundle to a broker that stays wants to know what it says when it does not get ready.
    fn listens_to(&self, spec: &ChildSpec) -> bool {
        !self.surroundings.die_with_broker && reload::command_of(&spec.command).is_some()
    }

    /// The last lines that a child has said that has ended.
    pub fn final_output(&self, name: &str) -> Vec<String> {
        self.final_output.of(name)
    }

    /// Reporters write files where they are told to, and are ours; bundles are not.
    fn confine(&self, command: &mut Command, spec: &ChildSpec) -> Result<(), SandboxError> {
        let command = command.as_std_mut();
        if !self.surroundings.sandbox {
            return Orders::Off.give(command);
        }
        Orders::On(spec.may.clone()).give(command)?;
        Outer::new(&spec.may)?.surround(command);
        Ok(())
    }

    /// How far a bundle is confined, by what the kernel says of its process: it is not asked itself.
    pub fn sandbox_of(&self, peer: &PeerStatus) -> Option<SandboxStatus> {
        let there = peer.role == "bundle" && peer.pid != 0 && peer.state != "down";
        if !there || peer.state == "starting" {
            return None;
        }
        let mut own = self.own.values().filter_map(|it| it.process.as_ref());
        let is_ours = own.any(|it| it.id() == peer.pid || descendants::is_below(peer.pid, it.id()));
        let surrounded = self.surroundings.sandbox && is_ours;
        // One that a former broker has started has them, too; one that was started by hand confines itself to nothing.
        let sandbox = if self.surroundings.sandbox {
            Outer::FILTERS
        } else {
            0
        };
        let given = own_filters() + sandbox;
        let (state, why) = match (looks(peer.pid, given), kernel_level()) {
            (Looks::Unknown, _) => return None,
            (Looks::Filtered, 1..) => ("confined", ""),
            (Looks::Filtered, 0) => ("partly", "this kernel has no Landlock"),
            (Looks::Open, _) if !self.surroundings.sandbox => ("open", "--no-sandbox"),
            (Looks::Open, 1..) if surrounded => {
                ("partly", "it has not confined itself after it joined")
            }
            (Looks::Open, 0) if is_ours => ("open", "this kernel has no Landlock"),
            (Looks::Open, _) => ("open", "it has not confined itself after it joined"),
        };
        Some(SandboxStatus {
            state: state.to_owned(),
            why: why.to_owned(),
        })
    }

    /// Forgets a child that has ended.
    pub fn ended(&mut self, launch: Launch) {
        self.own.remove(&launch);
        self.sweep();
    }

    /// Kills and buries what children that have ended, or hidden it, have left. Meant to be called now and then:
    /// where the kernel keeps no list of children it is left to the next end of a child, for looking through all
    /// processes takes too long.
    pub fn look_for_descendants(&self) {
        if descendants::are_listed() {
            self.sweep();
        }
    }

    fn sweep(&self) {
        descendants::sweep(&self.ours(), &self.strangers, &self.launches);
    }

    /// The processes that somebody watches, by their ids: one that ends at once is waited for by its watcher, and would
    /// have no exit code if it was buried as an orphan.
    fn ours(&self) -> BTreeMap<Launch, Option<u32>> {
        let own = self.own.iter().map(|(launch, it)| (*launch, it.pid));
        let early = self.early.iter();
        let early = early.map(|(launch, (_, it))| (*launch, it.child.id()));
        own.chain(early).collect()
    }

    /// A process has joined as a child: is it the one that a broker of this instance has started, under
    /// this very name? `proof` is what its environment says. From now on it can be killed.
    ///
    /// # Errors
    /// Why it is not believed, for a person.
    pub fn joined(
        &mut self,
        launch: Launch,
        name: &str,
        process: Option<&Process>,
        proof: &str,
    ) -> Result<(), String> {
        let proven = self.launches.proven(proof) == Some((launch, name));
        let own = self.own.get(&launch);
        let is_it = own.is_some_and(|it| {
            let own = it.process.as_ref().map(Process::id);
            it.name == name && own.is_some() && own == process.map(Process::id)
        });
        if !proven && !is_it {
            return Err(format!(
                "`{}` says that a broker has started it (--launch {}), and does not prove it: start it without \
                 --launch, or where something starts it for the broker, hand on the environment variable \
                 {LAUNCH} as it is; a bundle or reporter joins under the name of its manifest",
                name.escape_debug(),
                launch.0
            ));
        }
        if own.is_some() {
            self.final_output.joined(launch);
        }
        if let (None, Some(process)) = (own, process) {
            self.adopted.retain(|_, process| process.is_alive());
            self.adopted.insert(launch, process.clone());
        }
        Ok(())
    }

    /// Kills a child with its process group: one of this broker, or one of a former that has joined.
    pub fn kill(&self, launch: Launch) {
        let own = self.own.get(&launch).and_then(|it| it.process.as_ref());
        if let Some(process) = own.or(self.adopted.get(&launch)) {
            if process.is_alive() {
                descendants::kill_below(process);
            }
            process.kill();
        }
        if self.adopted.contains_key(&launch) {
            // The process that has joined need not be the first of those that were started.
            StaleChildren::of(&self.launches, Launch(u64::MAX)).kill_those_of(launch);
        }
    }

    /// What former brokers of this instance have started; `None` where children die with their broker.
    pub fn stale_children(&self) -> Option<StaleChildren> {
        let may_be = !self.surroundings.die_with_broker;
        may_be.then(|| StaleChildren::of(&self.launches, self.first))
    }

    /// Kills whatever is left, also what it has started. [`Children::bury_all`] sees to it that nothing has escaped.
    pub fn kill_all(&self) {
        for launch in self.own.keys() {
            self.kill(*launch);
        }
    }

    /// Waits until nobody is left of those who were killed, and of those who have come to us by that.
    pub fn bury_all(&self) {
        let until = Instant::now() + DIES_WITHIN;
        for own in self.own.values() {
            let left = until.saturating_duration_since(Instant::now());
            if let Some(process) = &own.process {
                // One that does not is looked at below.
                let _ = process.ends_within(left);
            }
        }
        // One that ends hands over what it has started; hence more than one look, but not for ever.
        let nobody = BTreeMap::new();
        for _ in 0..DESCENDANTS_AT_MOST {
            if descendants::sweep(&nobody, &self.strangers, &self.launches) == 0 {
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Kills whatever brokers of this instance have ever started, and what that has started, also where it
    /// has left its group or its session.
    pub fn kill_what_they_started(&self) {
        if !self.surroundings.die_with_broker {
            StaleChildren::of(&self.launches, Launch(u64::MAX)).kill_but(&BTreeSet::new());
        }
    }

    /// The end: nobody can prove any more that this broker has started it.
    pub fn forget_launches(&self) {
        self.launches.forget();
    }
}

impl Drop for Children {
    fn drop(&mut self) {
        let early = self.early.values();
        early.for_each(|(_, started)| kill_early(&started.child));
    }
}

/// What runs as this broker is started again as it is: another version may lie at its path by now, or nothing. The
/// programs of others are started from where they lie.
fn command_of(program: &str) -> Command {
    if !OwnProgram::this().is(program) {
        return Command::new(program);
    }
    let mut command = Command::new(RUNNING);
    command.arg0(program);
    command
}

#[cfg(test)]
mod tests;
