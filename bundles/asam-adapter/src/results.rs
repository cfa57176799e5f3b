//! Reading of a module's result: maps all paths in it back to the files that were checked.

use std::path::Path;

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{
    self, Checker, CheckerBundle, DomainInfo, InfoElement, Issue, Metadata, Results, Status,
};

use crate::messages::Ran;

/// Result of a module for one file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Report {
    /// Version of the module's bundle.
    pub version: String,
    /// Description of the module's bundle.
    pub description: String,
    /// Results of the checkers, one for each checker id.
    pub checkers: Vec<Told>,
}

/// Result of one checker.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Told {
    pub id: String,
    pub description: String,
    pub uids: Vec<String>,
    pub issues: Vec<Issue>,
    pub ending: Ending,
    pub metadata: Vec<Metadata>,
}

/// Reads the result of a run.
///
/// # Errors
/// The reason why the result is rejected, as text for the user.
pub(crate) fn read(name: &str, ran: &Ran, result: &[u8]) -> Result<Report, String> {
    let paths = Paths::of(ran);
    let fails = |what: &str| Err(paths.sentence(name, what, &ran.said));
    if let Some(fault) = &ran.fault {
        return fails(fault);
    }
    if ran.application.is_none() {
        return fails(
            "ended with exit code 0, but left no result at the path in its configuration",
        );
    }
    let results = match xqar::read(result) {
        Ok(results) => results,
        Err(error) => return fails(&format!("left a result that cannot be read: {error}")),
    };
    if let Some(other) = about_another(&results, ran) {
        return fails(&format!("left a result about another file, {other}"));
    }
    let Some(first) = results.bundles.first() else {
        return fails("left a result without a bundle");
    };
    let mut report = Report {
        version: first.version.clone(),
        description: first.description.clone(),
        checkers: Vec::new(),
    };
    for checker in results.bundles.into_iter().flat_map(|it| it.checkers) {
        report.add(told(checker, &paths));
    }
    block(&mut report.checkers);
    Ok(report)
}

/// Returns the input file that a result names, if it differs from the input file of the run.
fn about_another(results: &Results, ran: &Ran) -> Option<String> {
    let named = |bundle: &CheckerBundle| {
        let mut params = bundle.params.iter();
        let input = params.find(|it| it.name == qcbus_formats::config::INPUT_PARAMS[0])?;
        let is_it = Path::new(&ran.room).join("work").join(&input.value) == Path::new(&ran.input);
        (!is_it).then(|| input.value.clone())
    };
    results.bundles.iter().find_map(named)
}

impl Report {
    /// Adds the result of a checker. Ids are unique: several results of one checker are merged, and
    /// no issue is dropped.
    fn add(&mut self, told: Told) {
        let Some(known) = self.checkers.iter_mut().find(|it| it.id == told.id) else {
            self.checkers.push(told);
            return;
        };
        known.issues.extend(told.issues);
        known.uids.extend(told.uids);
        if known.ending == Ending::Completed {
            known.ending = told.ending;
        }
    }
}

/// Text in the summary of a checker that was skipped because of other checkers' issues. All modules
/// built like ASAM's use it. Such a checker has not checked the file.
const PRECONDITIONS: &str = "precondition";

fn told(checker: Checker, paths: &Paths) -> Told {
    let summary = paths.lead_back(&checker.summary);
    let reason = |otherwise: &str| match summary.trim() {
        "" => otherwise.to_owned(),
        summary => summary.to_owned(),
    };
    let ending = match checker.status {
        Some(Status::Completed) => Ending::Completed,
        Some(Status::Skipped) if summary.to_lowercase().contains(PRECONDITIONS) => {
            Ending::Blocked {
                by: Vec::new(),
                reason: reason(""),
            }
        }
        Some(Status::Skipped) => Ending::NotApplicable {
            reason: reason("the module skipped it"),
        },
        Some(Status::Error) => Ending::Failed {
            reason: reason("the module reports that it failed"),
        },
        None => Ending::Failed {
            reason: "the module does not report how it ended".to_owned(),
        },
    };
    let mut issues = checker.issues;
    issues.iter_mut().for_each(|issue| paths.issue(issue));
    Told {
        id: checker.id.to_string(),
        description: checker.description.to_string(),
        uids: checker
            .addressed_rules
            .iter()
            .map(ToString::to_string)
            .collect(),
        issues,
        ending,
        metadata: checker.metadata,
    }
}

/// Names the checkers that blocked others whose preconditions do not hold. A result does not name
/// them.
fn block(checkers: &mut [Told]) {
    let in_the_way = |it: &&Told| match it.ending {
        Ending::Completed => !it.issues.is_empty(),
        Ending::Failed { .. } => true,
        _ => false,
    };
    let stops = checkers.iter().filter(in_the_way);
    let stops: Vec<String> = stops.map(|it| it.id.clone()).collect();
    for checker in checkers {
        if let Ending::Blocked { by, .. } = &mut checker.ending {
            by.clone_from(&stops);
        }
    }
}

/// Mapping of paths in the private directory to the original paths.
pub(crate) struct Paths {
    /// Pairs of a private path and its replacement. Longer paths come first.
    pairs: Vec<(String, String)>,
}

impl Paths {
    pub fn of(ran: &Ran) -> Paths {
        let real = match ran.real.as_str() {
            "/" => "",
            real => real,
        };
        let pair = |from: String, to: &str| (from, to.to_owned());
        let packed = ran.packed.as_ref();
        let packed = packed.map(|packed| pair(ran.input.clone(), packed));
        let pairs = [
            pair(format!("{}/", ran.staged), &format!("{real}/")),
            pair(ran.staged.clone(), &ran.real),
            pair(format!("{}/work/", ran.room), ""),
            pair(ran.room.clone(), "(its private directory)"),
        ];
        Paths {
            // An answer without paths has empty entries here. They must not replace anything.
            pairs: packed
                .into_iter()
                .chain(pairs)
                .filter(|(from, _)| from.len() > 6)
                .collect(),
        }
    }

    fn lead_back(&self, text: &str) -> String {
        let pairs = self.pairs.iter();
        pairs.fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
    }

    fn in_place(&self, text: &mut String) {
        *text = self.lead_back(text);
    }

    fn issue(&self, issue: &mut Issue) {
        self.in_place(&mut issue.description);
        for locations in &mut issue.locations {
            self.in_place(&mut locations.description);
            if let Some(elsewhere) = &mut locations.elsewhere {
                self.in_place(&mut elsewhere.path);
            }
        }
        let infos = issue.domain_info.iter_mut();
        infos
            .flat_map(|it: &mut DomainInfo| &mut it.content)
            .for_each(|it| self.element(it));
    }

    fn element(&self, element: &mut InfoElement) {
        self.in_place(&mut element.text);
        for (_, value) in &mut element.attributes {
            self.in_place(value);
        }
        // The XML reader limits the depth of this recursion.
        element.children.iter_mut().for_each(|it| self.element(it));
    }

    /// Returns a sentence about the module, followed by its final output.
    pub fn sentence(&self, name: &str, what: &str, said: &str) -> String {
        let what = self.lead_back(what);
        match said.trim() {
            "" => format!("the module `{name}` {what}; it printed nothing"),
            said => format!(
                "the module `{name}` {what}; its last output:\n{}",
                self.lead_back(said)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ran() -> Ran {
        Ran {
            application: Some("b".to_owned()),
            input: "/scratch/1/input/maps/a.xodr".to_owned(),
            staged: "/scratch/1/input".to_owned(),
            real: "/data".to_owned(),
            room: "/scratch/1".to_owned(),
            ..Ran::default()
        }
    }

    fn result(params: &str, checkers: &str) -> String {
        format!(
            "<CheckerResults version=\"1\"><CheckerBundle name=\"b\" version=\"2\" build_date=\"\" \
             description=\"d\" summary=\"\">{params}{checkers}</CheckerBundle></CheckerResults>"
        )
    }

    fn read_text(text: &str) -> Result<Report, String> {
        read("b", &ran(), text.as_bytes())
    }

    #[test]
    fn scratch_paths_in_result_are_mapped_to_real_paths() {
        let text = result(
            "<Param name=\"InputFile\" value=\"/scratch/1/input/maps/a.xodr\"/>",
            "<Checker checkerId=\"c\" status=\"completed\" description=\"\" summary=\"\">\
             <Issue issueId=\"0\" level=\"2\" ruleUID=\"a.b:c:1.0.0:d\" \
             description=\"see /scratch/1/input/maps/a.xodr and /scratch/1/work/x.log\">\
             <Locations description=\"in /scratch/1/input\"><XMLLocation xpath=\"/a\"/></Locations>\
             </Issue></Checker>",
        );
        let report = read_text(&text).unwrap();
        let issue = &report.checkers[0].issues[0];
        assert_eq!(issue.description, "see /data/maps/a.xodr and x.log");
        assert_eq!(issue.locations[0].description, "in /data");
        assert_eq!(report.checkers[0].ending, Ending::Completed);
    }

    #[test]
    fn unusable_module_result_is_error_with_reason() {
        let failing = |ran: &Ran, text: &str| read("b", ran, text.as_bytes()).unwrap_err();
        let whole = result("", "");
        let none = Ran {
            application: None,
            said: "Traceback\nin /scratch/1/input/maps/a.xodr".to_owned(),
            ..ran()
        };
        let said = failing(&none, "");
        assert!(
            said.contains("no result") && said.contains("/data/maps/a.xodr"),
            "{said}"
        );
        assert!(failing(&ran(), &whole[..whole.len() / 2]).contains("cannot be read"));
        assert!(failing(&ran(), "").contains("cannot be read"));
        let empty = "<CheckerResults version=\"1\"/>";
        assert!(failing(&ran(), empty).contains("without a bundle"));
        let other = result(
            "<Param name=\"InputFile\" value=\"/scratch/1/input/maps/b.xodr\"/>",
            "",
        );
        assert!(failing(&ran(), &other).contains("another file"));
        let killed = Ran {
            fault: Some("was killed by signal 9".to_owned()),
            ..ran()
        };
        assert!(failing(&killed, &whole).contains("signal 9"));
    }

    #[test]
    fn precondition_skip_is_blocked_and_version_skip_inapplicable() {
        let checker = |id: &str, status: &str, summary: &str, issue: &str| {
            format!(
                "<Checker checkerId=\"{id}\" {status} description=\"\" summary=\"{summary}\">{issue}</Checker>"
            )
        };
        let issue =
            "<Issue issueId=\"0\" level=\"3\" ruleUID=\"a.b:c:1.0.0:d\" description=\"x\"/>";
        let all = [
            checker("first", "status=\"completed\"", "", issue),
            checker(
                "blocked",
                "status=\"skipped\"",
                "Preconditions are not satisfied.",
                "",
            ),
            checker("old", "status=\"skipped\"", "Version 1.4 is not valid.", ""),
            checker("broken", "status=\"error\"", "Error: x.", ""),
            checker("silent", "", "", ""),
        ];
        let report = read_text(&result("", &all.concat())).unwrap();
        let endings: Vec<&Ending> = report.checkers.iter().map(|it| &it.ending).collect();
        let failed = |reason: &str| Ending::Failed {
            reason: reason.to_owned(),
        };
        assert_eq!(endings[0], &Ending::Completed);
        let Ending::Blocked { by, .. } = endings[1] else {
            panic!("{:?}", endings[1]);
        };
        assert_eq!(*by, ["first", "broken", "silent"]);
        assert!(matches!(endings[2], Ending::NotApplicable { .. }));
        assert_eq!(endings[3], &failed("Error: x."));
        assert_eq!(
            endings[4],
            &failed("the module does not report how it ended")
        );
    }
}
