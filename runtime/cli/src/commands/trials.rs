//! `qcbus bundle trials`: shows the findings of a shadow and the verdicts that it would change.

use std::fmt::Write;

use qcbus_messages::control::{Request, Response, Trial, TrialCounts};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Exit, Verdict, shown};

use super::readiness::files;
use super::remote::ask;
use crate::args::BundleTrialsArgs;
use crate::talk;

/// Runs the command.
pub fn run(args: &BundleTrialsArgs) -> Exit {
    let name = args.name.clone();
    let (counts, trials) = match ask(&args.instance, &Request::Trials { name }) {
        Ok(Response::Trials { counts, trials }) => (counts, trials),
        Ok(other) => {
            talk::fail(&format!("unexpected answer from the broker: {other:?}"));
            return Exit::Internal;
        }
        Err(exit) => return exit,
    };
    let Some(counts) = counts else {
        let name = &args.name;
        talk::fail(&format!(
            "`{name}` is not a shadow here; `qcbus bundle add --shadow {name} PROGRAM` adds one, and `qcbus \
             status` lists them"
        ));
        return Exit::Usage;
    };
    if args.json {
        let told = serde_json::json!({"counts": counts, "trials": trials});
        talk::print(&format!("{told:#}\n"));
    } else {
        talk::print(&render(&args.name, &counts, &trials));
    }
    exit(&counts)
}

fn exit(counts: &TrialCounts) -> Exit {
    if counts.would_reject > 0 {
        Exit::Rejected
    } else if counts.tried == 0 || counts.would_leave_open + counts.failed + counts.waiting > 0 {
        Exit::Undetermined
    } else {
        Exit::Accepted
    }
}

/// Formats the progress of a shadow in a few words.
pub fn counted(counts: &TrialCounts) -> String {
    let all = counts.tried + counts.waiting;
    let mut text = format!("{} of {} tried", counts.tried, files(all));
    let parts = [
        (counts.would_reject, "would be rejected"),
        (counts.would_leave_open, "would be undetermined"),
        (counts.would_accept, "would be accepted"),
        (counts.failed, "on which it failed"),
    ];
    for (number, what) in parts.into_iter().filter(|(number, _)| *number > 0) {
        // Writing to a string cannot fail.
        let _ = write!(text, ", {number} {what}");
    }
    text
}

fn render(name: &str, counts: &TrialCounts, trials: &[Trial]) -> String {
    let mut text = String::new();
    for trial in trials {
        let _ = writeln!(text, "{}", shown::line(&line(trial)));
        // Beside an error, the reasons why other checkers could not run are of no interest.
        let why = trial
            .why
            .iter()
            .filter(|_| trial.would == Verdict::Undetermined);
        for why in why {
            let _ = writeln!(text, "    {}", shown::line(why));
        }
        if !trial.result.as_os_str().is_empty() {
            let _ = writeln!(text, "    {}", shown::line(&to_text(&trial.result)));
        }
    }
    let nothing = counts.would_reject + counts.would_leave_open + counts.would_accept == 0;
    let nothing = match (nothing, counts.tried) {
        (true, 0) => "; its effect is not known yet",
        (true, _) => "; it would change no verdict",
        (false, _) => "",
    };
    let summary = format!("{name}: {}{nothing}", counted(counts));
    let _ = writeln!(text, "{}", shown::line(&summary));
    text
}

fn line(trial: &Trial) -> String {
    let file = to_text(&trial.file);
    let verdict = trial.verdict;
    if let Some(why) = &trial.failure {
        return format!("{file}: {verdict}; it failed: {why}");
    }
    let would = match trial.would == verdict {
        true => format!("{verdict}, and would stay so"),
        false => format!("{verdict}, would be {}", trial.would),
    };
    let levels = [
        (trial.errors, "error"),
        (trial.warnings, "warning"),
        (trial.information, "information"),
    ];
    let found = levels.into_iter().filter(|(number, _)| *number > 0);
    let found: Vec<String> = found
        .map(|(number, what)| {
            let plural = if number == 1 || what == "information" {
                ""
            } else {
                "s"
            };
            format!("{number} {what}{plural}")
        })
        .collect();
    match found.is_empty() {
        true => format!("{file}: {would}"),
        false => format!("{file}: {would} ({})", found.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(file: &str, would: Verdict) -> Trial {
        Trial {
            file: file.into(),
            verdict: Verdict::Accepted,
            would,
            errors: 0,
            warnings: 0,
            information: 0,
            why: Vec::new(),
            failure: None,
            result: std::path::PathBuf::new(),
        }
    }

    #[test]
    fn trials_of_a_shadow_as_text() {
        let counts = TrialCounts {
            tried: 119,
            waiting: 1,
            would_reject: 1,
            would_leave_open: 1,
            would_accept: 0,
            failed: 1,
        };
        let trials = [
            Trial {
                failure: Some("mine failed 2 times on this file".into()),
                ..trial("/farm/in/c.xodr", Verdict::Accepted)
            },
            Trial {
                errors: 2,
                warnings: 1,
                result: "/farm/out/.qcbus/shadow/mine/a.xodr-01234567.xqar".into(),
                ..trial("/farm/in/a.xodr", Verdict::Rejected)
            },
            Trial {
                why: vec!["mine / check_it: it crashed".into()],
                ..trial("/farm/in/b.xodr", Verdict::Undetermined)
            },
            Trial {
                information: 3,
                ..trial("/farm/in/d.xodr", Verdict::Accepted)
            },
        ];
        insta::assert_snapshot!(render("mine", &counts, &trials));
        assert_eq!(exit(&counts), Exit::Rejected);
    }

    #[test]
    fn incomplete_trial_is_undetermined() {
        let of = |counts: TrialCounts| exit(&counts);
        let tried = TrialCounts {
            tried: 3,
            ..TrialCounts::default()
        };
        assert_eq!(of(tried), Exit::Accepted);
        assert_eq!(of(TrialCounts::default()), Exit::Undetermined);
        assert_eq!(
            of(TrialCounts {
                waiting: 1,
                ..tried
            }),
            Exit::Undetermined
        );
        assert_eq!(of(TrialCounts { failed: 1, ..tried }), Exit::Undetermined);
    }
}
