//! Starts and kills child processes. The state machine decides when.

mod descendants;
mod ends;
mod final_output;
pub mod launches;
mod limits;
pub mod stale_children;

use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd as _;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use qcbus_bus::{LAUNCH, Process, STDERR};
use qcbus_configuration::{OwnProgram, RUNNING, ready};
use qcbus_confine::{Looks, Orders, Outer, SandboxError, kernel_level, looks, own_filters};
use qcbus_messages::Role;
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use qcbus_types::{ChildEnd, ChildSpec, Event, Launch};
use rustix::process::Rlimit;
use tokio::process::{Child, Command};
use tokio::sync::mpsc::UnboundedSender;

use crate::descendants::Strangers;
use crate::final_output::{FinalOutput, Heard, listen_to};
use crate::launches::Launches;
use crate::stale_children::StaleChildren;
use ends::{kill_early, watch};
use limits::restrict;

/// Maximum number of searches for descendants at the end, two milliseconds apart.
const DESCENDANTS_AT_MOST: u32 = 500;
/// Maximum time to wait for the end of killed children before the search for descendants.
const DIES_WITHIN: Duration = Duration::from_millis(20);

/// Options that apply to every child.
#[derive(Debug, Clone)]
pub struct Surroundings {
    /// Runtime directory of the instance, for `--instance-dir`.
    pub instance_dir: PathBuf,
    /// Whether children end immediately with the broker (a private instance), or may outlive it and
    /// join the next one.
    pub die_with_broker: bool,
    /// Whether bundles run in the sandbox.
    pub sandbox: bool,
    /// Maximum private memory (data segment and anonymous mappings) of a child, in bytes. The
    /// shared segment does not count, because it is mapped from a file.
    pub memory_limit: Option<u64>,
    /// Limit of open files of a child, if it differs from the broker's limit.
    pub descriptors: Option<Rlimit>,
}

/// Child processes of this broker.
#[derive(Debug)]
pub struct Children {
    surroundings: Surroundings,
    launches: Launches,
    first: Launch,
    /// Children started before the state machine requests them, see [`Children::start_early`].
    early: BTreeMap<Launch, (ChildSpec, Started)>,
    /// Children that this broker has started.
    own: BTreeMap<Launch, Own>,
    /// Stale children of earlier brokers that have joined this one.
    adopted: BTreeMap<Launch, Process>,
    strangers: Strangers,
    final_output: FinalOutput,
    events: UnboundedSender<Event>,
}

/// A child that this broker has started. It is kept until its end is reported.
#[derive(Debug)]
struct Own {
    name: String,
    /// Process id. It is also set for an ended child that is not reaped yet.
    pid: Option<u32>,
    /// Handle of the process, or `None` if the child ended before the handle was opened.
    process: Option<Process>,
}

/// A child that was started.
#[derive(Debug)]
struct Started {
    child: Child,
    heard: Option<Heard>,
}

impl Children {
    /// Creates an empty set of children for the broker of this generation. Their ends are sent to `events`.
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

    /// Starts the children that the state machine will request first, with the same numbers. They prepare while the
    /// bus is set up, and wait for it. Children that are not requested are killed when this value is dropped. A child
    /// that cannot be started now is tried again at the request.
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

    /// Checks whether these are the children of the broker of this generation.
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
                // The child is not reaped yet, so the id certainly belongs to it.
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
                // The receiving loop is the caller, so the receiver exists.
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
            // The stdout of this program contains verdicts only, so bundles must not write to it.
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

    /// Checks whether the output of a child is read. The user needs it if an added bundle does not become ready.
    fn listens_to(&self, spec: &ChildSpec) -> bool {
        !self.surroundings.die_with_broker
            && qcbus_configuration::command_of(&spec.command).is_some()
    }

    /// Returns the last lines of output of an ended child.
    pub fn final_output(&self, name: &str) -> Vec<String> {
        self.final_output.of(name)
    }

    /// Puts a bundle into the sandbox. Reporters are trusted and write files anywhere, so they run outside.
    fn confine(&self, command: &mut Command, spec: &ChildSpec) -> Result<(), SandboxError> {
        let command = command.as_std_mut();
        if !self.surroundings.sandbox {
            return Orders::Off.give(command);
        }
        Orders::On(spec.may.clone()).give(command)?;
        Outer::new(&spec.may)?.surround(command);
        Ok(())
    }

    /// Returns the sandbox state of a bundle as the kernel reports it. The bundle itself is not asked.
    pub fn sandbox_of(&self, peer: &PeerStatus) -> Option<SandboxStatus> {
        let there = peer.role == "bundle" && peer.pid != 0 && peer.state != "down";
        if !there || peer.state == "starting" {
            return None;
        }
        let mut own = self.own.values().filter_map(|it| it.process.as_ref());
        let is_ours = own.any(|it| it.id() == peer.pid || descendants::is_below(peer.pid, it.id()));
        let surrounded = self.surroundings.sandbox && is_ours;
        // A stale child has these filters, too. A bundle that was started manually has no sandbox.
        let sandbox = if self.surroundings.sandbox {
            Outer::FILTERS
        } else {
            0
        };
        let given = own_filters() + sandbox;
        let (state, why) = match (looks(peer.pid, given), kernel_level()) {
            (Looks::Unknown, _) => return None,
            (Looks::Filtered, 1..) => ("confined", ""),
            (Looks::Filtered, 0) => ("partly", "this kernel does not support Landlock"),
            (Looks::Open, _) if !self.surroundings.sandbox => ("open", "--no-sandbox"),
            (Looks::Open, 1..) if surrounded => {
                ("partly", "it did not confine itself after it joined")
            }
            (Looks::Open, 0) if is_ours => ("open", "this kernel does not support Landlock"),
            (Looks::Open, _) => ("open", "it did not confine itself after it joined"),
        };
        Some(SandboxStatus {
            state: state.to_owned(),
            why: why.to_owned(),
        })
    }

    /// Removes a child that has ended.
    pub fn ended(&mut self, launch: Launch) {
        self.own.remove(&launch);
        self.sweep();
    }

    /// Kills and reaps descendants left behind by children that have ended or that hide it. Must be
    /// called periodically. Without the kernel's lists of children this happens only at the end of
    /// a child. A search through all processes takes too long.
    pub fn look_for_descendants(&self) {
        if descendants::are_listed() {
            self.sweep();
        }
    }

    fn sweep(&self) {
        descendants::sweep(&self.ours(), &self.strangers, &self.launches);
    }

    /// Returns the ids of the watched processes. Their watchers must reap them. If such a process
    /// were reaped as a descendant, its exit code would be lost.
    fn ours(&self) -> BTreeMap<Launch, Option<u32>> {
        let own = self.own.iter().map(|(launch, it)| (*launch, it.pid));
        let early = self.early.iter();
        let early = early.map(|(launch, (_, it))| (*launch, it.child.id()));
        own.chain(early).collect()
    }

    /// Checks whether a joined process is the one that a broker of this instance has started under
    /// this name. `proof` is the value in its environment. From now on the process can be killed.
    ///
    /// # Errors
    /// A reason for the user why the process is not accepted.
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
                "`{}` states that a broker has started it (--launch {}), but does not prove it: start it without \
                 --launch; if another program starts it for the broker, pass on the environment variable \
                 {LAUNCH} unchanged; a bundle or reporter must join under the name in its manifest",
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

    /// Kills a child with its process group. It may be a child of this broker, or a stale child that has joined.
    pub fn kill(&self, launch: Launch) {
        let own = self.own.get(&launch).and_then(|it| it.process.as_ref());
        if let Some(process) = own.or(self.adopted.get(&launch)) {
            if process.is_alive() {
                descendants::kill_below(process);
            }
            process.kill();
        }
        if self.adopted.contains_key(&launch) {
            // The process that has joined may be a descendant of the started one.
            StaleChildren::of(&self.launches, Launch(u64::MAX)).kill_those_of(launch);
        }
    }

    /// Returns the stale children of this instance, or `None` if children end with their broker.
    pub fn stale_children(&self) -> Option<StaleChildren> {
        let may_be = !self.surroundings.die_with_broker;
        may_be.then(|| StaleChildren::of(&self.launches, self.first))
    }

    /// Kills all remaining children and their descendants. [`Children::bury_all`] finds escaped processes.
    pub fn kill_all(&self) {
        for launch in self.own.keys() {
            self.kill(*launch);
        }
    }

    /// Waits until all killed children have ended, and kills and reaps their remaining descendants.
    pub fn bury_all(&self) {
        let until = Instant::now() + DIES_WITHIN;
        for own in self.own.values() {
            let left = until.saturating_duration_since(Instant::now());
            if let Some(process) = &own.process {
                // The loop below handles a process that does not end in time.
                let _ = process.ends_within(left);
            }
        }
        // An ended process passes on its children, so several searches are needed. Their number is limited.
        let nobody = BTreeMap::new();
        for _ in 0..DESCENDANTS_AT_MOST {
            if descendants::sweep(&nobody, &self.strangers, &self.launches) == 0 {
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Kills all processes that brokers of this instance have ever started, and their descendants.
    /// Processes that have left their group or session are included.
    pub fn kill_descendants(&self) {
        if !self.surroundings.die_with_broker {
            StaleChildren::of(&self.launches, Launch(u64::MAX)).kill_but(&BTreeSet::new());
        }
    }

    /// Invalidates all proofs of launches when the broker ends.
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

/// Returns the command for a program. The broker's own program is started from the running image, because another
/// version may be at its path, or none. Other programs are started from their paths.
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
