//! The three ways in which a bundle runs: on the bus, on one file, as a module of ASAM's framework.

mod args;
mod batches;
mod bus;
mod exit;
mod file;
mod module;
mod stand;
mod timings;
mod worker;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

pub use args::{USAGE, UsageError};
pub use bus::{BusOptions, OwnFiles};
pub use exit::Exit;
pub(crate) use file::complain;
pub use file::{Format, examine, examine_timed, findings};
pub use qcbus_bus::lasting_stderr;
pub use timings::Timings;

use crate::{Bundle, Permits, UserFiles};

/// How a bundle is to run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mode {
    /// As a peer on the bus, until the broker lets it go.
    Bus(BusOptions),
    /// Check one file and print what was found.
    File {
        /// The file.
        path: PathBuf,
        /// How findings are printed.
        format: Format,
        /// Whether what every checker took goes to stderr.
        timings: bool,
        /// Schemas of the user.
        schema_dir: Option<PathBuf>,
        /// Threads that check at the same time.
        threads: usize,
    },
    /// Read ASAM's configuration, check its `InputFile`, write the bundle's own `.xqar`.
    Module {
        /// The configuration.
        config: PathBuf,
        /// Schemas of the user.
        schema_dir: Option<PathBuf>,
        /// Threads that check at the same time.
        threads: usize,
    },
    /// Print the usage.
    Help,
}

impl Mode {
    /// Reads the arguments behind the program's (or the bundle's) name; see [`USAGE`].
    ///
    /// # Errors
    /// [`UsageError`] says what does not fit.
    pub fn parse(
        arguments: impl IntoIterator<Item = std::ffi::OsString>,
    ) -> Result<Mode, UsageError> {
        args::parse(arguments.into_iter())
    }

    /// The same with so many threads, whatever was asked for: where a bundle's rules cannot run side by side.
    #[must_use]
    pub fn with_threads(mut self, count: usize) -> Mode {
        match &mut self {
            Mode::Bus(options) => options.threads = count,
            Mode::File { threads, .. } | Mode::Module { threads, .. } => *threads = count,
            Mode::Help => {}
        }
        self
    }

    /// On the bus, what the bundle's program may read besides what every bundle may.
    #[must_use]
    pub fn reading(mut self, own: OwnFiles) -> Mode {
        if let Mode::Bus(options) = &mut self {
            options.own = own;
        }
        self
    }
}

/// Runs a bundle. What was found goes to stdout, everything else to stderr as log events.
pub fn run(bundle: &'static Bundle, mode: Mode) -> Exit {
    log_panics();
    match mode {
        Mode::Bus(options) => {
            let schema_dir = options.schema_dir.clone();
            with_files(bundle, schema_dir.as_deref(), |given| {
                bus::run(bundle, options, given)
            })
        }
        Mode::File {
            path,
            format,
            timings,
            schema_dir,
            threads,
        } => with_files(bundle, schema_dir.as_deref(), |given| {
            let permits = Permits::new(threads);
            file::run(bundle, &path, (format, timings), (&permits, given))
        }),
        Mode::Module {
            config,
            schema_dir,
            threads,
        } => with_files(bundle, schema_dir.as_deref(), |given| {
            module::run(bundle, &config, &Permits::new(threads), given)
        }),
        Mode::Help => {
            // Whoever asked for it sees that it is not there.
            let _ = file::print(USAGE);
            Exit::Accepted
        }
    }
}

/// Reads what the user brings before anything else: a schema that is of no use ends the run.
fn with_files(
    bundle: &Bundle,
    directory: Option<&Path>,
    run: impl FnOnce(Option<&UserFiles>) -> Exit,
) -> Exit {
    match directory
        .map(|directory| UserFiles::read(bundle, directory))
        .transpose()
    {
        Ok(given) => run(given.as_ref()),
        Err(error) => {
            complain(&format!("--schema-dir: failed to {error}\n"));
            Exit::Usage
        }
    }
}

/// The whole `main` of a program that is one bundle:
///
/// ```text
/// fn main() -> std::process::ExitCode {
///     qcbus_sdk::main(&BUNDLE)
/// }
/// ```
///
/// Log events go wherever the program has sent them with a `tracing` subscriber.
pub fn main(bundle: &'static Bundle) -> ExitCode {
    run_or_explain(bundle, Mode::parse(std::env::args_os().skip(1))).into()
}

/// Runs a bundle as its arguments say; says what is wrong with them when they say nothing.
pub fn run_or_explain(bundle: &'static Bundle, mode: Result<Mode, UsageError>) -> Exit {
    match mode {
        Ok(mode) => run(bundle, mode),
        Err(error) => {
            complain(&format!("{}: {error}\n\n{USAGE}", bundle.name));
            Exit::Usage
        }
    }
}

/// A panic is caught and becomes a checker's error; where it came from belongs into the log.
fn log_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic
            .location()
            .map(ToString::to_string)
            .unwrap_or_default();
        tracing::error!(place, "{panic}");
    }));
}
