//! Tests that the findings do not depend on the number of threads.

use crate::common;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use crate::roads::Roads;
use qcbus_document::Document;
use qcbus_formats::xqar::{Issue, Status};
use qcbus_sdk::{
    AnyRule, Bundle, Listener, Loaded, MAX_ISSUES, Outcome, Permits, Plan, Rule, Sink, check_with,
};

/// Number of roads in the file.
const ROADS: usize = 300;

type Report = fn(&Roads<'_>, &usize, &mut Sink<'_>);

const fn by_parts(
    id: &'static str,
    uid: &'static [&'static str],
    each: Report,
) -> Rule<Roads<'static>> {
    Rule {
        id,
        uids: uid,
        each: Some(each),
        ..Rule::DEFAULTS
    }
}

/// Waits, so that other threads have time to join.
fn take_time() {
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_micros(15) {
        std::hint::spin_loop();
    }
}

static FINDS: Rule<Roads> = by_parts("finds", &["x:xodr:1.0.0:a.a"], |roads, part, found| {
    take_time();
    let road = roads.0[*part];
    found.issue(road, format!("road {part}"));
    // All these findings have the same place, so they stay in the order of their parts.
    found.issue(
        road.document().root().unwrap(),
        format!("seen from road {part}"),
    );
});
/// Lists fewer findings than it makes.
static MANY: Rule<Roads> = by_parts("many", &["x:xodr:1.0.0:a.b"], |roads, part, found| {
    found
        .issue(roads.0[*part], format!("road {part}"))
        .point(1.0, 2.0, 3.0);
});
static STATES: Rule<Roads> = by_parts("states", &["x:xodr:1.0.0:a.c"], |_, part, found| {
    if part.is_multiple_of(50) {
        found.fact("part", part.to_string(), "one in fifty");
    }
});
static REFERS: Rule<Roads> = by_parts("refers", &["x:xodr:1.0.0:a.d"], |roads, part, found| {
    found.issue_behind(roads.0[*part], roads.0[*part % 3], "all lead to three");
});
static PANICS: Rule<Roads> = by_parts("panics", &["x:xodr:1.0.0:a.e"], |roads, part, found| {
    found.issue(roads.0[*part], format!("road {part}"));
    assert!(*part % 100 != 71, "on purpose, at {part}");
});
static COUNTS: Rule<Roads> = Rule {
    run: |_, found| found.fact("count", found.count().to_string(), "before the whole"),
    ..by_parts("counts", &["x:xodr:1.0.0:a.f"], |roads, part, found| {
        found.issue(roads.0[*part], "one");
    })
};
static WHOLE: Rule<Roads> = Rule {
    id: "whole",
    uids: &["x:xodr:1.0.0:a.g"],
    run: |roads, found| {
        for road in roads.0.iter().rev() {
            take_time();
            found.issue(*road, "backwards");
        }
    },
    ..Rule::DEFAULTS
};
static WHOLE_PANICS: Rule<Roads> = Rule {
    id: "whole_panics",
    uids: &["x:xodr:1.0.0:a.h"],
    run: |roads, found| {
        found.issue(roads.0[7], "before");
        panic!("on purpose");
    },
    ..Rule::DEFAULTS
};
/// Is skipped, because another rule has found errors.
static AFTER_ERRORS: Rule<Roads> = Rule {
    after: &["finds"],
    ..by_parts("after_errors", &["x:xodr:1.0.0:a.i"], |_, _, _| {})
};
static AFTER_CLEAN: Rule<Roads> = Rule {
    after: &["states"],
    ..by_parts(
        "after_clean",
        &["x:xodr:1.0.0:a.j"],
        |roads, part, found| {
            found.issue(roads.0[*part], "after");
        },
    )
};
/// Has another model and runs in parallel.
static BESIDE: Rule<Document> = Rule {
    id: "beside",
    uids: &["x:xodr:1.0.0:a.k"],
    run: |document, found| {
        take_time();
        found.issue(document.root().unwrap(), "beside");
    },
    ..Rule::DEFAULTS
};

static BUNDLE: Bundle = Bundle {
    rules: &[
        &FINDS as &dyn AnyRule,
        &MANY,
        &STATES,
        &REFERS,
        &PANICS,
        &BESIDE,
        &COUNTS,
        &WHOLE,
        &WHOLE_PANICS,
        &AFTER_ERRORS,
        &AFTER_CLEAN,
    ],
    ..common::BUNDLE
};

#[derive(Default)]
struct Heard {
    ended: Vec<(usize, Vec<Issue>, Outcome)>,
    /// Number of starts after which the check is cancelled.
    patience: Option<usize>,
    begun: AtomicUsize,
}

impl Listener for Heard {
    fn is_cancelled(&self) -> bool {
        let begun = self.begun.load(Ordering::Relaxed);
        self.patience.is_some_and(|patience| begun >= patience)
    }

    fn begins(&self, _: usize) {
        self.begun.fetch_add(1, Ordering::Relaxed);
    }

    fn ended(&mut self, checker: usize, issues: Vec<Issue>, mut outcome: Outcome) {
        outcome.took = Duration::ZERO;
        self.ended.push((checker, issues, outcome));
    }
}

fn map() -> Loaded {
    let mut text = "<OpenDRIVE><header revMajor='1' revMinor='4'/>\n".to_owned();
    for road in 0..ROADS {
        let name = "so that it is worth more than one thread ".repeat(10);
        writeln!(text, "<road id='{road}' name='{name}'/>").unwrap();
    }
    text.push_str("</OpenDRIVE>");
    Loaded::from_bytes(Path::new("a.xodr"), text.into_bytes()).unwrap()
}

/// Returns a plan of all checkers. One of them lists at most 20 findings.
fn plan(bundle: &'static Bundle) -> Plan {
    Plan::new(
        bundle,
        |_| true,
        |checker, name| (checker.id == "many" && name == MAX_ISSUES.name).then(|| "20".to_owned()),
    )
}

fn heard(bundle: &'static Bundle, threads: usize, patience: Option<usize>) -> (bool, Heard) {
    let map = map();
    let subject = map.subject(bundle).unwrap();
    let mut heard = Heard {
        patience,
        ..Heard::default()
    };
    let permits = Permits::new(threads);
    let complete = check_with(&plan(bundle), &subject, &permits, &mut heard);
    (complete, heard)
}

#[test]
fn findings_do_not_depend_on_number_of_threads() {
    let (_, alone) = heard(&BUNDLE, 1, None);
    let of = |id: &str| {
        let index = BUNDLE.rules.iter().position(|rule| rule.facts().id == id);
        alone.ended.iter().find(|it| Some(it.0) == index).unwrap()
    };
    assert_eq!(of("finds").1.len(), 2 * ROADS);
    assert_eq!(
        of("many").1.len(),
        21,
        "twenty findings, and the number of the others"
    );
    assert_eq!(of("states").2.metadata.len(), ROADS / 50);
    assert_eq!(of("refers").1.len(), 3);
    let panicked = &of("panics");
    assert_eq!(panicked.1.len(), 72, "findings before the panic are kept");
    assert!(
        panicked.2.ending.reason().ends_with("at 71"),
        "{:?}",
        panicked.2
    );
    assert_eq!(of("counts").2.metadata[0].value, ROADS.to_string());
    assert_eq!(of("after_errors").2.ending.status(), Status::Skipped);
    assert_eq!(of("after_clean").1.len(), ROADS);
    for threads in [2, 3, 8] {
        for round in 0..5 {
            let (complete, many) = heard(&BUNDLE, threads, None);
            assert!(complete);
            assert!(
                many.ended == alone.ended,
                "{threads} threads, round {round}"
            );
        }
    }
}

#[test]
fn check_is_cancelled_in_all_threads() {
    for threads in [1, 4] {
        let (complete, heard) = heard(&BUNDLE, threads, Some(60));
        assert!(!complete);
        let begun = heard.begun.load(Ordering::Relaxed);
        // Each thread finishes its current part.
        assert!(begun <= 60 + threads * BUNDLE.rules.len(), "{begun}");
    }
}

/// Threads that have checked a part.
static THREADS: Mutex<Option<HashSet<ThreadId>>> = Mutex::new(None);

static SLOW: Rule<Roads> = by_parts("slow", &["x:xodr:1.0.0:a.a"], |_, _, _| {
    let me = std::thread::current().id();
    THREADS.lock().unwrap().get_or_insert_default().insert(me);
    std::thread::sleep(Duration::from_millis(1));
});

static SLOWLY: Bundle = Bundle {
    rules: &[&SLOW as &dyn AnyRule],
    ..common::BUNDLE
};

#[test]
fn large_document_gets_free_permits() {
    let (complete, _) = heard(&SLOWLY, 3, None);
    assert!(complete);
    let threads = THREADS.lock().unwrap().take().unwrap();
    assert!((2..=3).contains(&threads.len()), "{}", threads.len());
}
