//! `qcbus check`: runs a private broker for one run, with the same engine as `serve`.

mod outputs;
mod printer;
mod run;
mod tally;
mod targets;
mod warm;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use qcbus_broker::{Broker, OperatorSignal, Options, StartError};
use qcbus_bus::{HostOptions, Instance, SharedMemory, StartError as BusError};
use qcbus_document::FileKind;
use qcbus_formats::config::{Choice, Config, Known};
use qcbus_messages::Exit;
use qcbus_messages::path_text::{relative, to_text};
use qcbus_publish::gate::Outside;
use qcbus_publish::result_paths::ResultPaths;
use qcbus_types::Settings;
use tokio::sync::mpsc;

use super::settings::{
    absolute, dialect, limits, manifest_directory, memory_limit, program, settings,
};
use crate::args::CheckArgs;
use crate::{standard, talk};
use outputs::Outputs;
pub(super) use outputs::report_place;
use printer::{News, Printer};
use run::Run;
use targets::{Targets, kinds, targets};

/// Runs the command.
pub fn run(args: &CheckArgs) -> Exit {
    talk::log("warn");
    talk::set_color(args.print.color);
    prepare(args)
        .and_then(|prepared| carry_out(args, prepared))
        .unwrap_or_else(|(exit, why)| {
            talk::fail(&why);
            exit
        })
}

fn carry_out(args: &CheckArgs, prepared: Prepared) -> Result<Exit, Refusal> {
    say_excluded(args, &prepared.excluded);
    if prepared.options.roots.is_empty() && prepared.options.files.is_empty() {
        return Ok(nothing_left(args, prepared.outputs));
    }
    let cannot = |error| (Exit::Internal, format!("cannot start: {error}"));
    let mut run = Run::new().map_err(cannot)?;
    match warm::check(args, prepared, &mut run) {
        Ok(exit) => {
            // A thread that still waits for an answer must not delay the end.
            run.runtime.shutdown_background();
            Ok(exit)
        }
        Err(mut prepared) => {
            prepared.options.instance = private_instance()?;
            Ok(check(args, *prepared, run))
        }
    }
}

/// Prints the names of the excluded files in verbose mode.
fn say_excluded(args: &CheckArgs, excluded: &[PathBuf]) {
    for file in excluded.iter().filter(|_| args.print.verbose) {
        let shown = to_text(relative(file));
        talk::say(&format!("note: {shown} is excluded by a .qcignore"));
    }
}

/// Ends the run if every named file is excluded on purpose. There is nothing to report on.
fn nothing_left(args: &CheckArgs, mut outputs: Outputs) -> Exit {
    if args.print.quiet {
        return Exit::Accepted;
    }
    let unwritten = match outputs.give_up() {
        names if names.is_empty() => String::new(),
        names => format!("; not written: {}", names.join(", ")),
    };
    talk::say(&format!(
        "note: nothing to check: every named file is excluded by a .qcignore{unwritten}"
    ));
    Exit::Accepted
}

type Refusal = (Exit, String);

fn usage(why: impl Into<String>) -> Refusal {
    (Exit::Usage, why.into())
}

/// Prepared input and options of a check.
struct Prepared {
    options: Options,
    config: Option<Arc<Config>>,
    outputs: Outputs,
    excluded: Vec<PathBuf>,
}

fn prepare(args: &CheckArgs) -> Result<Prepared, Refusal> {
    let config = args.config.as_deref().map(absolute);
    let parsed = match &config {
        Some(path) => Some(
            qcbus_configuration::read_config(path)
                .map_err(|error| usage(error.to_string()))?
                .config,
        ),
        None => None,
    };
    let bundles_d = args.bundles_d.as_deref().map(manifest_directory);
    let bundles_d = bundles_d.transpose().map_err(usage)?;
    let Targets {
        roots,
        files,
        excluded,
    } = targets(args, config.as_deref(), parsed.as_ref())?;
    // A directory may contain any number of files.
    let several = if roots.is_empty() {
        files.len()
    } else {
        usize::MAX
    };
    let asam = config.is_some() && roots.is_empty() && files.len() == 1;
    // In this case the only result must be that of the named file.
    let own_verdicts = args.own_verdict || asam;
    let out = absolute(args.output.out.as_deref().unwrap_or(Path::new(if asam {
        "."
    } else {
        "qcbus-out"
    })));
    writable(&out)?;
    let outputs = Outputs::new(&args.print, &out)?;
    let program = program();
    let config_named = parsed.is_some();
    let kinds = match config_named {
        true => FileKind::ALL.into_iter().collect(),
        false => kinds(&roots, &files, own_verdicts),
    };
    let bundles = standard::bundle_specs(
        program,
        &kinds,
        args.schema_dir.as_deref(),
        args.limits.threads,
    );
    let options = Options {
        // A private instance is created only if the check runs here, and not if a running broker is
        // used.
        instance: Instance::at(PathBuf::new()),
        roots,
        files,
        watch: false,
        poll: None,
        rescan: Duration::MAX,
        settle: None,
        here: Some(here()?),
        single_result: asam.then(|| out.join("Result.xqar")),
        out,
        choice: choice(args)?,
        strict: args.strict,
        all: args.all,
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
        reporters: standard::reporter_specs(program),
        // This list is needed only to validate configurations.
        known: match config_named {
            true => standard::known(),
            false => Known::default(),
        },
        adapter: standard::adapter(program, true),
        die_with_broker: true,
        sandbox: !args.no_sandbox,
        memory_limit: memory_limit(&args.limits),
        limits: limits(&args.limits),
        host: HostOptions::default(),
        settings: run_settings(args, several, own_verdicts),
    };
    Ok(Prepared {
        options,
        config: parsed.map(Arc::new),
        outputs,
        excluded,
    })
}

/// Returns the settings of a run that ends by itself, with at most one writer per file.
fn run_settings(args: &CheckArgs, files: usize, own_verdicts: bool) -> Settings {
    let settings = settings(&args.limits);
    Settings {
        once: true,
        own_verdicts,
        collect: Duration::ZERO,
        max_storing: settings.max_storing.min(files.max(1)),
        ..settings
    }
}

/// Returns the choice of checkers on the command line. A name without a match is an error, because
/// its effect would be silently lost.
fn choice(args: &CheckArgs) -> Result<Choice, Refusal> {
    let choice = Choice {
        select: args.select.clone(),
        ignore: args.ignore.clone(),
    };
    // The checkers of other bundles are known only after these bundles have joined.
    if args.bundles_d.is_some() {
        return Ok(choice);
    }
    for name in choice.select.iter().chain(&choice.ignore) {
        if !standard::is_named(name) {
            let hint = standard::hint(name);
            return Err(usage(format!("checker `{name}` not found; {hint}")));
        }
    }
    Ok(choice)
}

/// Returns the current directory of the command.
fn here() -> Result<PathBuf, Refusal> {
    std::env::current_dir()
        .map_err(|error| usage(format!("cannot determine the current directory: {error}")))
}

/// Rejects an output directory that is not writable, before any check starts.
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

/// Returns the bundles to run. With a configuration, these are only the bundles that it names.
fn wanted_bundles(
    specs: Vec<qcbus_types::ChildSpec>,
    config: Option<&Config>,
) -> Vec<qcbus_types::ChildSpec> {
    let Some(config) = config else { return specs };
    let named = |name: &str| {
        let alias = standard::bundle(name).map_or("", |bundle| bundle.alias);
        config.bundle(name, alias).is_some()
    };
    specs.into_iter().filter(|spec| named(&spec.name)).collect()
}

fn private_instance() -> Result<Instance, Refusal> {
    let random = random_bytes().map_err(|why| (Exit::Internal, why))?;
    let random = u64::from_le_bytes(random);
    let name = format!("check-{}-{random:016x}", std::process::id());
    Instance::named(&name).map_err(|error| usage(error.to_string()))
}

fn random_bytes() -> Result<[u8; 8], String> {
    let mut bytes = [0; 8];
    rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
        .map_err(|error| format!("cannot get a random number: {error}"))?;
    Ok(bytes)
}

/// Returns the paths of the results of a run.
fn places(options: &Options) -> ResultPaths {
    let here = options.here.clone().unwrap_or_default();
    let (out, roots) = (options.out.clone(), options.roots.clone());
    let mut places = ResultPaths::of_run(out, here, roots, &options.files);
    places.single.clone_from(&options.single_result);
    places
}

fn check(args: &CheckArgs, prepared: Prepared, run: Run) -> Exit {
    qcbus_bus::sweep_private_instances();
    let options = &prepared.options;
    let (places, roots) = (places(options), options.roots.clone());
    let printer = Printer::new(places, roots, prepared.config, prepared.outputs, args);
    let directory = prepared.options.instance.dir().to_path_buf();
    let (sender, receiver) = channel();
    // Reports of large maps take time, and the broker must handle other messages meanwhile.
    let printing = std::thread::Builder::new()
        .name("reports".to_owned())
        .spawn(move || print(printer, &receiver));
    let printing = match printing {
        Ok(printing) => printing,
        Err(error) => {
            talk::fail(&format!("cannot start a thread: {error}"));
            return Exit::Internal;
        }
    };
    let driven = drive(run, prepared.options, &sender);
    drop(sender);
    let printer = printing.join();
    // The directory is private to this run, so its remains are useless.
    let _ = std::fs::remove_dir_all(directory);
    match (driven, printer) {
        (Err((exit, why)), _) => {
            talk::fail(&why);
            exit
        }
        (Ok(()), Ok(printer)) => printer.finish(),
        // The panic message has already been printed.
        (Ok(()), Err(_)) => Exit::Internal,
    }
}

/// Prints until all senders of news are gone.
fn print(mut printer: Printer, news: &Receiver<News>) -> Printer {
    while let Ok(news) = news.recv() {
        printer.take(news);
    }
    printer
}

fn drive(run: Run, options: Options, news: &Sender<News>) -> Result<(), Refusal> {
    run.runtime.block_on(async {
        let mut stops = noted(run.stops, news.clone());
        if let Some(broker) = start(options, news, &mut stops).await? {
            broker.run(stops).await;
        }
        Ok(())
    })?;
    // Threads that still read a file must not delay the end.
    run.runtime.shutdown_background();
    Ok(())
}

/// Forwards stop requests and informs the printer about them.
fn noted(
    mut stops: mpsc::Receiver<OperatorSignal>,
    news: Sender<News>,
) -> mpsc::Receiver<OperatorSignal> {
    let (sender, receiver) = mpsc::channel(4);
    tokio::spawn(async move {
        while let Some(stop) = stops.recv().await {
            let _ = news.send(News::Interrupted);
            if sender.send(stop).await.is_err() {
                return;
            }
        }
    });
    receiver
}

/// Interval between start attempts while shared memory is insufficient.
const START_AGAIN: Duration = Duration::from_millis(50);

/// Starts the broker. If necessary, it waits until other processes free shared memory. Returns
/// `None` after a stop request.
async fn start(
    options: Options,
    news: &Sender<News>,
    stops: &mut mpsc::Receiver<OperatorSignal>,
) -> Result<Option<Broker>, Refusal> {
    let (mut moved, mut most_free) = (Instant::now(), 0);
    let limit = options.settings.room_limit;
    loop {
        let listener = news.clone();
        let tell = move |told| {
            // The printer outlives the broker, so sending cannot fail.
            let _ = listener.send(News::Told(told));
        };
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
        // Freed memory may go to other processes, which also end. So any change is progress.
        let free = SharedMemory::now().map_or(0, |memory| memory.free);
        if free != most_free {
            (moved, most_free) = (Instant::now(), free);
        }
        if moved.elapsed() >= limit {
            let waited = limit.as_secs();
            let why = format!("{error} (waited until nothing had changed for {waited} seconds)");
            return Err((Exit::Internal, why));
        }
        let waits = "waiting for shared memory, which is in use by other processes";
        let _ = news.send(News::Waits(waits));
        tokio::select! {
            _ = stops.recv() => return Ok(None),
            () = tokio::time::sleep(START_AGAIN) => {}
        }
    }
}
