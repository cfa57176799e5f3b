//! `qcbus serve`: the long-running broker.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use qcbus_broker::{Broker, Options, StartError, Told};
use qcbus_bus::{HostOptions, StartError as BusError};
use qcbus_messages::Exit;
use qcbus_messages::path_text::to_text;
use qcbus_publish::directory_lock::LockError;
use qcbus_publish::gate::{GateError, Outside};
use qcbus_publish::journal::JournalError;

use super::settings::{
    absolute, dialect, instance, limits, manifest_directory, memory_limit, outermost, program,
    real, settings,
};
use super::stops::Hangup;
use crate::args::{OutsideArg, ServeArgs};
use crate::{standard, talk};

/// Runs the command.
pub fn run(args: &ServeArgs) -> Exit {
    qcbus_broker::memory::share_heaps();
    talk::log("info");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    // The handler is installed before any slow step. A terminal that closes during the start must
    // not end the broker.
    let prepared = runtime.and_then(|runtime| {
        let hangup = runtime.block_on(async { Hangup::reloads() })?;
        Ok((runtime, hangup))
    });
    let (runtime, hangup) = match prepared {
        Ok(prepared) => prepared,
        Err(error) => {
            talk::fail(&format!("cannot start: {error}"));
            return Exit::Internal;
        }
    };
    let options = match options(args) {
        Ok(options) => options,
        Err(why) => {
            talk::fail(&why);
            return Exit::Usage;
        }
    };
    // Killed checks may still hold shared memory that this broker needs.
    qcbus_bus::sweep_private_instances();
    let exit = runtime.block_on(serve(options, hangup));
    runtime.shutdown_background();
    exit
}

async fn serve(options: Options, hangup: Hangup) -> Exit {
    let banner = banner(&options);
    let broker = match Broker::start(options, tell) {
        Ok(broker) => broker,
        Err(error) => {
            talk::fail(&explain(&error));
            return match error {
                StartError::Load(_)
                | StartError::Bus(BusError::AlreadyRunning { .. } | BusError::Instance(_))
                | StartError::Journal(
                    JournalError::State(LockError::Taken { .. }) | JournalError::Foreign(_),
                )
                | StartError::Results(LockError::Taken { .. } | LockError::Shared { .. })
                | StartError::Gate(GateError::Lock(_) | GateError::Foreign { .. }) => Exit::Usage,
                _ => Exit::Internal,
            };
        }
    };
    let signals = match super::stops::listen(hangup) {
        Ok(signals) => signals,
        Err(error) => {
            talk::fail(&error.to_string());
            return Exit::Internal;
        }
    };
    talk::say(&banner);
    broker.run(signals).await;
    talk::say("stopped");
    Exit::Accepted
}

fn explain(error: &StartError) -> String {
    match error {
        StartError::Bus(BusError::AlreadyRunning { .. }) => {
            format!(
                "{error}; use `qcbus status` to inspect it, `qcbus down` to stop it, or --instance NAME to start \
                 another one"
            )
        }
        _ => error.to_string(),
    }
}

fn banner(options: &Options) -> String {
    let directories: Vec<String> = options.roots.iter().map(|it| to_text(it)).collect();
    format!(
        "qcbus {} serves {} as instance `{}`, results in {}",
        env!("CARGO_PKG_VERSION"),
        directories.join(", "),
        options.instance.name(),
        to_text(&options.out)
    )
}

/// Writes log lines: one per verdict, each with the content hash.
fn tell(told: Told) {
    match told {
        Told::Verdict(it) if it.fresh => tracing::info!(
            verdict = it.judged.verdict.as_str(),
            sha256 = %it.judged.digest,
            errors = it.judged.counts[0],
            warnings = it.judged.counts[1],
            "{}",
            to_text(&it.path)
        ),
        Told::Verdict(_) => {}
        Told::Notice(notice) => tracing::warn!("{notice}"),
        Told::Scanned { files } => tracing::info!("{} files found", files.len()),
    }
}

/// Refuses a gate inside a watched directory, because its files would be checked. Refuses a watched
/// directory inside the gate, because published files could replace checked ones.
fn keep_apart(gate: &Path, roots: &[PathBuf]) -> Result<(), String> {
    let shown = to_text(gate);
    if let Some(root) = roots.iter().find(|root| gate.starts_with(root)) {
        return Err(format!(
            "the gate {shown} is inside the watched directory {}: published files would be checked and published \
             again; choose a directory outside it",
            to_text(root)
        ));
    }
    if let Some(root) = roots.iter().find(|root| root.starts_with(gate)) {
        return Err(format!(
            "the watched directory {} is inside the gate {shown}: published files might replace files that must \
             be checked; choose a separate directory for the gate",
            to_text(root)
        ));
    }
    Ok(())
}

/// Refuses a gate that shares its directory with another directory of the broker. The broker
/// removes every unpublished file from a gate.
fn of_its_own(gate: &Path, other: &Path, what: &str) -> Result<(), String> {
    if !gate.starts_with(other) && !other.starts_with(gate) {
        return Ok(());
    }
    Err(format!(
        "the gate {} and the {what} {} overlap: files that were not published are removed from a gate; choose a \
         separate directory for the gate",
        to_text(gate),
        to_text(other)
    ))
}

fn options(args: &ServeArgs) -> Result<Options, String> {
    let mut roots = BTreeSet::new();
    for directory in &args.directories {
        let real = std::fs::canonicalize(directory)
            .map_err(|error| format!("cannot watch {}: {error}", to_text(directory)))?;
        if !real.is_dir() {
            return Err(format!(
                "cannot watch {}: it is not a directory; use `qcbus check` for files",
                to_text(directory)
            ));
        }
        roots.insert(real);
    }
    let roots = outermost(roots);
    let gate = args.gate.as_deref().map(real);
    if let Some(gate) = &gate {
        keep_apart(gate, &roots)?;
    }
    let out = absolute(args.output.out.as_deref().unwrap_or(Path::new("qcbus-out")));
    let state = args
        .state
        .as_deref()
        .map_or_else(|| out.join(".qcbus"), absolute);
    let bundles_d = match &args.bundles_d {
        Some(named) => manifest_directory(named)?,
        None => state.join("bundles.d"),
    };
    if let Some(gate) = &gate {
        of_its_own(gate, &real(&out), "results directory")?;
        of_its_own(gate, &real(&state), "state directory")?;
    }
    let program = program();
    let every_kind = qcbus_document::FileKind::ALL.into_iter().collect();
    let mut children = if args.no_standard_bundles {
        Vec::new()
    } else {
        standard::bundle_specs(
            program,
            &every_kind,
            args.schema_dir.as_deref(),
            args.limits.threads,
        )?
    };
    let reporters = standard::reporter_specs(program);
    let asked = args.report.iter();
    children.extend(asked.map(|report| standard::reporter_spec(program, report)));
    Ok(Options {
        instance: instance(&args.instance)?,
        roots,
        files: Vec::new(),
        watch: true,
        poll: args.poll,
        rescan: args.rescan,
        settle: args.settle,
        here: None,
        single_result: None,
        bundles_d: Some(bundles_d),
        out,
        state: Some(state),
        retention: args.retention,
        choice: Default::default(),
        strict: args.strict,
        all: args.all,
        dialect: dialect(args.output.xqar_dialect),
        durable: true,
        verdict_files: true,
        gate,
        gate_outside: match args.gate_outside {
            OutsideArg::Name => Outside::Name,
            OutsideArg::Refuse => Outside::Refuse,
        },
        config: args.config.as_deref().map(absolute),
        standard: children,
        reporters,
        known: standard::known(),
        adapter: standard::adapter(program, !args.no_standard_bundles),
        die_with_broker: false,
        sandbox: !args.no_sandbox,
        memory_limit: memory_limit(&args.limits),
        limits: limits(&args.limits),
        host: HostOptions::default(),
        settings: qcbus_types::Settings {
            drain_limit: args.drain_limit,
            own_verdicts: args.own_verdict,
            ..settings(&args.limits)
        },
    })
}
