//! Terminal output of a run while it is in progress.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_broker::Told;
use qcbus_document::Suffix;
use qcbus_formats::config::Config;
use qcbus_formats::pool::{CHOICE_CHECKER, OWN_BUNDLE};
use qcbus_formats::xqar::{Issue, Level};
use qcbus_messages::path_text::{relative, to_text};
use qcbus_messages::{Exit, ResultMessage, Verdict, shown};
use qcbus_publish::result_paths::ResultPaths;
use qcbus_report_text::{Folding, Options};
use qcbus_reporter_sdk::{FileSources, meaning};
use qcbus_types::{Delivery, Judged, Notice};

use super::outputs::{Outputs, Terminal};
use super::tally::Tally;
use crate::args::{CheckArgs, FailLevel, PrintArgs};
use crate::talk;

/// Maximum number of unchecked files that are named.
const NAMED: usize = 10;

/// Maximum number of findings of one rule that are shown for each of several files.
const SHOWN_OF_A_RULE: usize = 5;

/// An item to print or to remember for the end.
pub(super) enum News {
    /// A message of the broker.
    Told(Told),
    /// The reason for a wait.
    Waits(&'static str),
    /// A request to stop.
    Interrupted,
}

/// Printer of results in path order; each is printed as soon as all earlier ones are available.
pub(super) struct Printer {
    places: ResultPaths,
    /// Checked directories.
    roots: Vec<PathBuf>,
    config: Option<Arc<Config>>,
    /// Whether the command line selects or ignores checkers.
    has_choice: bool,
    /// Whether `--strict` selects the levels of ASAM.
    strict: bool,
    outputs: Outputs,
    args: PrintArgs,
    progress: talk::Progress,
    expected: Vec<Arc<Path>>,
    printed: usize,
    judged: BTreeMap<Arc<Path>, Arc<Judged>>,
    tally: Tally,
    /// Number of files with a result that could not be written.
    unwritten: usize,
    /// Number of files with a result that could not be read back for the reports.
    unreported: usize,
    /// Number of places that could not be read, so their content is unknown.
    unseen: usize,
    /// Whether a stop was requested.
    interrupted: bool,
    /// Whether all files to check are known.
    scanned: bool,
    notices: BTreeSet<String>,
}

impl Printer {
    pub(super) fn new(
        places: ResultPaths,
        roots: Vec<PathBuf>,
        config: Option<Arc<Config>>,
        outputs: Outputs,
        args: &CheckArgs,
    ) -> Printer {
        Printer {
            places,
            roots,
            config,
            has_choice: !args.select.is_empty() || !args.ignore.is_empty(),
            strict: args.strict,
            outputs,
            args: args.print.clone(),
            progress: talk::Progress::new(!args.print.quiet),
            expected: Vec::new(),
            printed: 0,
            judged: BTreeMap::new(),
            tally: Tally::default(),
            unwritten: 0,
            unreported: 0,
            unseen: 0,
            interrupted: false,
            scanned: false,
            notices: BTreeSet::new(),
        }
    }

    /// Handles an item of news and prints all results that are ready.
    pub(super) fn take(&mut self, news: News) {
        match news {
            News::Interrupted => self.interrupted = true,
            News::Waits(what) => self.note(what.to_owned()),
            News::Told(Told::Notice(notice)) => {
                self.unseen += usize::from(matches!(notice, Notice::Unseen(_)));
                self.note(notice.to_string());
            }
            News::Told(Told::Scanned { files }) => {
                let is_named = |it: &Arc<Path>| self.places.contains(it);
                self.expected = files.into_iter().filter(is_named).collect();
                self.scanned = true;
                self.say_empty();
                self.print_ready();
            }
            News::Told(Told::Verdict(verdict)) => {
                self.judged.insert(verdict.path, verdict.judged);
                self.print_ready();
            }
        }
    }

    /// Prints a note, but each text only once.
    fn note(&mut self, text: String) {
        if !self.notices.contains(&text) {
            self.progress.clear();
            talk::say(&format!("note: {text}"));
            self.notices.insert(text);
        }
    }

    /// Reports a named directory without files to check, because it may have been moved.
    fn say_empty(&mut self) {
        let is_empty = |root: &&PathBuf| !self.expected.iter().any(|it| it.starts_with(root));
        let empty: Vec<PathBuf> = self.roots.iter().filter(is_empty).cloned().collect();
        // If there are no files at all, a message at the end reports that.
        if !self.expected.is_empty() {
            for root in empty {
                let shown = to_text(relative(&root));
                self.note(format!("there is nothing to check in {shown}"));
            }
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
        let (done, total) = (self.printed + self.judged.len(), self.expected.len());
        if total > 0 {
            self.progress.show(&format!("{done}/{total} files"));
        }
    }

    fn print(&mut self, path: &Arc<Path>, judged: Arc<Judged>) {
        self.progress.clear();
        let shown = self.places.display(path);
        let is_written = judged.is_written();
        if !is_written {
            self.unwritten += 1;
            let why = judged.why.join("; ");
            talk::fail(&format!("{} has no result: {why}", to_text(&shown)));
        }
        if self.has_nothing_to_say(&judged) {
            self.tally.add_verdict(judged.verdict);
            return;
        }
        let verdict = judged.verdict;
        let delivery = Delivery {
            job: judged.job,
            path: path.clone(),
            judged,
        };
        let (places, config) = (&self.places, self.config.as_ref());
        let message = qcbus_publish::deliveries::message("stdout", &delivery, None, places, config);
        match message {
            Ok(mut message) => self.report(&mut message),
            Err(why) => {
                self.tally.add_verdict(verdict);
                self.unreported += 1;
                // A result that was not written has already been reported.
                if is_written {
                    talk::fail(&why);
                }
            }
        }
    }

    fn report(&mut self, message: &mut ResultMessage) {
        // The end of the run reports the choice once for all files.
        let choice = take_choice(message);
        self.tally.add(message);
        let sources = FileSources::new(message);
        let options = Options {
            width: talk::width(),
            color: talk::color(),
            skipped_names: if self.args.verbose { usize::MAX } else { 2 },
            failed_names: if self.args.verbose { usize::MAX } else { 10 },
            full_names: self.args.verbose,
            inapplicable: self.args.verbose,
            merges: !self.args.verbose && !self.args.quiet,
        };
        let text = match self.terminal() {
            Terminal::Reporter => String::new(),
            Terminal::Concise => qcbus_report_text::concise(message, options.color, Folding::None),
            Terminal::Fitting if !self.args.verbose => {
                let folding = match self.args.quiet {
                    true => Folding::None,
                    false => Folding::After(SHOWN_OF_A_RULE),
                };
                qcbus_report_text::concise(message, options.color, folding)
            }
            _ if self.args.verbose => qcbus_report_text::render(message, &options, &sources),
            _ => full(message, &options, &sources),
        };
        if !text.is_empty() {
            talk::print(&text);
        }
        choice.put_back(message);
        self.outputs.report(message, &sources);
    }

    /// Checks whether a result only adds to the number of accepted files. Most results do, and
    /// reading one back takes longer than checking a small file. With a configuration or a choice,
    /// the result lists the checkers that were left out. Reports need whole results.
    fn has_nothing_to_say(&self, judged: &Judged) -> bool {
        let is_clean = judged.is_accepted() && judged.counts == [0; 3];
        let is_whole = self.config.is_none() && !self.has_choice;
        let unread = !self.args.verbose && self.outputs.are_none();
        // A missing result file cannot be read back. The attempt to read it reports the error.
        let is_there = |xqar: &PathBuf| {
            let found = std::fs::symlink_metadata(xqar);
            found.is_ok_and(|it| it.is_file() && it.len() > 0)
        };
        is_clean && is_whole && unread && judged.xqar.as_ref().is_some_and(is_there)
    }

    /// Returns the content of stdout. A single file is printed in full.
    fn terminal(&self) -> Terminal {
        match self.outputs.terminal {
            Terminal::Fitting if self.expected.len() == 1 => Terminal::Full,
            terminal => terminal,
        }
    }

    /// Returns the results still to print. A scenario that is checked again after its map counts
    /// once. A file that was not named but is needed by others is included if it is not accepted.
    fn rest(&mut self) -> Vec<(Arc<Path>, Arc<Judged>)> {
        let printed: BTreeSet<&Arc<Path>> = self.expected.iter().take(self.printed).collect();
        let is_named = |path: &Arc<Path>| self.places.contains(path);
        let judged = std::mem::take(&mut self.judged).into_iter();
        let rest = judged.filter(|(path, judged)| {
            !printed.contains(path) && (is_named(path) || !judged.is_accepted())
        });
        rest.collect()
    }

    /// Returns the files without a verdict, except those that must still be printed.
    fn unjudged(&self, rest: &[(Arc<Path>, Arc<Judged>)]) -> Vec<Arc<Path>> {
        let left = self.expected.iter().skip(self.printed);
        let waiting = left.filter(|path| !rest.iter().any(|(it, _)| it == *path));
        waiting.cloned().collect()
    }

    /// Reports the files that were not checked.
    fn say_unjudged(&self, missing: &[Arc<Path>]) {
        let why = match self.interrupted {
            true => "stopped by a signal",
            false => "removed in the meantime",
        };
        if self.interrupted && !self.scanned {
            talk::fail(&format!(
                "{why} before the files to check were known: nothing was checked"
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

    /// Prints the remaining results and the summary after all news have arrived.
    pub(super) fn finish(mut self) -> Exit {
        self.progress.clear();
        let rest = self.rest();
        let missing = self.unjudged(&rest);
        for (path, judged) in rest {
            self.print(&path, judged);
        }
        self.say_unjudged(&missing);
        let interrupted = self.interrupted && (!self.scanned || !missing.is_empty());
        let reported = self.finish_reports(interrupted);
        if self.tally.total() == 0 {
            return self.nothing(interrupted);
        }
        self.say_summary();
        let exit = self.exit();
        if self.unwritten > 0 || self.unreported > 0 || !reported {
            Exit::Internal
        } else if exit == Exit::Accepted && (!missing.is_empty() || interrupted || self.unseen > 0)
        {
            Exit::Undetermined
        } else {
            exit
        }
    }

    /// Finishes the reports, or discards them after an incomplete run, because they would look
    /// complete. Returns whether the reports are as expected.
    fn finish_reports(&mut self, interrupted: bool) -> bool {
        if !interrupted && self.tally.total() > 0 {
            return self.outputs.finish();
        }
        let names = self.outputs.give_up();
        if !names.is_empty() {
            let names = names.join(", ");
            talk::fail(&format!(
                "not written, because not everything was checked: {names}"
            ));
        }
        true
    }

    /// Ends a run in which no file has a verdict.
    fn nothing(&self, interrupted: bool) -> Exit {
        if interrupted {
            return Exit::Undetermined;
        }
        if self.unseen > 0 {
            talk::fail("nothing was checked: paths that may contain files could not be accessed");
            return Exit::Undetermined;
        }
        talk::fail(&format!(
            "nothing to check: no file found that qcbus checks ({})",
            Suffix::list()
        ));
        Exit::Usage
    }

    fn say_summary(&self) {
        let mut lines = String::new();
        if self.args.statistics {
            lines.push_str(&self.tally.statistics());
        } else if !self.args.quiet {
            lines.push_str(&self.tally.first().unwrap_or_default());
        }
        if !self.args.quiet {
            for sentence in self.tally.not_looked() {
                lines.push_str(&format!("note: {sentence}\n"));
            }
            if let Some(why) = levels_of_asam(self.strict, self.config.as_deref()) {
                lines.push_str(&format!("note: levels of ASAM: {why}\n"));
            }
            let open = Verdict::Undetermined;
            if self.tally.count(open) > 0 {
                let files = shown::line(&self.tally.open_files()).into_owned();
                lines.push_str(&format!("note: {open}: {}: {files}\n", meaning(open)));
            }
            if self.terminal() == Terminal::Fitting && self.tally.count(Verdict::Rejected) > 0 {
                lines.push_str("note: `qcbus check FILE` shows the findings of one file in full\n");
            }
            lines.push_str(&self.last_line());
        }
        // Output for programs must not contain other text.
        if lines.is_empty() {
            return;
        }
        if self.terminal() == Terminal::Reporter {
            talk::say_lines(lines.trim_end());
        } else {
            talk::print(&lines);
        }
    }

    fn last_line(&self) -> String {
        let mut line = self.tally.line();
        if self.unseen > 0 {
            line.push_str(&format!(", {} not scanned", self.unseen));
        }
        let failing = self.failing();
        if failing > 0 {
            line.push_str(&format!(
                ", {failing} accepted but with findings of the level of --fail-level or worse"
            ));
        }
        let out = relative(&self.places.out);
        line.push_str(&format!("; results in {}", shown::line(&to_text(out))));
        for file in self.outputs.files() {
            let file = relative(Path::new(file));
            line.push_str(&format!(", report in {}", shown::line(&to_text(file))));
        }
        line.push('\n');
        line
    }

    /// Returns the number of accepted files that must fail because of `--fail-level`.
    fn failing(&self) -> usize {
        let level = match self.args.fail_level {
            FailLevel::Error => return 0,
            FailLevel::Warning => Level::Warning,
            FailLevel::Information => Level::Information,
        };
        let errors = self.tally.files_from(Level::Error);
        self.tally.files_from(level).saturating_sub(errors)
    }

    fn exit(&self) -> Exit {
        let verdict = match Exit::of_verdicts(self.tally.verdicts()) {
            Exit::Accepted | Exit::Undetermined if self.failing() > 0 => Exit::Rejected,
            exit => exit,
        };
        match verdict {
            Exit::Rejected if !self.args.exit_zero => Exit::Rejected,
            // A check that was not possible is not a finding.
            Exit::Rejected if self.tally.count(Verdict::Undetermined) > 0 => Exit::Undetermined,
            Exit::Rejected => Exit::Accepted,
            exit => exit,
        }
    }
}

/// Issues that only list the checkers left out by the command line, removed from a result.
struct LeftOut(Option<(usize, Vec<Issue>)>);

fn take_choice(message: &mut ResultMessage) -> LeftOut {
    let mut bundles = message.results.bundles.iter_mut().enumerate();
    let own = bundles.find(|(_, bundle)| bundle.name == OWN_BUNDLE);
    let checkers = own.map(|(at, bundle)| (at, &mut bundle.checkers));
    LeftOut(checkers.and_then(|(at, checkers)| {
        let it = checkers.iter_mut().find(|it| *it.id == *CHOICE_CHECKER)?;
        Some((at, std::mem::take(&mut it.issues)))
    }))
}

impl LeftOut {
    fn put_back(self, message: &mut ResultMessage) {
        let Some((at, issues)) = self.0 else { return };
        let bundle = message.results.bundles.get_mut(at);
        let mut checkers = bundle.into_iter().flat_map(|bundle| &mut bundle.checkers);
        if let Some(it) = checkers.find(|it| *it.id == *CHOICE_CHECKER) {
            it.issues = issues;
        }
    }
}

/// Returns the reason why findings have the levels of ASAM, if they do.
fn levels_of_asam(strict: bool, config: Option<&Config>) -> Option<&'static str> {
    if strict {
        return Some("`--strict`");
    }
    let config = config?;
    if config.is_of_asam() {
        let why = "the configuration has no parameter of qcbus; `qcbus.levels` with the value `readers` selects the \
                   levels of readers";
        return Some(why);
    }
    let selects = config.selects_levels_of_asam();
    selects.then_some("where `qcbus.levels` in the configuration is `asam`")
}

/// Returns the findings of one file in full. If the verdict is undetermined, the reasons follow.
fn full(message: &ResultMessage, options: &Options, sources: &FileSources) -> String {
    let mut text = qcbus_report_text::findings(message, options, sources);
    let blocked = message.verdict == Verdict::Undetermined;
    text.push_str(&qcbus_report_text::not_looked(message, options, blocked));
    text
}
