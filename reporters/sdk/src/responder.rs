//! Answers of a reporter to the broker, independent of the bus.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};

use qcbus_messages::{FromPeer, JobId, PeerReport, ResultMessage, ToPeer, Withdrawn};

use crate::{Reporter, Sources};

/// Number of results that are remembered as written. No broker has more of them in progress.
const REMEMBERED: usize = 4096;

/// A reporter's side of the protocol with a broker: takes messages and returns answers.
pub struct Responder<'r> {
    reporter: &'r mut dyn Reporter,
    written: VecDeque<(JobId, String)>,
    left: bool,
}

impl<'r> Responder<'r> {
    /// Creates a responder that has not received any message.
    pub fn new(reporter: &'r mut dyn Reporter) -> Responder<'r> {
        Responder {
            reporter,
            written: VecDeque::new(),
            left: false,
        }
    }

    /// Returns the answers to `message`. `sources` gives the lines of a result's files and is
    /// called only when the result is written.
    pub fn handle<'s>(
        &mut self,
        message: ToPeer,
        sources: impl FnOnce(&ResultMessage) -> Box<dyn Sources + 's>,
    ) -> Vec<FromPeer> {
        match message {
            ToPeer::Result(result) => vec![FromPeer::ResultDone {
                job: result.job,
                report: self.write(&result, sources),
            }],
            ToPeer::Withdrawn(gone) => {
                let report = self.withdraw(&gone);
                let input = gone.input;
                vec![FromPeer::WithdrawalDone { input, report }]
            }
            ToPeer::Drain => {
                self.finish();
                vec![FromPeer::Leaving]
            }
            // The bus answers the first two messages, and jobs are for bundles.
            ToPeer::Welcome { .. }
            | ToPeer::Refused { .. }
            | ToPeer::Job(_)
            | ToPeer::Cancel { .. } => Vec::new(),
        }
    }

    /// Checks whether the reporter has announced that it leaves.
    pub fn has_left(&self) -> bool {
        self.left
    }

    /// Resets the state for a new broker. Its job numbers are unrelated to those of the old one.
    pub fn rejoined(&mut self) {
        self.written.clear();
    }

    /// Finishes the reporter after the last result, and logs a failure.
    pub fn finish(&mut self) {
        if self.left {
            return;
        }
        self.left = true;
        if let Err(error) = self.reporter.finish() {
            tracing::error!("failed to {error}");
        }
    }

    fn write<'s>(
        &mut self,
        result: &ResultMessage,
        sources: impl FnOnce(&ResultMessage) -> Box<dyn Sources + 's>,
    ) -> PeerReport {
        let key = (result.job, result.input.clone());
        if self.written.contains(&key) {
            return PeerReport::Written;
        }
        let sources = sources(result);
        let report = AssertUnwindSafe(|| self.reporter.report(result, sources.as_ref()));
        // A result that makes a reporter panic must not be sent again after each restart.
        match catch_unwind(report) {
            Ok(Ok(())) => {
                self.remember(key);
                PeerReport::Written
            }
            Ok(Err(error)) => PeerReport::Failed(format!("failed to {error}")),
            Err(_) => PeerReport::Failed("the reporter panicked on this result".into()),
        }
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> PeerReport {
        self.written.retain(|(_, input)| *input != gone.input);
        let withdraw = AssertUnwindSafe(|| self.reporter.withdraw(gone));
        match catch_unwind(withdraw) {
            Ok(Ok(())) => PeerReport::Written,
            Ok(Err(error)) => PeerReport::Failed(format!("failed to {error}")),
            Err(_) => PeerReport::Failed("the reporter panicked on this withdrawal".into()),
        }
    }

    fn remember(&mut self, key: (JobId, String)) {
        if self.written.len() == REMEMBERED {
            self.written.pop_front();
        }
        self.written.push_back(key);
    }
}

/// Results for the tests of this crate.
#[cfg(test)]
pub(crate) mod samples {
    use std::collections::BTreeMap;

    use qcbus_formats::xqar::Results;
    use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};

    /// Returns an accepted result without checkers.
    pub(crate) fn result(job: u64, display_path: &str) -> ResultMessage {
        ResultMessage {
            job: JobId(job),
            input: format!("/in/{display_path}"),
            display_path: display_path.into(),
            xqar: format!("/out/{display_path}.xqar"),
            verdict: Verdict::Accepted,
            digest: Digest::default(),
            config: Digest::default(),
            document: None,
            results: Results::default(),
            rules: BTreeMap::new(),
            params: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::samples::result;
    use super::*;
    use crate::{NoSources, ReportError};

    #[derive(Default)]
    struct Notebook {
        written: Vec<String>,
        finished: usize,
    }

    impl Reporter for Notebook {
        fn report(&mut self, result: &ResultMessage, _: &dyn Sources) -> Result<(), ReportError> {
            assert!(result.display_path != "panics.xodr", "asked to");
            if result.display_path == "fails.xodr" {
                return Err(ReportError::Form("it is full".into()));
            }
            self.written.push(result.display_path.clone());
            Ok(())
        }

        fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
            self.written.retain(|path| *path != gone.display_path);
            Ok(())
        }

        fn finish(&mut self) -> Result<(), ReportError> {
            self.finished += 1;
            Ok(())
        }
    }

    fn tell(responder: &mut Responder<'_>, job: u64, path: &str) -> PeerReport {
        let message = ToPeer::Result(Box::new(result(job, path)));
        match responder
            .handle(message, |_| Box::new(NoSources))
            .as_slice()
        {
            [FromPeer::ResultDone { job: done, report }] if *done == JobId(job) => report.clone(),
            other => panic!("unexpected answer {other:?}"),
        }
    }

    #[test]
    fn repeated_result_is_acknowledged_but_not_written_again() {
        let mut notebook = Notebook::default();
        let mut responder = Responder::new(&mut notebook);
        assert_eq!(tell(&mut responder, 1, "a.xodr"), PeerReport::Written);
        assert_eq!(tell(&mut responder, 1, "a.xodr"), PeerReport::Written);
        assert_eq!(tell(&mut responder, 2, "a.xodr"), PeerReport::Written);
        responder.rejoined();
        assert_eq!(tell(&mut responder, 1, "a.xodr"), PeerReport::Written);
        assert_eq!(notebook.written, ["a.xodr", "a.xodr", "a.xodr"]);
    }

    #[test]
    fn write_failure_is_reported_with_reason() {
        let mut notebook = Notebook::default();
        let mut responder = Responder::new(&mut notebook);
        let PeerReport::Failed(why) = tell(&mut responder, 1, "fails.xodr") else {
            panic!("the write must fail");
        };
        assert_eq!(
            why,
            "failed to convert the result to the format of the report: it is full"
        );
    }

    #[test]
    fn panic_fails_only_its_own_result() {
        let mut notebook = Notebook::default();
        let mut responder = Responder::new(&mut notebook);
        let report = tell(&mut responder, 1, "panics.xodr");
        assert!(matches!(report, PeerReport::Failed(_)), "{report:?}");
        assert_eq!(tell(&mut responder, 2, "b.xodr"), PeerReport::Written);
    }

    #[test]
    fn removed_file_has_its_report_removed() {
        let mut notebook = Notebook::default();
        let mut responder = Responder::new(&mut notebook);
        tell(&mut responder, 1, "a.xodr");
        tell(&mut responder, 2, "b.xodr");
        let gone = Withdrawn {
            input: "/in/a.xodr".into(),
            display_path: "a.xodr".into(),
            xqar: "/out/a.xodr.xqar".into(),
            params: Vec::new(),
        };
        let answer = responder.handle(ToPeer::Withdrawn(gone), |_| Box::new(NoSources));
        let done = FromPeer::WithdrawalDone {
            input: "/in/a.xodr".into(),
            report: PeerReport::Written,
        };
        assert_eq!(answer, [done]);
        // The file exists again, unchanged, so the same job is written again.
        tell(&mut responder, 1, "a.xodr");
        assert_eq!(notebook.written, ["b.xodr", "a.xodr"]);
    }

    #[test]
    fn drain_finishes_once_and_leaves() {
        let mut notebook = Notebook::default();
        let mut responder = Responder::new(&mut notebook);
        let answer = responder.handle(ToPeer::Drain, |_| Box::new(NoSources));
        assert_eq!(answer, [FromPeer::Leaving]);
        assert!(responder.has_left());
        responder.finish();
        assert_eq!(notebook.finished, 1);
    }
}
