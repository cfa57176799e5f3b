//! `qcbus rule`: the pages of the rules.

use std::fmt::Write;

use qcbus_messages::Exit;
use qcbus_sdk::Checker;

use crate::args::{Format, RuleArgs};
use crate::{standard, talk};

/// Runs the command.
pub fn run(args: &RuleArgs) -> Exit {
    match &args.id {
        None => list(args.format),
        Some(id) => show(id, args.format),
    }
}

fn list(format: Format) -> Exit {
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
    if format == Format::Json {
        text = format!("{}\n", serde_json::Value::from(rows));
    }
    talk::print(&text);
    Exit::Accepted
}

fn show(id: &str, format: Format) -> Exit {
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
        [] => unknown(id),
        [(bundle, checker)] => {
            let text = match format {
                Format::Text => page(checker),
                Format::Json => format!("{}\n", describe(bundle.name, checker)),
            };
            talk::print(&text);
            Exit::Accepted
        }
        several => {
            let names: Vec<&str> = several.iter().map(|(_, it)| it.facts.id).collect();
            talk::fail(&format!("`{id}` may mean any of:"));
            talk::say_lines(&format!("  {}", names.join("\n  ")));
            Exit::Usage
        }
    }
}

fn unknown(id: &str) -> Exit {
    let mut names: Vec<String> = Vec::new();
    for bundle in standard::BUNDLES {
        for checker in bundle.checkers() {
            names.push(checker.id.clone());
            names.extend(checker.facts.uids.iter().map(|uid| (*uid).to_owned()));
        }
    }
    let hint = qcbus_formats::distance::closest(id, names.iter().map(String::as_str)).map_or_else(
        || "`qcbus rule` lists all".to_owned(),
        |name| format!("did you mean `{name}`?"),
    );
    talk::fail(&format!("there is no rule `{id}`; {hint}"));
    Exit::Usage
}

fn page(checker: &Checker) -> String {
    let facts = &checker.facts;
    let mut head = format!("{}\n", checker.id);
    for uid in facts.uids {
        // Writing to a string cannot fail.
        let _ = writeln!(head, "  {uid}");
    }
    let level = format!("{:?}", facts.level).to_lowercase();
    let versions = match &checker.range {
        Ok(range) if range.is_everything() => "every version".to_owned(),
        Ok(range) => format!("versions {range}"),
        Err(why) => why.clone(),
    };
    let _ = writeln!(head, "  level {level}, {versions}\n");
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
        "level": format!("{:?}", checker.level()).to_lowercase(),
        "versions": facts.versions,
        "default": facts.default_on,
        "after": facts.after,
        "description": checker.description,
        "params": params,
        "page": facts.page,
    })
}
