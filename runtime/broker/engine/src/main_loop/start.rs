//! Start of a broker: the instance, the journal, the configuration and the first scan.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_bus::HostOptions;
use qcbus_configuration::{InForce, Loaded, Sources};
use qcbus_control::Asked;
use qcbus_disk::foreign;
use qcbus_environment::{now, spawn_blocking};
use qcbus_messages::control::Unseen;
use qcbus_publish::directory_lock::open_to_others;
use qcbus_publish::journal::Void;
use qcbus_publish::store::Reconciled;
use qcbus_state::State;
use qcbus_supervise::Surroundings;
use qcbus_supervise::launches::Launches;
use qcbus_types::{Event, Member, Notice, Stamp};
use qcbus_watch::stamp::stamp_of;
use qcbus_watch::{Seen, is_looked_at, scan_directory};
use tokio::sync::mpsc;

use super::early::{early_children, early_or_now};
use super::looks::Looks;
use super::remains::Remains;
use super::stores::{StateDirectory, numbered_journal, reconcile, results_of, store, writers};
use super::watching::Watching;
use super::{AttendedTime, Broker, Inbox, Sessions, StartError, Told};
use crate::backend::{Backend, Bus, Control, Processes, System};
use crate::descriptors::Descriptors;
use crate::intake::{Intake, JudgedAs, judged_in_a_run};
use crate::options::Options;
use crate::state_identity::difference_of;

impl Broker {
    /// Locks the instance, opens the journal and reads the configuration. It must be called within
    /// a tokio runtime.
    ///
    /// # Errors
    /// See [`StartError`]. After an error nothing is left behind.
    pub fn start(
        options: Options,
        tell: impl FnMut(Told) + Send + 'static,
    ) -> Result<Broker, StartError> {
        Broker::start_on(&System, options, Box::new(tell))
    }

    /// Starts as [`Broker::start`] with another bus, other processes and another control socket.
    ///
    /// # Errors
    /// See [`StartError`]. After an error nothing is left behind.
    pub fn start_on(
        backend: &dyn Backend,
        mut options: Options,
        tell: Box<dyn FnMut(Told) + Send>,
    ) -> Result<Broker, StartError> {
        let sources = sources_of(&options);
        let loaded = sources.load()?;
        let (descriptors, limited) = Descriptors::for_peers(&mut options.host.max_peers);
        let (inbox, senders) = Inbox::new();
        let early = early_children(backend, &mut options, &loaded, descriptors, &inbox);
        let mut host = backend.bus(&options.instance, shape(&options, &loaded))?;
        let (journal, members) = numbered_journal(&mut options, host.generation())?;
        let (state_directory, lock) = (StateDirectory::of(journal.as_ref()), results_of(&options)?);
        let in_force = put_in_force(&mut *host, &sources, &loaded)?;
        let looks = Looks::default();
        let control = control_of(backend, &options, senders.asked)?;
        let store = Arc::new(store(&options, (journal, lock), &looks, &senders.notices)?);
        let remains = Remains::of(&options);
        let reconciled = reconcile(&options, &loaded, &store, &remains)?;
        let writers = writers(&options, &store, &inbox, &senders.notices)?;
        let mut broker = Broker {
            started: now(),
            clock: AttendedTime::new(),
            intake: intake(&options, &*host, &in_force),
            host,
            state: State::new(options.settings.clone(), in_force.digest, in_force.demand()),
            store,
            writers,
            children: early_or_now(backend, early, &options, descriptors, &inbox)?,
            sources,
            fingerprint: loaded.read.clone(),
            loaded,
            not_in_force: None,
            in_force,
            watcher: None,
            watching: None,
            output_watch: None,
            watch_mode: "once".to_owned(),
            unseen: BTreeMap::new(),
            unfinished: BTreeMap::new(),
            looks,
            sessions: Sessions::default(),
            request_ids: HashMap::new(),
            downs: Vec::new(),
            next_request_id: 0,
            left: HashMap::new(),
            journal_is_behind: false,
            untrimmed: false,
            inbox,
            tell,
            control,
            state_directory,
            remains,
            options,
        };
        broker.take_up(members, broker.store.voids()?);
        tell_at_the_start(&reconciled, &broker.options, limited, &senders.notices);
        broker.look(reconciled, senders.seen).map(|()| broker)
    }

    /// Restores the registry and the pending withdrawals of reports from the journal.
    fn take_up(&mut self, members: Vec<Member>, voids: Vec<Void>) {
        for member in members {
            self.state.remember_member(member);
        }
        for void in voids {
            self.remember_void(&void.path, &void.reporter, void.xqar);
        }
    }

    /// Restores the valid verdicts. Files that changed while no broker was watching are checked
    /// again. Returns the paths that the verdicts depend on.
    fn remember(&mut self, found: Reconciled) -> Vec<(Arc<Path>, Option<Stamp>)> {
        for mut file in found.standing {
            for input in file.judged.inputs.iter().skip(1) {
                let now = found.stamps.get(&input.path).copied().flatten();
                file.judged.racy |= now != input.content.stamp();
            }
            self.state
                .remember(&file.path, file.judged, &file.delivered);
        }
        for path in found.unpublished {
            self.state.remember_unpublished(&path);
        }
        found.stamps.into_iter().collect()
    }

    /// Starts to watch the output files of this broker, because other processes may change them.
    fn look_at_outputs(&mut self) -> Result<(), StartError> {
        let events = self.inbox.events_in.clone();
        let tell = move |lost| {
            // The error is ignored: after the end of the loop the event is not needed.
            let _ = events.send(Event::OutputsLost { lost });
        };
        let watch = self.store.outputs.watch(Box::new(tell));
        self.output_watch = watch.map_err(|source| system("watch results", source))?;
        Ok(())
    }

    /// Restores the pending withdrawal of a report. `left` is the path of the result.
    fn remember_void(&mut self, path: &Arc<Path>, reporter: &str, left: Option<PathBuf>) {
        if let Some(xqar) = left {
            self.left.insert((reporter.to_owned(), path.clone()), xqar);
        }
        self.state.remember_void(path, reporter);
    }

    /// Restores the valid verdicts and starts to look at the files. They are either watched,
    /// together with the paths that verdicts depend on, or scanned once.
    fn look(
        &mut self,
        found: Reconciled,
        seen: mpsc::UnboundedSender<Seen>,
    ) -> Result<(), StartError> {
        let dependencies = self.remember(found);
        if self.options.watch {
            let watching = Watching::new(seen);
            let watcher = self.watch(&watching, None);
            let watcher = watcher.map_err(|source| system("watch", source))?;
            watcher.depend(dependencies);
            (self.watcher, self.watching) = (Some(watcher), Some(watching));
            return self.look_at_outputs();
        }
        let (roots, files) = (self.options.roots.clone(), self.options.files.clone());
        let io_watchdog = self.looks.io_watchdog();
        spawn_blocking(move || {
            let _attendance = io_watchdog.attend_for_good();
            look_once(&roots, &files, &seen);
        });
        Ok(())
    }
}

/// Publishes the configuration that is now in force.
fn put_in_force(
    host: &mut dyn Bus,
    sources: &Sources,
    loaded: &Loaded,
) -> Result<Arc<InForce>, StartError> {
    let in_force = Arc::new(InForce::of(sources, loaded)?);
    host.set_config(in_force.digest, &in_force.encoded);
    Ok(in_force)
}

fn control_of(
    backend: &dyn Backend,
    options: &Options,
    inbox: mpsc::UnboundedSender<Asked>,
) -> Result<Box<dyn Control>, StartError> {
    backend
        .control(options.instance.dir(), inbox)
        .map_err(|source| system("listen for commands", source))
}

fn tell_at_the_start(
    reconciled: &Reconciled,
    options: &Options,
    limited: Option<String>,
    notices: &mpsc::UnboundedSender<Notice>,
) {
    let right = reconciled.said.iter().cloned().map(Notice::Storing);
    let lasting = [Some(&*options.out), options.gate.as_deref()].into_iter();
    let open = open_to_others(lasting.flatten().filter(|_| options.watch)).map(Notice::Storing);
    let first = limited.map(Notice::Limited).into_iter();
    let identity = difference_of(options).map(Notice::Storing);
    for notice in first.chain(identity).chain(open).chain(right) {
        // The send cannot fail, because the receiving loop starts later.
        let _ = notices.send(notice);
    }
}

fn sources_of(options: &Options) -> Sources {
    Sources {
        config: options.config.clone(),
        lasting: options.watch,
        bundles_d: options.bundles_d.clone(),
        choice: options.choice.clone(),
        strict: options.strict,
        all: options.all,
        own_verdicts: options.settings.own_verdicts,
        standard: options.standard.clone(),
        reporters: options.reporters.clone(),
        known: options.known.clone(),
        adapter: options.adapter.clone(),
    }
}

/// Returns the dimensions of the bus for the expected peers. A broker that ends by itself has no
/// other peers. Each started process may have a newer one beside it.
pub(super) fn shape(options: &Options, loaded: &Loaded) -> HostOptions {
    let expected_peers = loaded.children.len();
    let most = match options.watch {
        true => options.host.max_peers,
        false => 2 * expected_peers + 1,
    };
    HostOptions {
        expected_peers,
        max_peers: options.host.max_peers.min(most),
        // Without a configuration file none is added later.
        config_grows: options.watch || options.config.is_some(),
        ..options.host
    }
}

fn intake(options: &Options, host: &dyn Bus, in_force: &InForce) -> Arc<Intake> {
    let roots = options.roots.clone();
    let intake = Intake::new(
        host.documents(),
        options.limits,
        roots,
        options.settings.max_documents,
        judged_as(options),
    );
    intake.search_in(in_force.search.clone());
    Arc::new(intake)
}

/// Returns the function that maps a link to the path under which its file is judged.
fn judged_as(options: &Options) -> Box<JudgedAs> {
    let (roots, files) = (options.roots.clone(), options.files.clone());
    let judges_all = options.settings.once && !options.settings.own_verdicts;
    Box::new(move |path| {
        let is_judged = |path: &Path| {
            let mut files = files.iter();
            files.any(|it| it == path) || is_looked_at(&roots, path)
        };
        if is_judged(path) {
            return Some(path.into());
        }
        let real = foreign::canonicalize(path).ok();
        let real = real.filter(|it| is_judged(it)).map(Into::into);
        real.or_else(|| judged_in_a_run(path).filter(|_| judges_all))
    })
}

pub(super) fn children(
    backend: &dyn Backend,
    options: &Options,
    descriptors: Descriptors,
    inbox: &Inbox,
) -> Result<Box<dyn Processes>, StartError> {
    let surroundings = Surroundings {
        descriptors: descriptors.before,
        instance_dir: options.instance.dir().to_path_buf(),
        die_with_broker: options.die_with_broker,
        sandbox: options.sandbox,
        memory_limit: options.memory_limit,
    };
    let generation = options.settings.generation;
    let launches = Launches::of(options.instance.dir())
        .map_err(|source| system("write to the runtime directory", source))?;
    let events = inbox.events_in.clone();
    Ok(backend.children(surroundings, launches, generation, events))
}

fn look_once(roots: &[PathBuf], files: &[PathBuf], seen: &mpsc::UnboundedSender<Seen>) {
    // The loop may have ended meanwhile, so a failed send is ignored.
    let tell = |what| drop(seen.send(what));
    for root in roots {
        let found = scan_directory(root, roots);
        for unseen in found.unseen {
            tell(Seen::Unseen(unseen));
        }
        for (path, stamp) in found.files {
            tell(Seen::Settled(path.into(), stamp));
        }
    }
    for file in files {
        let path = file.clone();
        let why = match stamp_of(file) {
            Ok(Some(stamp)) => {
                tell(Seen::Settled(path.into(), stamp));
                continue;
            }
            Ok(None) => "it does not exist any more, or is not a regular file".to_owned(),
            Err(error) => format!("cannot access it: {error}"),
        };
        tell(Seen::Unseen(Unseen { path, why }));
    }
    tell(Seen::Scanned);
}

pub(super) fn system(what: &str, source: std::io::Error) -> StartError {
    StartError::System {
        what: format!("cannot {what}"),
        source,
    }
}
