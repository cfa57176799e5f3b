//! Collects violations, so many per kind and in all; counts the rest.

use std::collections::HashMap;

use qcbus_document::{Attribute, Node};

use super::wording::Wording;
use crate::defects;
use crate::violation::{Code, Limits, Report, Rest, Violation};

/// What makes two violations the same kind, beside their code: the type or model they are about and
/// a name within it.
pub(super) type KindKey = (usize, u32);

/// Kinds told apart; all further ones share one count per code.
const MAX_KINDS: usize = 4_096;

#[derive(Debug)]
struct Tally {
    subject: String,
    listed: u32,
    unlisted: u64,
    /// Whether every one so far is the schema's fault.
    defect: bool,
    order: usize,
}

#[derive(Debug)]
pub(super) struct Reporter<'a, 's> {
    limits: Limits,
    /// What the schema is called.
    title: &'s str,
    violations: Vec<Violation<'a>>,
    /// By code, kind, and whether they are known to be the schema's fault before they are worded.
    kinds: HashMap<(Code, KindKey, bool), Tally>,
}

/// How many violations of one kind are listed that are the schema's fault and stand in every such file.
const LISTED_DEFECTS: u32 = 1;

impl<'a, 's> Reporter<'a, 's> {
    pub(super) fn new(limits: Limits, title: &'s str) -> Self {
        Self {
            limits,
            title,
            violations: Vec::new(),
            kinds: HashMap::new(),
        }
    }

    /// Whether nothing more will be listed.
    pub(super) fn is_full(&self) -> bool {
        self.violations.len() >= self.limits.total as usize
    }

    /// Lists the violation, worded by `word`, or counts it.
    pub(super) fn add(
        &mut self,
        code: Code,
        kind: KindKey,
        node: Node<'a>,
        word: impl FnOnce() -> Wording,
    ) {
        self.add_at(code, kind, node, None, word);
    }

    /// The same for a violation about an attribute.
    pub(super) fn add_at(
        &mut self,
        code: Code,
        kind: KindKey,
        node: Node<'a>,
        attribute: Option<Attribute<'a>>,
        word: impl FnOnce() -> Wording,
    ) {
        let full = self.is_full();
        let order = self.kinds.len();
        let known = attribute.and_then(|one| defects::attribute(code, one, self.title));
        let is_known = known.is_some();
        let crowded = order >= MAX_KINDS && !self.kinds.contains_key(&(code, kind, is_known));
        let key = if crowded {
            (code, (usize::MAX, u32::MAX), is_known)
        } else {
            (code, kind, is_known)
        };
        let most = match is_known {
            true => LISTED_DEFECTS.min(self.limits.per_kind),
            false => self.limits.per_kind,
        };
        let tally = self.kinds.entry(key).or_insert_with(|| Tally {
            subject: if crowded {
                Report::VARIOUS.to_owned()
            } else {
                subject(node, attribute)
            },
            listed: 0,
            unlisted: 0,
            // No other violations are ever the schema's fault, so they need not be worded to know.
            defect: is_known
                || matches!(
                    code,
                    Code::ConditionFailed
                        | Code::MissingElement
                        | Code::MisplacedElement
                        | Code::UnexpectedElement
                ),
            order,
        });
        if full || crowded || tally.listed >= most {
            tally.unlisted += 1;
            tally.defect = tally.defect && (is_known || word().defect.is_some());
            return;
        }
        tally.listed += 1;
        let Wording {
            found,
            expected,
            suggestion,
            defect,
            text,
        } = match known {
            Some(_) => word().excused(known),
            None => word(),
        };
        tally.defect &= defect.is_some();
        let violation = Violation {
            code,
            node,
            attribute,
            found,
            expected,
            suggestion,
            known_schema_defect: defect,
            text,
        };
        self.violations.push(violation);
    }

    pub(super) fn finish(self) -> Report<'a> {
        let mut rest: Vec<(usize, Rest)> = self
            .kinds
            .into_iter()
            .filter(|(_, tally)| tally.unlisted > 0)
            .map(|((code, _, _), tally)| {
                (
                    tally.order,
                    Rest {
                        code,
                        subject: tally.subject,
                        count: tally.unlisted,
                        known_schema_defect: tally.defect,
                    },
                )
            })
            .collect();
        rest.sort_by_key(|(order, _)| *order);
        Report {
            violations: self.violations,
            rest: rest.into_iter().map(|(_, rest)| rest).collect(),
        }
    }
}

fn subject(node: Node<'_>, attribute: Option<Attribute<'_>>) -> String {
    match attribute {
        Some(attribute) => format!("{}/@{}", node.name(), attribute.name()),
        None => node.name().to_owned(),
    }
}
