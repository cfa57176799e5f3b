//! `qcbus check`: a private broker for one run, the same engine as `serve`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use qcbus_broker::{Broker, Options, Outside, ResultPaths, StartError, Told};
use qcbus_broker::{Delivery, Judged, Notice, Settings, Stop};
use qcbus_bus::{HostOptions, Instance, SharedMemory, StartError as BusError};
use qcbus_document::{FileKind, Suffix};
use qcbus_formats::config::Config;
use qcbus_messages::path_text::{from_text, to_text};
use qcbus_messages::{Exit, Verdict};
use qcbus_reporter_sdk::FileSources;
use tokio::sync::mpsc;

use super::settings::{
    absolute, dialect, limits, manifest_directory, memory_limit, named, program, settings,
};
use crate::args::{CheckArgs, Format};
use crate::{standard, talk};

/// Runs the command.
pub fn run(args: &CheckArgs) -> Exit {
    talk::log("warn");
    match prepare(args) {
        Ok(prepared) => check(args, prepared),
        Err((exit, why)) => {
            talk::fail(&why);
            exit
        }
    }
}

type Refusal = (Exit, String);

fn usage(why: impl Into<String>) -> Refusal {
    (Exit::Usage, why.into())
}

/// What is to be checked, and how.
struct Prepared {
    options: Options,
    config: Option<Arc<Config>>,
}

fn prepare(args: &CheckArgs) -> Result<Prepared, Refusal> {
    let config = args.config.as_deref().map(absolute);
    let parsed = match &config {
        Some(path) => Some(
            qcbus_broker::reload::read_config(path)
                .map_err(|error| usage(error.to_string()))?
                .config,
        ),
        None => None,
    };
    let bundles_d = args.bundles_d.as_deref().map(manifest_directory);
    let bundles_d = bundles_d.transpose().map_err(usage)?;
    let (roots, files) = targets(args, config.as_deref(), parsed.as_ref())?;
    let asam = config.is_some() && roots.is_empty() && files.len() == 1;
    let out = absolute(args.output.out.as_deref().unwrap_or(Path::new(if asam {
        "."
    } else {
        "qcbus-out"
    })));
    writable(&out)?;
    let program = program().map_err(|why| (Exit::Internal, why))?;
    let (kinds, config_named) = (kinds(&roots, &files), parsed.is_some());
    let kinds = if config_named {
        FileKind::ALL.into_iter().collect()
    } else {
        kinds
    };
    let bundles = standard::bundle_specs(&program, &kinds, args.schema_dir.as_deref());
    let options = Options {
        instance: private_instance()?,
        roots,
        files,
        watch: false,
        poll: None,
        rescan: Duration::MAX,
        here: Some(here()?),
        single_result: asam.then(|| out.join("Result.xqar")),
        out,
        state: None,
        retention: Duration::MAX,
        dialect: dialect(args.output.xqar_dialect),
        durable: false,
        verdict_files: false,
        gate: None,
        gate_outside: Outside::default(),
        config,
        bundles_d,
        standard: wanted_bundles(bundles.map_err(usage)?, parsed.as_ref()),
        reporters: standard::reporter_specs(&program),
        known: standard::known(),
        die_with_broker: true,
        sandbox: !args.no_sandbox,
        memory_limit: memory_limit(&args.limits),
        limits: limits(&args.limits),
        host: HostOptions::default(),
        settings: Settings {
            once: true,
            collect: Duration::ZERO,
            ..settings(&args.limits)
        },
    };
    Ok(Prepared {
        options,
        config: parsed.map(Arc::new),
    })
}

/// The directory in which the command was typed.
fn here() -> Result<PathBuf, Refusal> {
    std::env::current_dir().map_err(|error| usage(format!("cannot see where this is: {error}")))
}

/// Refuses a place for results where nothing can be written, before anything is checked for it.
fn writable(out: &Path) -> Result<(), Refusal> {
    use rustix::fs::{Access, access};
    let mut above = out.ancestors();
    let there = above.find(|path| path.symlink_metadata().is_ok());
    let there = there.unwrap_or(Path::new("/"));
    let refused = if there.is_dir() {
        access(there, Access::WRITE_OK | Access::EXEC_OK)
    } else {
        Err(rustix::io::Errno::NOTDIR)
    };
    refused.map_err(|error| {
        let (out, there) = (to_text(out), to_text(there));
        usage(format!(
            "cannot write results into {out}: {there}: {error}; choose another directory with --out"
        ))
    })
}

/// A configuration runs what it names and nothing else.
fn wanted_bundles(
    specs: Vec<qcbus_broker::ChildSpec>,
    config: Option<&Config>,
) -> Vec<qcbus_broker::ChildSpec> {
    let Some(config) = config else { return specs };
    let named = |name: &str| {
        let alias = standard::bundle(name).map_or("", |bundle| bundle.alias);
        config.bundle(name, alias).is_some()
    };
    specs.into_iter().filter(|spec| named(&spec.name)).collect()
}

/// Directories and files, from the command line or from the configuration.
fn targets(
    args: &CheckArgs,
    config_path: Option<&Path>,
    config: Option<&Config>,
) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Refusal> {
    let mut paths = args.paths.clone();
    if paths.is_empty() {
        let Some(config) = config else {
            return Err(usage(
                "nothing to check: name files or directories, or a configuration with -c",
            ));
        };
        let Some(input) = config.input_file() else {
            return Err(usage(
                "the configuration names no InputFile; add one, or name a file after -c CONFIG",
            ));
        };
        paths.push(input_path(&from_text(input), config_path));
    }
    let (mut roots, mut files) = (BTreeSet::new(), BTreeSet::new());
    for path in &paths {
        let real = std::fs::canonicalize(path)
            .map_err(|error| usage(format!("cannot check {}: {error}", to_text(path))))?;
        // A link to a file is checked under its own name, as it is in a directory.
        let file = named(path);
        if real.is_dir() {
            roots.insert(real);
        } else if !real.is_file() {
            let shown = to_text(path);
            return Err(usage(format!(
                "cannot check {shown}: it is no regular file"
            )));
        } else if FileKind::of_path(&file).is_some() {
            files.insert(file);
        } else if FileKind::of_path(&real).is_some() {
            files.insert(real);
        } else {
            let shown = to_text(path);
            return Err(usage(format!(
                "{shown} is no file that qcbus checks ({})",
                Suffix::list()
            )));
        }
    }
    files.retain(|file| !roots.iter().any(|root| file.starts_with(root)));
    let nested: Vec<PathBuf> = roots
        .iter()
        .filter(|root| roots.iter().any(|it| it != *root && root.starts_with(it)))
        .cloned()
        .collect();
    roots.retain(|root| !nested.contains(root));
    Ok((roots.into_iter().collect(), files.into_iter().collect()))
}

/// A relative InputFile is meant from here, as ASAM's bundles take it, else from beside the
/// configuration.
fn input_path(input: &Path, config: Option<&Path>) -> PathBuf {
    let beside = config
        .and_then(Path::parent)
        .map(|directory| directory.join(input));
    match beside {
        Some(beside) if !input.exists() && beside.exists() => beside,
        _ => input.to_path_buf(),
    }
}

fn kinds(roots: &[PathBuf], files: &[PathBuf]) -> BTreeSet<FileKind> {
    if roots.is_empty() {
        files
            .iter()
            .filter_map(|file| FileKind::of_path(file))
            .collect()
    } else {
        FileKind::ALL.into_iter().collect()
    }
}

fn private_instance() -> Result<Instance, Refusal> {
    qcbus_bus::sweep_private_instances();
    let random = random_bytes().map_err(|why| (Exit::Internal, why))?;
    let random = u64::from_le_bytes(random);
    let name = format!("check-{}-{random:016x}", std::process::id());
    Instance::named(&name).map_err(|error| usage(error.to_string()))
}

fn random_bytes() -> Result<[u8; 8], String> {
    let mut bytes = [0; 8];
    rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
        .map_err(|error| format!("no random number: {error}"))?;
    Ok(bytes)
}

fn check(args: &CheckArgs, prepared: Prepared) -> Exit {
    let options = &prepared.options;
    let here = options.here.clone().unwrap_or_default();
    let (out, roots) = (options.out.clone(), options.roots.clone());
    let mut places = ResultPaths::of_run(out, here, roots, &options.files);
    places.single.clone_from(&options.single_result);
    let printer = Printer {
        places,
        config: prepared.config,
        format: args.format,
        quiet: args.quiet,
        progress: talk::Progress::new(!args.quiet),
        expected: Vec::new(),
        printed: 0,
        judged: BTreeMap::new(),
        verdicts: Vec::new(),
        unwritten: 0,
        unseen: 0,
        interrupted: false,
        scanned: false,
        notices: BTreeSet::new(),
    };
    let directory = prepared.options.instance.dir().to_path_buf();
    let printer = Arc::new(Mutex::new(printer));
    let exit = drive(prepared.options, &printer);
    // Private to this run; what is left of it is of no use to anybody.
    let _ = std::fs::remove_dir_all(directory);
    let mut printer = lock(&printer);
    match exit {
        Err((exit, why)) => {
            talk::fail(&why);
            exit
        }
        Ok(()) => printer.finish(),
    }
}

fn drive(options: Options, printer: &Arc<Mutex<Printer>>) -> Result<(), Refusal> {
    let internal = |why: String| (Exit::Internal, why);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| internal(format!("cannot start: {error}")))?;
    runtime.block_on(async {
        let stops = super::stops::listen().map_err(|error| internal(error.to_string()))?;
        let mut stops = noted(stops, printer.clone());
        if let Some(broker) = start(options, printer, &mut stops).await? {
            broker.run(stops).await;
        }
        Ok(())
    })?;
    // Threads that still read a file must not hold up the end.
    runtime.shutdown_background();
    Ok(())
}

/// Passes wishes to stop on, and remembers that there was one.
fn noted(mut stops: mpsc::Receiver<Stop>, printer: Arc<Mutex<Printer>>) -> mpsc::Receiver<Stop> {
    let (sender, receiver) = mpsc::channel(4);
    tokio::spawn(async move {
        while let Some(stop) = stops.recv().await {
            lock(&printer).interrupted = true;
            if sender.send(stop).await.is_err() {
                return;
            }
        }
    });
    receiver
}

/// How often a start is tried again for which there is no shared memory.
const START_AGAIN: Duration = Duration::from_millis(50);

/// Starts the broker, when others have let go of shared memory if need be. `None`: somebody wanted it
/// to stop before.
async fn start(
    options: Options,
    printer: &Arc<Mutex<Printer>>,
    stops: &mut mpsc::Receiver<Stop>,
) -> Result<Option<Broker>, Refusal> {
    let (mut moved, mut most_free) = (Instant::now(), 0);
    let limit = options.settings.room_limit;
    loop {
        let listener = printer.clone();
        let tell = move |told| lock(&listener).told(told);
        let error = match Broker::start(options.clone(), tell) {
            Ok(broker) => return Ok(Some(broker)),
            Err(error) => error,
        };
        match &error {
            StartError::Load(_)
            | StartError::Results(_)
            | StartError::Bus(BusError::Instance(_)) => return Err(usage(error.to_string())),
            StartError::Bus(why) if why.may_pass() => {}
            _ => return Err((Exit::Internal, error.to_string())),
        }
        // What becomes free goes to others, who end, too: that is progress.
        let free = SharedMemory::now().map_or(0, |memory| memory.free);
        if free != most_free {
            (moved, most_free) = (Instant::now(), free);
        }
        if moved.elapsed() >= limit {
            let waited = limit.as_secs();
            let why = format!("{error} (waited until nothing had moved for {waited} seconds)");
            return Err((Exit::Internal, why));
        }
        lock(printer).wait("waiting for shared memory, which others use at the moment");
        tokio::select! {
            _ = stops.recv() => return Ok(None),
            () = tokio::time::sleep(START_AGAIN) => {}
        }
    }
}

fn lock(printer: &Mutex<Printer>) -> MutexGuard<'_, Printer> {
    printer.lock().unwrap_or_else(PoisonError::into_inner)
}

/// So many files that were not judged are named.
const NAMED: usize = 10;

/// Prints results in the order of their paths, each as soon as those before it are there.
struct Printer {
    places: ResultPaths,
    config: Option<Arc<Config>>,
    format: Format,
    quiet: bool,
    progress: talk::Progress,
    expected: Vec<Arc<Path>>,
    printed: usize,
    judged: BTreeMap<Arc<Path>, Arc<Judged>>,
    verdicts: Vec<Verdict>,
    /// Files whose result could not be written.
    unwritten: usize,
    /// What could not be looked at: nobody knows what lies there.
    unseen: usize,
    /// Somebody wanted it to stop.
    interrupted: bool,
    /// Everything that is to be checked is known.
    scanned: bool,
    notices: BTreeSet<String>,
}

impl Printer {
    fn told(&mut self, told: Told) {
        match told {
            Told::Notice(notice) => {
                self.unseen += usize::from(matches!(notice, Notice::Unseen(_)));
                let text = notice.to_string();
                if !self.notices.contains(&text) {
                    self.progress.clear();
                    talk::say(&format!("note: {text}"));
                    self.notices.insert(text);
                }
            }
            Told::Scanned { files } => {
                self.expected = files;
                self.scanned = true;
                self.print_ready();
            }
            Told::Verdict(verdict) => {
                self.judged.insert(verdict.path, verdict.judged);
                self.print_ready();
            }
        }
    }

    /// Says once what is waited for.
    fn wait(&mut self, text: &str) {
        if self.notices.insert(text.to_owned()) {
            self.progress.clear();
            talk::say(&format!("note: {text}"));
        }
    }

    fn print_ready(&mut self) {
        while let Some(path) = self.expected.get(self.printed).cloned() {
            let Some(judged) = self.judged.remove(&path) else {
                break;
            };
            self.print(&path, judged);
            self.printed += 1;
        }
        let (done, total) = (self.verdicts.len() + self.judged.len(), self.expected.len());
        if total > 0 {
            self.progress.show(&format!("{done}/{total} files"));
        }
    }

    fn print(&mut self, path: &Arc<Path>, judged: Arc<Judged>) {
        self.progress.clear();
        self.verdicts.push(judged.verdict);
        let shown = self.places.display(path);
        if !judged.is_written() {
            self.unwritten += 1;
            let why = judged.why.join("; ");
            talk::fail(&format!("{} has no result: {why}", to_text(&shown)));
        }
        if self.quiet && self.format == Format::Text {
            talk::print(&format!("{}: {}\n", to_text(&shown), judged.verdict));
            return;
        }
        let delivery = Delivery {
            job: judged.job,
            path: path.clone(),
            judged,
        };
        let message = qcbus_broker::deliveries::message(
            "stdout",
            &delivery,
            None,
            &self.places,
            self.config.as_ref(),
        );
        match (message, self.format) {
            (Ok(message), Format::Text) => {
                let options = qcbus_report_text::Options {
                    width: talk::width(),
                    color: talk::color(),
                    skipped_names: 2,
                    inapplicable: false,
                };
                let sources = FileSources::new(&message);
                talk::print(&qcbus_report_text::render(&message, &options, &sources));
            }
            (Ok(message), Format::Json) => match qcbus_report_json::render(&message, 0) {
                Ok(text) => talk::print(&text),
                Err(error) => talk::fail(&error.to_string()),
            },
            // That has been said.
            (Err(_), _) if !delivery.judged.is_written() => {}
            (Err(why), _) => talk::fail(&why),
        }
    }

    /// The files without a verdict, apart from those that are still to be printed.
    fn unjudged(&self, rest: &[(Arc<Path>, Arc<Judged>)]) -> Vec<Arc<Path>> {
        let left = self.expected.iter().skip(self.printed);
        let waiting = left.filter(|path| !rest.iter().any(|(it, _)| it == *path));
        waiting.cloned().collect()
    }

    /// Says what was not looked at.
    fn say_unjudged(&self, missing: &[Arc<Path>]) {
        let why = match self.interrupted {
            true => "ended by a signal",
            false => "not there any more",
        };
        if self.interrupted && !self.scanned {
            talk::fail(&format!(
                "{why} before it was known what is to be checked: nothing was looked at"
            ));
        }
        if missing.is_empty() {
            return;
        }
        let files = match missing.len() {
            1 => "1 file was".to_owned(),
            many => format!("{many} files were"),
        };
        talk::fail(&format!("{files} not judged: {why}"));
        for path in missing.iter().take(NAMED) {
            let shown = self.places.display(path);
            talk::say(&format!("  {}", to_text(&shown)));
        }
        if missing.len() > NAMED {
            talk::say(&format!("  and {} more", missing.len() - NAMED));
        }
    }

    fn finish(&mut self) -> Exit {
        self.progress.clear();
        let rest: Vec<_> = std::mem::take(&mut self.judged).into_iter().collect();
        let missing = self.unjudged(&rest);
        for (path, judged) in rest {
            self.print(&path, judged);
        }
        let count = |verdict| self.verdicts.iter().filter(|it| **it == verdict).count();
        let total = self.verdicts.len();
        self.say_unjudged(&missing);
        let interrupted = self.interrupted && (!self.scanned || !missing.is_empty());
        if total == 0 && interrupted {
            return Exit::Undetermined;
        }
        if total == 0 && self.unseen > 0 {
            talk::fail("nothing was checked: what there may be could not be looked at");
            return Exit::Undetermined;
        }
        if total == 0 {
            talk::fail(&format!(
                "nothing to check: there is no file that qcbus checks ({})",
                Suffix::list()
            ));
            return Exit::Usage;
        }
        let files = if total == 1 { "file" } else { "files" };
        let unseen = match self.unseen {
            0 => String::new(),
            unseen => format!(", {unseen} not looked at"),
        };
        if self.format == Format::Text && (total > 1 || self.quiet) {
            talk::say(&format!(
                "{total} {files}: {} accepted, {} rejected, {} undetermined{unseen}; results in {}",
                count(Verdict::Accepted),
                count(Verdict::Rejected),
                count(Verdict::Undetermined),
                to_text(&self.places.out)
            ));
        }
        let exit = Exit::of_verdicts(self.verdicts.iter().copied());
        if self.unwritten > 0 {
            Exit::Internal
        } else if exit == Exit::Accepted && (!missing.is_empty() || interrupted || self.unseen > 0)
        {
            Exit::Undetermined
        } else {
            exit
        }
    }
}
