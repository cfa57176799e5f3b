//! Missing reports: finds the reporters that have not reported a verdict yet, for clients that wait for reports.

use std::collections::BTreeSet;

use qcbus_messages::Role;

use super::State;
use super::files::FileId;

impl State {
    /// Returns the reporters that have not confirmed their report of a file's newest result, each
    /// with the reason. A reporter counts if it is connected or if the broker keeps it running.
    pub(super) fn unreported(&self, id: FileId) -> Vec<String> {
        let judged = self.files.get(id).and_then(|entry| entry.judged.as_ref());
        // Without a result there is no report.
        let Some(job) = judged.filter(|it| it.is_written()).map(|it| it.job) else {
            return Vec::new();
        };
        let is_reporter = |role: Role| role == Role::Reporter;
        let kept = self.children.iter();
        let kept = kept.filter(|(_, child)| is_reporter(child.spec.role));
        let there = self.reporters.iter().filter(|it| it.session.is_some());
        let names: BTreeSet<&str> = kept
            .map(|(name, _)| name.as_str())
            .chain(there.map(|it| it.name.as_str()))
            .collect();
        let lacks = |name: &&str| {
            let index = self.reporters.iter().position(|it| it.name == **name);
            let index = index.and_then(|it| u32::try_from(it).ok());
            let entry = self.files.get(id).zip(index);
            !entry.is_some_and(|(entry, index)| entry.has(index, job))
        };
        let lacking = names.into_iter().filter(lacks);
        lacking.map(|name| self.why_unreported(name)).collect()
    }

    fn why_unreported(&self, name: &str) -> String {
        let reporter = self.reporter_named(name);
        let remark = reporter.map_or(String::new(), |it| it.remark(self.now));
        let failure = self.children.get(name).and_then(|it| it.failure.clone());
        let is_there = reporter.is_some_and(|it| it.session.is_some());
        match (is_there, remark.is_empty()) {
            (true, true) => format!("{name} has not answered yet"),
            (true, false) => format!("{name}: {remark}"),
            (false, _) => match failure.unwrap_or(remark) {
                why if why.is_empty() => format!("{name} is down"),
                why => format!("{name} is down: {why}"),
            },
        }
    }
}
