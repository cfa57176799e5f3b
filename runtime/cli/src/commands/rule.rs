//! `qcbus rule`: shows the pages of the rules.

use std::fmt::Write;

use qcbus_messages::Exit;
use qcbus_sdk::{Bundle, Checker};

use super::offered::{self, Offered};
use crate::args::{Format, RuleArgs};
use crate::{standard, talk};

/// Runs the command.
pub fn run(args: &RuleArgs) -> Exit {
    let offered = match Offered::ask(&args.instance) {
        Ok(offered) => offered,
        Err(why) => {
            talk::fail(&why);
            return Exit::Usage;
        }
    };
    match &args.id {
        None => list(&offered, args.format),
        Some(id) => show(id, &offered, args.format),
    }
}

fn list(offered: &Offered, format: Format) -> Exit {
    let mut text = String::new();
    let mut rows = Vec::new();
    for bundle in standard::BUNDLES {
        for checker in bundle.checkers() {
            match format {
                Format::Text => {
                    // Writing to a string cannot fail.
                    let _ = writeln!(text, "{:<72} {}", checker.id, checker.description);
                }
                Format::Json => rows.push(describe(bundle.name, &checker)),
            }
        }
    }
    for rule in offered.rules() {
        match format {
            Format::Text => text.push_str(&format!("{}\n", offered::line(rule))),
            Format::Json => rows.push(offered::describe(rule)),
        }
    }
    if format == Format::Json {
        text = format!("{}\n", serde_json::Value::from(rows));
    }
    talk::print(&text);
    Exit::Accepted
}

fn show(id: &str, offered: &Offered, format: Format) -> Exit {
    let mut found = Vec::new();
    for bundle in standard::BUNDLES {
        let ids: Vec<&str> = bundle.find(id).iter().map(|rule| rule.facts().id).collect();
        found.extend(
            bundle
                .checkers()
                .into_iter()
                .filter(|it| ids.contains(&it.facts.id) && !it.is_backport)
                .map(|it| (bundle, it)),
        );
    }
    match found.as_slice() {
        [] => show_offered(id, offered, format),
        [(bundle, checker)] => {
            let text = match format {
                Format::Text => page(checker),
                Format::Json => format!("{}\n", describe(bundle.name, checker)),
            };
            talk::print(&text);
            Exit::Accepted
        }
        several => {
            list_candidates(id, several);
            Exit::Usage
        }
    }
}

/// Shows a rule of a bundle that does not come with qcbus.
fn show_offered(id: &str, offered: &Offered, format: Format) -> Exit {
    match *offered.find(id) {
        [] => unknown(id, offered),
        [rule] => {
            talk::print(&match format {
                Format::Text => offered::page(rule),
                Format::Json => format!("{}\n", offered::describe(rule)),
            });
            Exit::Accepted
        }
        ref several => {
            let count = several.len();
            talk::fail(&format!("`{id}` is ambiguous; {count} rules match:"));
            let rows = several
                .iter()
                .map(|rule| format!("  {}", offered::line(*rule)));
            talk::say_lines(&rows.collect::<Vec<_>>().join("\n"));
            Exit::Usage
        }
    }
}

/// Prints the rules that a name may mean, each with its description.
fn list_candidates(id: &str, checkers: &[(&Bundle, Checker)]) {
    let names = checkers.iter().map(|(_, it)| it.id.chars().count());
    let width = names.max().unwrap_or(0);
    talk::fail(&format!(
        "`{id}` is ambiguous; {} rules match:",
        checkers.len()
    ));
    let rows = checkers.iter().map(|(_, checker)| {
        let about = first_sentence(&checker.description);
        format!("  {:<width$}  {about}", checker.id)
    });
    talk::say_lines(&rows.collect::<Vec<_>>().join("\n"));
}

fn first_sentence(text: &str) -> &str {
    text.split(". ").next().unwrap_or(text)
}

/// Returns all rules that a family or the beginning of a name matches.
fn family(id: &str) -> Vec<(&'static Bundle, Checker)> {
    let checkers = standard::checkers().filter(|(_, checker)| !checker.is_backport);
    checkers
        .filter(|(bundle, checker)| standard::fits(bundle, checker, id))
        .collect()
}

fn unknown(id: &str, offered: &Offered) -> Exit {
    let family = family(id);
    if !family.is_empty() {
        list_candidates(id, &family);
        return Exit::Usage;
    }
    let hint = standard::hint(id);
    let why = offered.why_not.as_deref();
    let why = why.map(|it| format!(" ({it})")).unwrap_or_default();
    talk::fail(&format!("rule `{id}` not found; {hint}{why}"));
    Exit::Usage
}

fn page(checker: &Checker) -> String {
    let facts = &checker.facts;
    let mut head = format!("{}\n", checker.id);
    for uid in facts.uids {
        // Writing to a string cannot fail.
        let _ = writeln!(head, "  {uid}");
    }
    let level = match facts.readers {
        Some(readers) => {
            let of_asam = facts.level.as_str();
            format!("{} ({of_asam} with `--strict`)", readers.in_a_word())
        }
        None => facts.level.as_str().to_owned(),
    };
    let versions = match &checker.range {
        Ok(range) if range.is_everything() => "every version".to_owned(),
        Ok(range) => match range.to_string() {
            text if text.starts_with("versions ") => text,
            text => format!("versions {text}"),
        },
        Err(why) => why.clone(),
    };
    let _ = writeln!(head, "  level {level}, {versions}");
    if let Some(readers) = facts.readers {
        let _ = writeln!(head, "  {}", readers.because);
    }
    if let Some((cited, link)) = facts.uids.iter().find_map(|uid| standard::section(uid)) {
        let _ = writeln!(head, "  {cited}: {link}");
    }
    head.push('\n');
    format!("{head}{}", facts.page)
}

fn describe(bundle: &str, checker: &Checker) -> serde_json::Value {
    let facts = &checker.facts;
    let params: Vec<_> = facts
        .params
        .iter()
        .map(|param| serde_json::json!({"name": param.name, "default": param.default_text(), "description": param.meaning()}))
        .collect();
    serde_json::json!({
        "id": checker.id,
        "bundle": bundle,
        "uids": facts.uids,
        "level": checker.level().as_str(),
        "readers": facts.readers.map(|it| serde_json::json!({"level": it.level.as_str(), "because": it.because})),
        "versions": facts.versions,
        "default": facts.default_on,
        "after": facts.after,
        "description": checker.description,
        "section": facts.uids.iter().find_map(|uid| standard::section(uid)).map(|(cited, _)| cited),
        "params": params,
        "page": facts.page,
    })
}
