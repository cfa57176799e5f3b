//! Bundle of a hosted module: each checker of the module is a rule of the SDK. All rules share one
//! run.

use std::any::{Any, TypeId};

use qcbus_document::Document;
use qcbus_formats::pool::{Ending, is_rule_uid};
use qcbus_messages::Exit;
use qcbus_sdk::{
    AnyRule, Backport, Built, Bundle, Facts, Level, Reads, Sink, Subject, Unbuilt, Version, basic,
};

use crate::documents;
use crate::hosted::Hosted;
use crate::learn::{Known, Learned};
use crate::messages::Request;
use crate::results::{Report, Told, read};
use crate::runners::Runners;

/// Checker that represents the module as a whole.
pub(crate) const MODULE_CHECKER: &str = "check_qcbus_asam_module_is_known";
const MODULE_UID: &str = "qcbus.dev:qcbus:1.0.0:asam.module_is_known";
const MODULE_PAGE: &str = "# module is known\n\nThe results of the module contain only checkers that it had when \
                           it was started.\n";

/// State shared by all rules of a bundle.
struct Host {
    hosted: Hosted,
    learned: Learned,
    runners: Runners,
}

/// The part of a result that a rule reports.
enum RuleKind {
    /// A checker of the module.
    Checker(&'static Known),
    /// All checkers without a rule of their own.
    Rest,
}

struct HostedRule {
    facts: Facts,
    kind: RuleKind,
    host: &'static Host,
}

/// Run of a module over one job. All of its checkers read it.
struct Run<'d> {
    report: Report,
    subject: &'d Subject<'d>,
}

/// Leaks a value for the process lifetime, because the SDK expects constant bundles.
fn leak<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

fn leak_text(text: impl Into<String>) -> &'static str {
    Box::leak(text.into().into_boxed_str())
}

/// Builds the bundle of a module.
pub(crate) fn bundle(hosted: Hosted, learned: Learned, runners: Runners) -> &'static Bundle {
    let host = leak(Host {
        hosted,
        learned,
        runners,
    });
    let learned = &host.learned;
    let known = learned.checkers.iter();
    let rules = known.map(|it| (facts_of(it), RuleKind::Checker(it)));
    let rules = rules.chain([(module_facts(), RuleKind::Rest)]);
    let rules: Vec<&'static dyn AnyRule> = rules
        .map(|(facts, kind)| {
            let rule = leak(HostedRule { facts, kind, host });
            rule as &'static dyn AnyRule
        })
        .collect();
    let name = host.hosted.name.as_str();
    leak(Bundle {
        name,
        alias: name,
        version: leak_text(learned.version.as_str()),
        description: leak_text(learned.description.as_str()),
        standard: "the standard",
        kinds: &learned.kinds,
        versions: &[],
        reads: Reads::Written,
        version_of,
        rules: Vec::leak(rules),
    })
}

fn version_of(document: &Document<'_>) -> Option<Version> {
    let root = document.root()?;
    let header = match root.name() {
        "OpenSCENARIO" => "FileHeader",
        _ => "header",
    };
    basic::version_of(document, header)
}

fn facts_of(known: &'static Known) -> Facts {
    let uids = known.uids.iter().filter(|uid| is_rule_uid(uid));
    let uids: Vec<&'static str> = uids.map(String::as_str).collect();
    let page = format!("# {}\n\n{}\n", known.id, known.description.trim());
    Facts {
        id: &known.id,
        uids: Vec::leak(uids),
        page: leak_text(page),
        ..module_facts()
    }
}

fn module_facts() -> Facts {
    Facts {
        id: MODULE_CHECKER,
        uids: &[MODULE_UID],
        level: Level::Error,
        readers: None,
        versions: "",
        backport: Backport::None,
        after: &[],
        params: &[],
        resource: None,
        default_on: true,
        page: MODULE_PAGE,
    }
}

impl Host {
    fn run<'d>(&self, subject: &'d Subject<'d>) -> Result<Run<'d>, Unbuilt> {
        let failed = |why: String| Unbuilt::Failed(why);
        let (files, pieces) = documents::of(subject).map_err(failed)?;
        let request = Request {
            files,
            config: subject.config().cloned(),
            applications: vec![self.learned.application.clone()],
            report: None,
        };
        let name = &self.hosted.name;
        let answered = match self.runners.ask(&request, &pieces) {
            Ok(answered) => answered,
            Err(error) => {
                // A process in the sandbox cannot start another runner. Its parent starts a new
                // process.
                tracing::error!(module = name, %error, "no further run is possible");
                std::process::exit(i32::from(Exit::Internal.code()));
            }
        };
        let (ran, result) =
            answered.map_err(|why| failed(format!("the module `{name}` did not run: {why}")))?;
        let report = read(name, &ran, &result).map_err(failed)?;
        Ok(Run { report, subject })
    }

    fn is_known(&self, id: &str) -> bool {
        self.learned.checkers.iter().any(|it| it.id == id)
    }
}

impl Run<'_> {
    fn told(&self, known: &Known, found: &mut Sink<'_>) {
        let Some(told) = self.report.checkers.iter().find(|it| it.id == known.id) else {
            return found.end(self.without_a_word(known));
        };
        retell(told, found);
        found.end(told.ending.clone());
    }

    /// Returns how a checker ended that the result does not mention.
    fn without_a_word(&self, known: &Known) -> Ending {
        let kind = self.subject.kind();
        match known.kinds.contains(&kind) {
            true => Ending::Failed {
                reason: "the module's result does not mention this checker".to_owned(),
            },
            false => Ending::NotApplicable {
                reason: format!(
                    "the module does not apply this checker to {} files",
                    kind.as_str()
                ),
            },
        }
    }

    /// Reports issues of unknown checkers, so that they are not lost. The checker then fails.
    fn told_besides(&self, host: &Host, found: &mut Sink<'_>) {
        let checkers = self.report.checkers.iter();
        let unknown: Vec<&Told> = checkers.filter(|it| !host.is_known(&it.id)).collect();
        for told in &unknown {
            retell(told, found);
        }
        if !unknown.is_empty() {
            let ids: Vec<&str> = unknown.iter().map(|it| it.id.as_str()).collect();
            found.fail(format!(
                "the module has checkers that it did not have when it was started: `{}`; their findings are \
                 listed here",
                ids.join("`, `")
            ));
        }
    }
}

fn retell(told: &Told, found: &mut Sink<'_>) {
    for issue in &told.issues {
        found.retell(issue.clone());
    }
    for fact in &told.metadata {
        found.fact(&fact.key, fact.value.as_str(), &fact.description);
    }
}

impl<'d> Built<'d> for Run<'d> {
    fn parts(&self) -> usize {
        0
    }

    fn each(&self, _: usize, _: &dyn AnyRule, _: &mut Sink<'d>) {}

    fn run(&self, rule: &dyn AnyRule, found: &mut Sink<'d>) {
        let Some(rule) = rule.as_any().downcast_ref::<HostedRule>() else {
            return;
        };
        match rule.kind {
            RuleKind::Checker(known) => self.told(known, found),
            RuleKind::Rest => self.told_besides(rule.host, found),
        }
    }
}

impl AnyRule for HostedRule {
    fn facts(&self) -> Facts {
        self.facts
    }

    fn model(&self) -> TypeId {
        TypeId::of::<Host>()
    }

    fn goes_by_parts(&self) -> bool {
        false
    }

    fn with_model<'d>(
        &self,
        subject: &'d Subject<'d>,
        hand: &mut dyn FnMut(&dyn Built<'d>),
    ) -> Result<(), Unbuilt> {
        let run = self.host.run(subject)?;
        hand(&run);
        Ok(())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
