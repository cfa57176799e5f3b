//! Starting and killing child processes. When to do so is the state machine's business.

use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd as _;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use qcbus_bus::{LAUNCH, Process, STDERR};
use qcbus_confine::{Looks, Orders, Outer, SandboxError, kernel_level, looks, own_filters};
use qcbus_messages::Role;
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use rustix::process::{Resource, Rlimit, setrlimit};
use tokio::process::{Child, Command};
use tokio::sync::mpsc::UnboundedSender;

use crate::core::{ChildEnd, ChildSpec, Event, Launch};
use crate::former::Former;
use crate::last_words::{Heard, LastWords, listen_to};
use crate::launches::Launches;
use crate::orphans::{self, Strangers};
use crate::own_program::{OwnProgram, RUNNING};
use crate::reload::{self, ready};

/// Looks for orphans at the end, two milliseconds apart.
const ORPHANS_AT_MOST: u32 = 500;
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
    /// What this broker has started, by its name and with a handle on the process.
    own: BTreeMap<Launch, (String, Option<Process>)>,
    /// What former brokers have started and has joined this one.
    adopted: BTreeMap<Launch, Process>,
    strangers: Strangers,
    last_words: LastWords,
    events: UnboundedSender<Event>,
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
            strangers: orphans::adopt(),
            surroundings,
            launches,
            first: Launch::first_of(generation),
            early: BTreeMap::new(),
            own: BTreeMap::new(),
            adopted: BTreeMap::new(),
            last_words: LastWords::default(),
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
                let process = started.child.id().and_then(|id| Process::open(id, None));
                self.own.insert(launch, (spec.name.clone(), process));
                let (name, words) = (spec.name.clone(), self.last_words.clone());
                tokio::spawn(watch(launch, name, started, words, self.events.clone()));
            }
            Err(why) => {
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
    pub fn last_words(&self, name: &str) -> Vec<String> {
        self.last_words.of(name)
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
        let mut own = self.own.values().filter_map(|(_, it)| it.as_ref());
        let is_ours = own.any(|it| it.id() == peer.pid || orphans::is_below(peer.pid, it.id()));
        let surrounded = self.surroundings.sandbox && is_ours;
        // One that a former broker has started has them, too; one that was started by hand confines itself to nothing.
        let ring = if self.surroundings.sandbox {
            Outer::FILTERS
        } else {
            0
        };
        let given = own_filters() + ring;
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
    pub fn look_for_orphans(&self) {
        if orphans::are_listed() {
            self.sweep();
        }
    }

    fn sweep(&self) {
        let id = |(launch, (_, process)): (&Launch, &(String, Option<Process>))| {
            (*launch, process.as_ref().map(Process::id))
        };
        let ours = self.own.iter().map(id).collect();
        orphans::sweep(&ours, &self.strangers, &self.launches);
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
        let is_it = own.is_some_and(|(own_name, own)| {
            let id = |it: &Process| it.id();
            own_name == name && own.is_some() && own.as_ref().map(id) == process.map(id)
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
        if let (None, Some(process)) = (own, process) {
            self.adopted.retain(|_, process| process.is_alive());
            self.adopted.insert(launch, process.clone());
        }
        Ok(())
    }

    /// Kills a child with its process group: one of this broker, or one of a former that has joined.
    pub fn kill(&self, launch: Launch) {
        let own = self.own.get(&launch).and_then(|(_, it)| it.as_ref());
        if let Some(process) = own.or(self.adopted.get(&launch)) {
            if process.is_alive() {
                orphans::kill_below(process);
            }
            process.kill();
        }
        if self.adopted.contains_key(&launch) {
            // The process that has joined need not be the first of those that were started.
            Former::of(&self.launches, Launch(u64::MAX)).kill_those_of(launch);
        }
    }

    /// What former brokers of this instance have started; `None` where children die with their broker.
    pub fn former(&self) -> Option<Former> {
        let may_be = !self.surroundings.die_with_broker;
        may_be.then(|| Former::of(&self.launches, self.first))
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
        for (_, process) in self.own.values() {
            let left = until.saturating_duration_since(Instant::now());
            if let Some(process) = process {
                // One that does not is looked at below.
                let _ = process.ends_within(left);
            }
        }
        // One that ends hands over what it has started; hence more than one look, but not for ever.
        let nobody = BTreeMap::new();
        for _ in 0..ORPHANS_AT_MOST {
            if orphans::sweep(&nobody, &self.strangers, &self.launches) == 0 {
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Kills whatever brokers of this instance have ever started, and what that has started, also where it
    /// has left its group or its session.
    pub fn kill_what_they_started(&self) {
        if !self.surroundings.die_with_broker {
            Former::of(&self.launches, Launch(u64::MAX)).kill_but(&BTreeSet::new());
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

fn kill_early(child: &Child) {
    // Nobody has waited for it yet, so the id is its own; the runtime does.
    let process = child.id().and_then(|id| Process::open(id, None));
    process.iter().for_each(Process::kill);
}

async fn watch(
    launch: Launch,
    name: String,
    mut started: Started,
    words: LastWords,
    events: UnboundedSender<Event>,
) {
    let ended = started.child.wait().await;
    words.take_down(name, started.heard).await;
    let end = match ended {
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
    let descriptors = surroundings.descriptors;
    let with_broker = surroundings.die_with_broker;
    let broker = std::process::id();
    // SAFETY: between fork and exec only async-signal-safe functions are called: close_range, setrlimit,
    // prctl and getppid; nothing is allocated and no lock is taken.
    unsafe {
        command.pre_exec(move || {
            // What this program was given by whoever started it is nobody else's.
            libc::syscall(
                libc::SYS_close_range,
                3,
                u32::MAX,
                libc::CLOSE_RANGE_CLOEXEC,
            );
            if let Some(bytes) = memory {
                let limit = libc::rlimit {
                    rlim_cur: bytes,
                    rlim_max: bytes,
                };
                if libc::setrlimit(libc::RLIMIT_DATA, &raw const limit) != 0 {
                    return Err(std::io::Error::last_os_error());
                }
            }
            if let Some(limit) = descriptors {
                setrlimit(Resource::Nofile, limit)?;
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
        let dir = tempfile::tempdir().unwrap();
        let surroundings = Surroundings {
            instance_dir: "/nowhere".into(),
            die_with_broker: true,
            sandbox: false,
            memory_limit: None,
            descriptors: None,
        };
        let launches = Launches::of(dir.path()).unwrap();
        (Children::new(surroundings, launches, 2, events), inbox)
    }

    fn spec(command: &[&str]) -> ChildSpec {
        ChildSpec {
            name: "child".to_owned(),
            role: Role::Bundle,
            version: None,
            command: command.iter().map(|it| (*it).to_owned()).collect(),
            restart: Restart::Never,
            may: Default::default(),
            programs: Vec::new(),
            shadow: false,
            slow_start: false,
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

    fn pids_of(children: &Children) -> Vec<u32> {
        let early = children.early.values();
        early.filter_map(|(_, started)| started.child.id()).collect()
    }

    async fn is_gone(pid: u32) {
        let stat = PathBuf::from(format!("/proc/{pid}/stat"));
        let gone = async {
            // A zombie that nobody has buried yet is as good as gone.
            let runs = || std::fs::read_to_string(&stat).is_ok_and(|it| !it.contains(") Z "));
            while runs() {
                tokio::task::yield_now().await;
            }
        };
        let watchdog = Duration::from_secs(60);
        tokio::time::timeout(watchdog, gone).await.unwrap();
    }

    #[tokio::test]
    async fn what_was_started_early_is_what_is_asked_for() {
        let (mut children, mut inbox) = children();
        let spec = spec(&["sh", "-c", "exec sleep 1000", "sh"]);
        children.start_early(std::slice::from_ref(&spec));
        let early = pids_of(&children);
        let launch = Launch::first_of(2).next(&spec);
        children.spawn(launch, &spec);
        let own = children.own[&launch].1.clone().unwrap();
        assert_eq!(early, [own.id()], "one process");
        assert!(children.early.is_empty());
        children.kill(launch);
        assert_eq!(end(&mut inbox).await.0, launch);
    }

    #[tokio::test]
    async fn what_was_started_early_and_died_is_noticed() {
        let (mut children, mut inbox) = children();
        let spec = spec(&["sh", "-c", "exit 3", "sh"]);
        children.start_early(std::slice::from_ref(&spec));
        let launch = Launch::first_of(2).next(&spec);
        children.spawn(launch, &spec);
        let (ended, how) = end(&mut inbox).await;
        assert_eq!(ended, launch);
        assert!(matches!(how, ChildEnd::Failed(_)), "{how:?}");
    }

    #[tokio::test]
    async fn what_cannot_be_started_early_is_told_when_it_is_asked_for() {
        let (mut children, mut inbox) = children();
        let spec = spec(&["/nowhere/at/all"]);
        children.start_early(std::slice::from_ref(&spec));
        let launch = Launch::first_of(2).next(&spec);
        children.spawn(launch, &spec);
        let (ended, how) = end(&mut inbox).await;
        assert_eq!(ended, launch);
        assert!(matches!(how, ChildEnd::NotStarted(_)), "{how:?}");
    }

    #[tokio::test]
    async fn what_was_started_early_for_nothing_ends() {
        let (mut children, _inbox) = children();
        let spec = spec(&["sh", "-c", "exec sleep 1000", "sh"]);
        children.start_early(std::slice::from_ref(&spec));
        let [unasked] = pids_of(&children)[..] else {
            panic!("one is started");
        };
        drop(children);
        is_gone(unasked).await;
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
        children.kill(Launch(1));
        let (_, end) = end(&mut inbox).await;
        assert!(matches!(end, ChildEnd::Failed(how) if how.contains("signal 9")));
        let grandchild = std::fs::read_to_string(&pid).unwrap();
        let stat = PathBuf::from(format!("/proc/{}/stat", grandchild.trim()));
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

    #[tokio::test]
    async fn only_what_a_broker_has_started_is_believed_and_killed() {
        let (mut children, mut inbox) = children();
        let start = || {
            let mut command = std::process::Command::new("sleep");
            command.arg("1000").spawn().unwrap()
        };
        let [mut stranger, mut former] = [start(), start()];
        let process = |it: &std::process::Child| Process::open(it.id(), None).unwrap();
        let (strange, adopted) = (process(&stranger), process(&former));
        let earlier = Launch::first_of(1);
        let proof = children.launches.proof(earlier, "child");
        let lies = [
            (earlier, "child", ""),
            (earlier, "other", &proof),
            (Launch(earlier.0 + 1), "child", &proof),
        ];
        for (launch, name, proof) in lies {
            let refused = children.joined(launch, name, Some(&strange), proof);
            assert!(refused.unwrap_err().contains("does not prove it"));
            children.kill(launch);
        }
        children
            .joined(earlier, "child", Some(&adopted), &proof)
            .unwrap();
        children.kill(earlier);
        assert!(!former.wait().unwrap().success());
        // A child of this broker is known without any proof, and nobody else is taken for it.
        children.spawn(Launch(1), &spec(&["sh", "-c", "exec sleep 1000", "sh"]));
        let own = children.own[&Launch(1)].1.clone().unwrap();
        children.joined(Launch(1), "child", Some(&own), "").unwrap();
        let refused = children.joined(Launch(1), "child", Some(&strange), "");
        assert!(refused.is_err());
        children.kill(Launch(1));
        let (_, end) = end(&mut inbox).await;
        assert!(
            matches!(&end, ChildEnd::Failed(how) if how.contains("signal 9")),
            "{end:?}"
        );
        assert!(stranger.try_wait().unwrap().is_none());
        stranger.kill().unwrap();
        stranger.wait().unwrap();
    }
}
