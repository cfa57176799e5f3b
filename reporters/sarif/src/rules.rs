//! Rules of a report.

use std::collections::BTreeMap;

use qcbus_formats::pool::is_rule_uid;
use qcbus_reporter_sdk::{Pages, rule_name};

use crate::finding::plain;
use crate::log::{Configuration, Message, Rule, RuleProperties, SarifResult, Severity};
use crate::section::{RuleNote, Section};
use crate::text;

/// Returns the rules of these findings, by id. If two sections differ, the first one is used.
pub(crate) fn rules<'s>(
    sections: impl Iterator<Item = &'s Section>,
    findings: &[SarifResult],
    pages: Pages,
) -> Vec<Rule> {
    let mut levels: BTreeMap<&str, Severity> = BTreeMap::new();
    for finding in findings {
        let level = levels.entry(&finding.rule_id).or_insert(finding.level);
        *level = finding.level.min(*level);
    }
    let mut notes: BTreeMap<&str, &RuleNote> = BTreeMap::new();
    for (id, note) in sections.flat_map(|section| &section.rules) {
        notes.entry(id).or_insert(note);
    }
    let nothing = RuleNote::default();
    let rule = |(id, level): (&str, Severity)| {
        let note = notes.get(id).copied().unwrap_or(&nothing);
        rule(id, note, level, pages)
    };
    levels.into_iter().map(rule).collect()
}

fn rule(id: &str, note: &RuleNote, level: Severity, pages: Pages) -> Rule {
    let uid = if is_rule_uid(id) { id } else { "" };
    let page = pages(uid, &note.checker).unwrap_or_default();
    let name = rule_name(uid, &note.checker);
    Rule {
        id: id.to_owned(),
        name: (!name.is_empty() && name != id).then(|| text::name(name)),
        short_description: plain(&note.about),
        full_description: plain(&match beginning(page.text) {
            said if said.is_empty() => note.about.clone(),
            said => text::description(&said),
        }),
        help_uri: (!page.link.is_empty()).then_some(page.link),
        // GitHub requires a help text.
        help: Some(match page.text {
            "" => plain(&note.about),
            text => Message {
                text: text::page(text),
                markdown: Some(text::page(text)),
            },
        }),
        default_configuration: Configuration { level },
        properties: RuleProperties {
            checker: note.checker.clone(),
            tags: tags(uid),
        },
    }
}

/// Returns the first paragraph of a page, after its title.
fn beginning(page: &str) -> String {
    let mut lines = page.lines().map(str::trim);
    let text = lines
        .by_ref()
        .skip_while(|it| it.is_empty() || it.starts_with('#'));
    let lines: Vec<&str> = text.take_while(|it| !it.is_empty()).collect();
    lines.join(" ")
}

/// Returns the standard, its version and the field of a rule: `xodr`, `xodr 1.4.0`, `road`.
fn tags(uid: &str) -> Vec<String> {
    let parts: Vec<&str> = uid.split(':').collect();
    let [_, standard, version, name] = parts[..] else {
        return Vec::new();
    };
    let field = name.split('.').next().unwrap_or(name);
    let mut tags = vec![standard.to_owned(), format!("{standard} {version}")];
    if field != standard {
        tags.push(field.to_owned());
    }
    tags.iter().map(|tag| text::name(tag)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_description_begins_after_title() {
        let page = "# Title\n\nFirst `a`\nsecond.\n\n## Why\n\nBecause.";
        assert_eq!(beginning(page), "First `a` second.");
        assert_eq!(beginning("# Title"), "");
    }

    #[test]
    fn tags_name_standard_version_and_area() {
        let uid = "asam.net:xodr:1.4.0:road.lane.x";
        assert_eq!(tags(uid), ["xodr", "xodr 1.4.0", "road"]);
        assert!(tags("").is_empty());
    }
}
