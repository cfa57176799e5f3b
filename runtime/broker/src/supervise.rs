//! Starting and killing child processes. When to do so is the state machine's business.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use qcbus_confine::{Looks, Orders, Outer, SandboxError, kernel_level, looks};
use qcbus_messages::Role;
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use rustix::process::Pid;
use tokio::process::{Child, Command};
use tokio::sync::mpsc::UnboundedSender;

use crate::core::{ChildEnd, ChildSpec, Event, Launch};
use crate::former::{self, Former, kill_with_group};
use crate::orphans::{self, Strangers};

/// Looks for orphans at the end, two milliseconds apart.
const ORPHANS_AT_MOST: u32 = 500;

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
}

/// The children of this broker.
#[derive(Debug)]
pub struct Children {
    surroundings: Surroundings,
    first: Launch,
    pids: BTreeMap<Launch, u32>,
    strangers: Strangers,
    events: UnboundedSender<Event>,
}

impl Children {
    /// No children yet of the broker of this generation. Their ends are told to `events`.
    pub fn new(
        surroundings: Surroundings,
        generation: u64,
        events: UnboundedSender<Event>,
    ) -> Children {
        Children {
            strangers: orphans::adopt(),
            surroundings,
            first: Launch::first_of(generation),
            pids: BTreeMap::new(),
            events,
        }
    }

    /// Starts a child in a process group of its own.
    pub fn spawn(&mut self, launch: Launch, spec: &ChildSpec) {
        match self.start(launch, spec) {
            Ok(child) => {
                if let Some(pid) = child.id() {
                    self.pids.insert(launch, pid);
                }
                tokio::spawn(watch(launch, child, self.events.clone()));
            }
            Err(error) => {
                let program = spec.command.first().map_or("", String::as_str);
                let end = ChildEnd::NotStarted(format!("cannot start {program}: {error}"));
                // The loop that receives this is the one that called; it is there.
                let _ = self.events.send(Event::Exited { launch, end });
            }
        }
    }

    fn start(&self, launch: Launch, spec: &ChildSpec) -> std::io::Result<Child> {
        let Some((program, arguments)) = spec.command.split_first() else {
            return Err(std::io::Error::other("the command is empty"));
        };
        let mut command = Command::new(program);
        command
            .args(arguments)
            .arg("--instance-dir")
            .arg(&self.surroundings.instance_dir)
            .arg("--launch")
            .arg(launch.0.to_string())
            .env(orphans::LAUNCH, launch.0.to_string())
            .stdin(Stdio::null())
            .process_group(0)
            .kill_on_drop(false);
        if self.surroundings.die_with_broker {
            command.arg("--die-with-parent");
        }
        restrict(&mut command, &self.surroundings);
        if spec.role == Role::Bundle {
            self.confine(&mut command, spec)
                .map_err(std::io::Error::other)?;
        }
        command.spawn()
    }

    /// Reporters write files where they are told to, and are ours; bundles are not.
    fn confine(&self, command: &mut Command, spec: &ChildSpec) -> Result<(), SandboxError> {
        let command = command.as_std_mut();
        if !self.surroundings.sandbox {
            return Orders::Off.give(command);
        }
        Orders::On(spec.may.clone()).give(command)?;
        if let Some(outer) = Outer::new(&self.surroundings.instance_dir, &spec.may)? {
            outer.surround(command);
        }
        Ok(())
    }

    /// How far a bundle is confined, by what the kernel says of its process: it is not asked itself.
    pub fn sandbox_of(&self, peer: &PeerStatus) -> Option<SandboxStatus> {
        let there = peer.role == "bundle" && peer.pid != 0 && peer.state != "down";
        if !there || peer.state == "starting" {
            return None;
        }
        let is_ours = self
            .pids
            .values()
            .any(|pid| *pid == peer.pid || orphans::is_below(peer.pid, *pid));
        let surrounded = self.surroundings.sandbox && is_ours;
        let (state, why) = match (looks(peer.pid), kernel_level()) {
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
        self.pids.remove(&launch);
        orphans::sweep(&self.pids, &self.strangers);
    }

    /// Kills and buries what children that have ended, or hidden it, have left. Meant to be called now and then:
    /// where the kernel keeps no list of children it is left to the next end of a child, for looking through all
    /// processes takes too long.
    pub fn look_for_orphans(&self) {
        if orphans::are_listed() {
            orphans::sweep(&self.pids, &self.strangers);
        }
    }

    /// Kills a child with its process group, or a process that a former broker started.
    pub fn kill(&self, launch: Option<Launch>, pid: u32) {
        let own = launch.and_then(|launch| self.pids.get(&launch).copied());
        let Some(pid) = own.or((pid > 1).then_some(pid)) else {
            return;
        };
        let Ok(raw) = i32::try_from(pid) else { return };
        let Some(pid) = Pid::from_raw(raw) else {
            return;
        };
        if own.is_none() && former::launch_of(pid).is_none() {
            return;
        }
        orphans::kill_below(pid);
        kill_with_group(pid);
    }

    /// What former brokers of this instance have started; `None` where children die with their broker.
    pub fn former(&self) -> Option<Former> {
        let may_be = !self.surroundings.die_with_broker;
        may_be
            .then(|| Former::of(&self.surroundings.instance_dir, self.first))
            .flatten()
    }

    /// Kills whatever is left, also what it has started.
    pub fn kill_all(&self) {
        for launch in self.pids.keys() {
            self.kill(Some(*launch), 0);
        }
        // One that ends hands over what it has started; hence more than one look, but not for ever.
        let nobody = BTreeMap::new();
        for _ in 0..ORPHANS_AT_MOST {
            if orphans::sweep(&nobody, &self.strangers) == 0 {
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

/// Whether a process of this machine runs. One that nobody has buried yet does not.
pub fn is_there(pid: u32) -> bool {
    let stat = std::fs::read_to_string(Path::new("/proc").join(pid.to_string()).join("stat"));
    // The command stands in parentheses and may contain anything; behind it comes the state.
    let state = stat.as_deref().ok().and_then(|it| it.rsplit_once(')'));
    state.is_some_and(|(_, rest)| !rest.trim_start().starts_with(['Z', 'X']))
}

async fn watch(launch: Launch, mut child: Child, events: UnboundedSender<Event>) {
    let end = match child.wait().await {
        Ok(status) => end_of(status),
        Err(error) => ChildEnd::Failed(format!("its end could not be learned: {error}")),
    };
    // The broker may have stopped meanwhile.
    let _ = events.send(Event::Exited { launch, end });
}

fn end_of(status: std::process::ExitStatus) -> ChildEnd {
    use std::os::unix::process::ExitStatusExt;
    let manifest = "see its manifest";
    match (status.code(), status.signal()) {
        // What the shell says when it cannot start a command.
        (Some(code @ 127), _) => ChildEnd::NotStarted(format!(
            "its command was not found (exit code {code}); {manifest}"
        )),
        (Some(code @ 126), _) => ChildEnd::NotStarted(format!(
            "its command cannot be run (exit code {code}); {manifest}"
        )),
        (Some(0), _) => ChildEnd::Done("it ended with exit code 0".to_owned()),
        (Some(code), _) => ChildEnd::Failed(format!("it ended with exit code {code}")),
        (None, Some(signal)) => ChildEnd::Failed(format!("it was killed by signal {signal}")),
        (None, None) => ChildEnd::Failed("it ended".to_owned()),
    }
}

/// Limits that must be set between fork and exec.
#[expect(
    unsafe_code,
    reason = "pre_exec is the only place where a child's own limits can be set"
)]
fn restrict(command: &mut Command, surroundings: &Surroundings) {
    let memory = surroundings.memory_limit;
    let with_broker = surroundings.die_with_broker;
    let broker = std::process::id();
    // SAFETY: between fork and exec only async-signal-safe functions are called: setrlimit, prctl
    // and getppid; nothing is allocated and no lock is taken.
    unsafe {
        command.pre_exec(move || {
            if let Some(bytes) = memory {
                let limit = libc::rlimit {
                    rlim_cur: bytes,
                    rlim_max: bytes,
                };
                if libc::setrlimit(libc::RLIMIT_DATA, &raw const limit) != 0 {
                    return Err(std::io::Error::last_os_error());
                }
            }
            if with_broker {
                if libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) != 0 {
                    return Err(std::io::Error::last_os_error());
                }
                // The broker may have died between fork and prctl.
                if u32::try_from(libc::getppid()) != Ok(broker) {
                    return Err(std::io::Error::from_raw_os_error(libc::ESRCH));
                }
            }
            Ok(())
        });
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

    use super::*;
    use crate::core::Restart;

    fn children() -> (Children, UnboundedReceiver<Event>) {
        let (events, inbox) = unbounded_channel();
        let surroundings = Surroundings {
            instance_dir: "/nowhere".into(),
            die_with_broker: true,
            sandbox: false,
            memory_limit: None,
        };
        (Children::new(surroundings, 2, events), inbox)
    }

    fn spec(command: &[&str]) -> ChildSpec {
        ChildSpec {
            name: "child".to_owned(),
            role: Role::Bundle,
            version: None,
            command: command.iter().map(|it| (*it).to_owned()).collect(),
            restart: Restart::Never,
            may: Default::default(),
        }
    }

    async fn end(inbox: &mut UnboundedReceiver<Event>) -> (Launch, ChildEnd) {
        let watchdog = Duration::from_secs(60);
        let event = tokio::time::timeout(watchdog, inbox.recv()).await;
        match event.expect("the watchdog: no child has ended") {
            Some(Event::Exited { launch, end }) => (launch, end),
            other => panic!("{other:?}"),
        }
    }

    #[tokio::test]
    async fn how_a_child_ends_is_told() {
        let (mut children, mut inbox) = children();
        type Told = fn(&ChildEnd) -> bool;
        let not_started: Told = |it| matches!(it, ChildEnd::NotStarted(_));
        let failed: Told = |it| matches!(it, ChildEnd::Failed(_));
        let done: Told = |it| matches!(it, ChildEnd::Done(_));
        let ends = [
            (spec(&["/nowhere/at/all"]), not_started),
            (spec(&[]), not_started),
            (
                spec(&["sh", "-c", "exec /nowhere/at/all", "sh"]),
                not_started,
            ),
            (spec(&["sh", "-c", "exec /", "sh"]), not_started),
            (spec(&["sh", "-c", "exit 0", "sh"]), done),
            (spec(&["sh", "-c", "exit 3", "sh"]), failed),
            (spec(&["sh", "-c", "kill -9 $$", "sh"]), failed),
        ];
        for (number, (spec, is_told)) in (1..).zip(ends) {
            children.spawn(Launch(number), &spec);
            let (launch, end) = end(&mut inbox).await;
            assert_eq!(launch, Launch(number));
            assert!(is_told(&end), "{spec:?}: {end:?}");
            assert!(!end.how().is_empty());
        }
    }

    #[tokio::test]
    async fn a_child_is_killed_with_what_it_has_started() {
        let (mut children, mut inbox) = children();
        let dir = tempfile::tempdir().unwrap();
        let pid = dir.path().join("pid");
        let script = format!(
            "sleep 1000 & echo $! > {0}.x; mv {0}.x {0}; wait",
            pid.display()
        );
        children.spawn(Launch(1), &spec(&["sh", "-c", &script, "sh"]));
        let started = async {
            while !pid.exists() {
                tokio::task::yield_now().await;
            }
        };
        tokio::time::timeout(Duration::from_secs(60), started)
            .await
            .unwrap();
        children.kill(Some(Launch(1)), 0);
        let (_, end) = end(&mut inbox).await;
        assert!(matches!(end, ChildEnd::Failed(how) if how.contains("signal 9")));
        let grandchild = std::fs::read_to_string(&pid).unwrap();
        let stat = Path::new("/proc").join(grandchild.trim()).join("stat");
        let gone = async {
            // A zombie that nobody has buried yet is as good as gone.
            let runs = || std::fs::read_to_string(&stat).is_ok_and(|it| !it.contains(") Z "));
            while runs() {
                tokio::task::yield_now().await;
            }
        };
        tokio::time::timeout(Duration::from_secs(60), gone)
            .await
            .unwrap();
    }

    #[test]
    fn the_dead_are_not_there_before_they_are_buried() {
        assert!(is_there(std::process::id()));
        let mut child = std::process::Command::new("true").spawn().unwrap();
        let stat = Path::new("/proc").join(child.id().to_string()).join("stat");
        while !std::fs::read_to_string(&stat).unwrap().contains(") Z ") {
            std::thread::yield_now();
        }
        assert!(!is_there(child.id()), "it has ended");
        child.wait().unwrap();
        assert!(!is_there(child.id()), "it is buried");
    }

    #[tokio::test]
    async fn a_process_of_somebody_else_is_let_alone() {
        let (children, _inbox) = children();
        let mut stranger = std::process::Command::new("sleep")
            .arg("1000")
            .spawn()
            .unwrap();
        children.kill(Some(Launch(7)), stranger.id());
        assert!(
            stranger.try_wait().unwrap().is_none(),
            "it was started without --launch"
        );
        stranger.kill().unwrap();
        stranger.wait().unwrap();
    }
}
