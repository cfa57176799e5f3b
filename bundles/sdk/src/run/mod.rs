//! The three modes in which a bundle runs: on the bus, on one file, or as a module of ASAM's
//! framework.

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

/// Mode in which a bundle runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mode {
    /// As a peer on the bus, until the broker drains it.
    Bus(BusOptions),
    /// Checks one file and prints the findings.
    File {
        /// The file.
        path: PathBuf,
        /// Output format of findings.
        format: Format,
        /// Whether the time of every checker is printed to stderr.
        timings: bool,
        /// Directory of the user's schemas.
        schema_dir: Option<PathBuf>,
        /// Threads that check at the same time.
        threads: usize,
    },
    /// Reads ASAM's configuration, checks its `InputFile` and writes the bundle's own `.xqar`.
    Module {
        /// The configuration.
        config: PathBuf,
        /// Directory of the user's schemas.
        schema_dir: Option<PathBuf>,
        /// Threads that check at the same time.
        threads: usize,
    },
    /// Prints the usage.
    Help,
}

impl Mode {
    /// Parses the arguments after the name of the program (or of the bundle); see [`USAGE`].
    ///
    /// # Errors
    /// [`UsageError`] names the invalid argument.
    pub fn parse(
        arguments: impl IntoIterator<Item = std::ffi::OsString>,
    ) -> Result<Mode, UsageError> {
        args::parse(arguments.into_iter())
    }

    /// Returns the same mode with this number of threads, regardless of the arguments. It is for
    /// bundles with rules that cannot run in parallel.
    #[must_use]
    pub fn with_threads(mut self, count: usize) -> Mode {
        match &mut self {
            Mode::Bus(options) => options.threads = count,
            Mode::File { threads, .. } | Mode::Module { threads, .. } => *threads = count,
            Mode::Help => {}
        }
        self
    }

    /// Sets the files that the bundle's program may read on the bus, besides the files that every
    /// bundle may read.
    #[must_use]
    pub fn reading(mut self, own: OwnFiles) -> Mode {
        if let Mode::Bus(options) = &mut self {
            options.own = own;
        }
        self
    }
}

/// Runs a bundle. Findings go to stdout, everything else goes to stderr as log events.
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
            // The user sees that the output is missing.
            let _ = file::print(USAGE);
            Exit::Accepted
        }
    }
}

/// Reads the user's files before anything else. An unusable schema ends the run.
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

/// Runs the whole `main` of a program with a single bundle:
///
/// ```text
/// fn main() -> std::process::ExitCode {
///     qcbus_sdk::main(&BUNDLE)
/// }
/// ```
///
/// Log events go to the `tracing` subscriber of the program.
pub fn main(bundle: &'static Bundle) -> ExitCode {
    run_or_explain(bundle, Mode::parse(std::env::args_os().skip(1))).into()
}

/// Runs a bundle as its arguments demand. Prints an error if the arguments are invalid.
pub fn run_or_explain(bundle: &'static Bundle, mode: Result<Mode, UsageError>) -> Exit {
    match mode {
        Ok(mode) => run(bundle, mode),
        Err(error) => {
            complain(&format!("{}: {error}\n\n{USAGE}", bundle.name));
            Exit::Usage
        }
    }
}

/// Writes the location of a panic to the log. The panic itself is caught and becomes a checker's
/// error.
fn log_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic
            .location()
            .map(ToString::to_string)
            .unwrap_or_default();
        tracing::error!(place, "{panic}");
    }));
}
