//! A run of `check` that asks a running broker, because starting a new one takes longer than most
//! checks.
//!
//! The run checks the files itself if that broker could find something else. Examples are a broker
//! of another program, with another configuration or other limits. Others are a broker that cannot
//! read the same files or is about to end.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use qcbus_broker::{Announcement, Options, Told, check_context};
use qcbus_configuration::InForce;
use qcbus_control::Line;
use qcbus_document::FileKind;
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::control::{CheckContext, Checked, Referenced, Request, Response};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Digest, Exit, Verdict};
use qcbus_publish::store::GivenResults;
use qcbus_types::Notice;

use super::printer::{News, Printer};
use super::run::Run;
use super::{Prepared, places};
use crate::args::{CheckArgs, DEFAULT_INSTANCE};
use crate::commands::settings::instance;
use crate::{standard, talk};

/// Maximum number of files to ask for. With more files, starting a new broker is a small part of
/// the work.
const MOST_FILES: usize = 64;

/// Maximum number of concurrent requests.
const AT_ONCE: usize = 4;

/// Asks the broker of the instance for all files. Returns the prepared run if the files must be
/// checked here.
pub(super) fn check(
    args: &CheckArgs,
    prepared: Prepared,
    run: &mut Run,
) -> Result<Exit, Box<Prepared>> {
    match ask(args, &prepared.options, run) {
        Ok((given, told)) => Ok(print(args, prepared, given, told)),
        Err(Elsewhere::Here(why)) => {
            if args.print.verbose && !why.is_empty() {
                talk::say(&format!("note: checked without the running broker: {why}"));
            }
            Err(Box::new(prepared))
        }
        Err(Elsewhere::Refused(why)) => {
            talk::fail(&why);
            Ok(Exit::Usage)
        }
        Err(Elsewhere::Interrupted) => Ok(interrupted(args, prepared)),
    }
}

/// Reasons why no broker checks the files.
enum Elsewhere {
    /// The files must be checked here. The text is the reason for the user; it is empty if there is
    /// nothing to report.
    Here(String),
    /// The files cannot be checked at all.
    Refused(String),
    /// A signal stopped the run.
    Interrupted,
}

/// A file and its check context.
type Question = (PathBuf, CheckContext);

/// All answers of a broker.
struct Given {
    /// Process id of the broker that answered.
    by: u32,
    results: GivenResults,
    files: Vec<(PathBuf, Checked)>,
}

fn ask(
    args: &CheckArgs,
    options: &Options,
    run: &mut Run,
) -> Result<(Given, Vec<String>), Elsewhere> {
    let here = |why: &str| Elsewhere::Here(why.to_owned());
    if args.cold || !may_ask(args, options) {
        return Err(here(""));
    }
    // A check does not need an instance. A user who names one explicitly must learn that it is
    // unusable.
    let unusable = match args.instance.instance.as_str() {
        DEFAULT_INSTANCE => Elsewhere::Here,
        _ => Elsewhere::Refused,
    };
    let directory = instance(&args.instance).map_err(unusable)?;
    let mut line = Line::to(directory.dir()).ok_or_else(|| here(""))?;
    let like_us = line.process().filter(|_| line.is_like_us());
    let by = like_us.ok_or_else(|| {
        here("it is a different program, has different permissions or does not see the same files")
    })?;
    let in_force = InForce::new(None, SearchPath::of_environment());
    let config = in_force.map_err(|error| here(&error.to_string()))?.digest;
    // The results directory is opened before any check: existing results there belong to other file
    // contents.
    let opened = GivenResults::open(places(options), config);
    let (results, left) = opened.map_err(|error| Elsewhere::Refused(error.to_string()))?;
    let asking = Asking {
        options: options.clone(),
        config,
        own_verdicts: args.own_verdict,
        directory: directory.dir().to_path_buf(),
    };
    let answered = run.unless_stopped(move || asking.ask_for_everything(&mut line));
    let answered = answered.ok_or(Elsewhere::Interrupted)?;
    let files = answered.map_err(Elsewhere::Here)?;
    Ok((Given { by, results, files }, left))
}

/// The request and the directory of the broker that receives it.
struct Asking {
    options: Options,
    config: Digest,
    own_verdicts: bool,
    directory: PathBuf,
}

impl Asking {
    /// Asks for all files and for the files that they refer to. The broker gives each file its own
    /// verdict only. A verdict that depends on other files must therefore be made here. That is
    /// necessary only if one of those files is not accepted.
    fn ask_for_everything(&self, line: &mut Line) -> Result<Vec<(PathBuf, Checked)>, String> {
        let mut files = self.ask_for_files(line, self.options.files.clone())?;
        let mut begin = 0;
        while !self.own_verdicts && begin < files.len() {
            let new = files.get(begin..).unwrap_or_default();
            let referenced = new.iter().flat_map(|it| it.1.rests_on.clone());
            let referenced: Vec<Referenced> = referenced.collect();
            begin = files.len();
            let unknown = |it: &&Referenced| files.iter().all(|(file, _)| *file != it.file);
            let unknown = referenced.iter().filter(unknown).map(|it| it.file.clone());
            let unknown: BTreeSet<PathBuf> = unknown.collect();
            files.extend(self.ask_for_files(line, unknown.into_iter().collect())?);
            let is_accepted = |it: &Referenced| {
                let mut answers = files.iter().filter(|(file, _)| *file == it.file);
                answers.all(|(_, checked)| {
                    let verdict = &checked.verdict;
                    verdict.verdict == Verdict::Accepted && verdict.digest == it.digest
                })
            };
            if let Some(it) = referenced.iter().find(|it| !is_accepted(it)) {
                return Err(format!("{} is not accepted", to_text(&it.file)));
            }
        }
        Ok(files)
    }

    fn ask_for_files(
        &self,
        line: &mut Line,
        files: Vec<PathBuf>,
    ) -> Result<Vec<(PathBuf, Checked)>, String> {
        let question = |file: &PathBuf| {
            let check_context = context_of(&self.options, self.config, file);
            (file.clone(), check_context)
        };
        let questions: Vec<Question> = files.iter().map(question).collect();
        let answers = match questions.as_slice() {
            [] => Vec::new(),
            [one] => vec![ask_for(line, one)?],
            all => ask_for_all(&self.directory, all)?,
        };
        Ok(files.into_iter().zip(answers).collect())
    }
}

/// Checks whether any broker would find the same. A broker does not know a configuration or bundles
/// named here. It read its schemas at its start, and they may have changed since.
fn may_ask(args: &CheckArgs, options: &Options) -> bool {
    options.roots.is_empty()
        && options.files.len() <= MOST_FILES
        && options.config.is_none()
        && options.bundles_d.is_none()
        && args.schema_dir.is_none()
        && options.choice.is_everything()
        && !options.strict
        && !options.all
}

/// Returns the check context of a file for a check in this process.
fn context_of(options: &Options, config: Digest, file: &Path) -> CheckContext {
    let kind = FileKind::of_path(file);
    let takes = |name: &str| {
        let bundle = standard::bundle(name);
        bundle.is_some_and(|it| kind.is_some_and(|kind| it.kinds.contains(&kind)))
    };
    let bundles = options.standard.iter().filter(|spec| takes(&spec.name));
    let bundles: Vec<_> = bundles.cloned().collect();
    check_context(options, config, &bundles)
}

/// Asks for one file. Returns an error with the reason if the file must be checked here.
fn ask_for(line: &mut Line, (file, check_context): &Question) -> Result<Checked, String> {
    let request = Request::Check {
        file: file.clone(),
        check_context: check_context.clone(),
    };
    match line.ask(&request) {
        Ok(Response::Checked(checked)) => Ok(*checked),
        Ok(Response::Elsewhere { reason } | Response::Failed { reason }) => Err(reason),
        Ok(_) => Err("it sent an unexpected answer".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Asks for several files, a few at a time.
fn ask_for_all(directory: &Path, questions: &[Question]) -> Result<Vec<Checked>, String> {
    let (next, over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let answers: Mutex<Vec<Option<Checked>>> = Mutex::new(vec![None; questions.len()]);
    let some = || -> Result<(), String> {
        let mut line = Line::to(directory).ok_or("it has ended")?;
        if !line.is_like_us() {
            return Err("another broker has replaced it".to_owned());
        }
        while !over.load(Ordering::Relaxed) {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(question) = questions.get(at) else {
                break;
            };
            let checked = ask_for(&mut line, question)?;
            let mut answers = answers.lock().map_err(|error| error.to_string())?;
            if let Some(place) = answers.get_mut(at) {
                *place = Some(checked);
            }
        }
        Ok(())
    };
    let one = || some().inspect_err(|_| over.store(true, Ordering::Relaxed));
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..AT_ONCE.min(questions.len()))
            .map(|_| scope.spawn(one))
            .collect();
        let panicked = |_| "a thread panicked".to_owned();
        let ended = threads.into_iter().map(|it| it.join().map_err(panicked)?);
        ended.collect::<Result<(), String>>()
    })?;
    let answers = answers.into_inner().map_err(|error| error.to_string())?;
    let all: Option<Vec<Checked>> = answers.into_iter().collect();
    all.ok_or_else(|| "it did not answer all requests".to_owned())
}

/// Prints the same output as a run in this process.
fn print(args: &CheckArgs, prepared: Prepared, given: Given, left: Vec<String>) -> Exit {
    if args.print.verbose {
        let by = given.by;
        talk::say(&format!(
            "note: checked by the running broker (process {by})"
        ));
    }
    let mut printer = printer(args, prepared);
    for what in left {
        printer.take(News::Told(Told::Notice(Notice::Storing(what))));
    }
    for (file, checked) in given.files {
        let judged = given.results.keep(&file, checked);
        printer.take(News::Told(Told::Verdict(Announcement {
            path: file.into(),
            judged,
            fresh: true,
        })));
    }
    printer.finish()
}

/// Prints the files that were not checked.
fn interrupted(args: &CheckArgs, prepared: Prepared) -> Exit {
    let mut printer = printer(args, prepared);
    printer.take(News::Interrupted);
    printer.finish()
}

/// Creates a printer that knows the files to be checked and no results yet.
fn printer(args: &CheckArgs, prepared: Prepared) -> Printer {
    let options = &prepared.options;
    let (places, outputs) = (places(options), prepared.outputs);
    let files = options.files.iter().map(|file| file.as_path().into());
    let files = files.collect();
    let mut printer = Printer::new(places, Vec::new(), prepared.config, outputs, args);
    printer.take(News::Told(Told::Scanned { files }));
    printer
}
