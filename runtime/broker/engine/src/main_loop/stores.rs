//! Stores of a starting broker: opens the journal, the results directory and the gate, and reads their content.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use qcbus_configuration::Loaded;
use qcbus_environment::is_simulated;
use qcbus_messages::Role;
use qcbus_publish::directory_lock::{DirectoryLock, LockError, Purpose};
use qcbus_publish::gate::{Gate, GateError, GateOptions};
use qcbus_publish::journal::{Journal, JournalError, SharedJournal};
use qcbus_publish::outputs::Outputs;
use qcbus_publish::result_paths::ResultPaths;
use qcbus_publish::store::{Reconciled, Store, TrialResults, remove_earlier_results};
use qcbus_publish::writers::Writers;
use qcbus_types::{Member, Notice};
use qcbus_watch::is_looked_at;
use qcbus_watch::probes::Probes;
use tokio::sync::mpsc;

use super::looks::Looks;
use super::remains::Remains;
use super::start::system;
use super::{Inbox, StartError};
use crate::options::Options;

/// The directory of the journal.
pub(super) struct StateDirectory {
    /// `None` if there is no journal.
    pub lock: Option<Arc<DirectoryLock>>,
    /// It was removed or replaced while the broker ran.
    pub is_gone: bool,
}

impl StateDirectory {
    pub fn of(journal: Option<&Journal>) -> StateDirectory {
        StateDirectory {
            lock: journal.and_then(Journal::lock),
            is_gone: false,
        }
    }
}

/// Opens the journal and numbers this start. Returns the journal, if there is one, and its registry.
pub(super) fn numbered_journal(
    options: &mut Options,
    generation: u64,
) -> Result<(Option<Journal>, Vec<Member>), JournalError> {
    let journal = journal_of(options)?;
    let (numbers, members) = remembered_by(journal.as_ref())?;
    options.settings.generation = generation;
    options.settings.numbers = numbers.max(generation);
    Ok((journal, members))
}

fn journal_of(options: &Options) -> Result<Option<Journal>, JournalError> {
    let state = options.state.as_ref();
    let opened = state.map(|state| Journal::open(state, options.instance.name()));
    opened.transpose()
}

/// Returns the first new number and the registry from the journal. Both are empty without a journal.
fn remembered_by(journal: Option<&Journal>) -> Result<(u64, Vec<Member>), JournalError> {
    let Some(journal) = journal else {
        return Ok((0, Vec::new()));
    };
    Ok((journal.numbers()?, journal.members()?))
}

/// Locks the results directory. Runs of `check` share it with each other.
pub(super) fn results_of(options: &Options) -> Result<DirectoryLock, LockError> {
    if options.watch {
        DirectoryLock::take(&options.out, Purpose::Results, options.instance.name())
    } else {
        DirectoryLock::share(&options.out)
    }
}

/// Returns the outputs. A broker watches its output files while it runs. The results of a run
/// belong to the user who started it.
fn outputs_of(options: &Options) -> Result<Outputs, StartError> {
    if !options.watch || is_simulated() {
        return Ok(Outputs::default());
    }
    Outputs::kept().map_err(|source| system("watch results", source))
}

pub(super) fn store(
    options: &Options,
    (journal, lock): (Option<Journal>, DirectoryLock),
    looks: &Looks,
    notices: &mpsc::UnboundedSender<Notice>,
) -> Result<Store, StartError> {
    let (outputs, probes) = (outputs_of(options)?, looks.probes());
    let (out, roots) = (options.out.clone(), options.roots.clone());
    let mut places = match &options.here {
        Some(here) => ResultPaths::of_run(out, here.clone(), roots, &options.files),
        None => ResultPaths::of_watched(out, roots),
    };
    places.single.clone_from(&options.single_result);
    let gate = options.gate.as_ref();
    let gate = gate.map(|directory| {
        let (probes, notices) = (probes.clone(), notices.clone());
        let to = (directory.as_path(), &places, &outputs);
        gate_of(options, to, probes, notices)
    });
    Ok(Store {
        places,
        choice: options.choice.clone(),
        strict: options.strict,
        all: options.all,
        dialect: options.dialect,
        durable: options.durable,
        verdict_files: options.verdict_files,
        retries: options.watch,
        own_verdicts: options.settings.own_verdicts,
        gate: gate.transpose()?,
        outputs,
        lock,
        probes,
        trials: options.state.as_deref().map(TrialResults::anew),
        journal: journal.map(SharedJournal::from),
        epoch: AtomicU64::new(0),
    })
}

pub(super) fn writers(
    options: &Options,
    store: &Arc<Store>,
    inbox: &Inbox,
    notices: &mpsc::UnboundedSender<Notice>,
) -> Result<Writers, StartError> {
    let threads = options.settings.max_storing;
    Writers::start(threads, store, &inbox.events_in, notices)
        .map_err(|source| system("start writing", source))
}

fn gate_of(
    options: &Options,
    (directory, paths, outputs): (&Path, &ResultPaths, &Outputs),
    probes: Probes,
    notices: mpsc::UnboundedSender<Notice>,
) -> Result<Gate, GateError> {
    let roots = options.roots.clone();
    let gate = GateOptions {
        max_file: options.limits.max_file,
        probes,
        outputs: outputs.clone(),
        directory: directory.to_path_buf(),
        paths: paths.clone(),
        durable: options.durable,
        outside: options.gate_outside,
        is_judged: Box::new(move |path| is_looked_at(&roots, path)),
        say: Box::new(move |text| {
            // The error is ignored: after the end of the loop the notice is not needed.
            let _ = notices.send(Notice::HeldBack(text));
        }),
    };
    Gate::open(gate, options.instance.name())
}

/// Removes remains and reconciles the disk with the journal before any file is judged.
pub(super) fn reconcile(
    options: &Options,
    loaded: &Loaded,
    store: &Store,
    remains: &Remains,
) -> Result<Reconciled, StartError> {
    if !options.watch {
        return Ok(Reconciled::nothing(remove_earlier_results(&store.places)));
    }
    remains.sweep_first();
    let reporters = loaded
        .children
        .iter()
        .filter(|it| it.role == Role::Reporter);
    let reporters: Vec<String> = reporters.map(|it| it.name.clone()).collect();
    let remembered = store.remembered()?;
    Ok(store.reconcile(remembered, &reporters)?)
}
