//! Collection of violations up to a limit per kind and in total. Further ones are counted.

use std::collections::HashMap;

use qcbus_document::{Attribute, Node};

use super::wording::Wording;
use crate::defects;
use crate::violation::{Code, Limits, Report, Rest, Violation};

/// Part of a violation's kind besides its code: the type or model, and a name in it.
pub(super) type KindKey = (usize, u32);

/// Maximum number of separate kinds. All further ones share one count per code.
const MAX_KINDS: usize = 4_096;

#[derive(Debug)]
struct Tally {
    subject: String,
    listed: u32,
    unlisted: u64,
    /// Whether all violations of this kind so far are defects of the schema.
    defect: bool,
    order: usize,
}

#[derive(Debug)]
pub(super) struct Reporter<'a, 's> {
    limits: Limits,
    /// Title of the schema.
    title: &'s str,
    violations: Vec<Violation<'a>>,
    /// Counts by code, kind, and whether the schema defect is known without a text.
    kinds: HashMap<(Code, KindKey, bool), Tally>,
}

/// Number of listed violations per kind for schema defects that occur in every such file.
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

    /// Checks whether the list is full.
    pub(super) fn is_full(&self) -> bool {
        self.violations.len() >= self.limits.total as usize
    }

    /// Lists a violation with the text from `word`, or counts it.
    pub(super) fn add(
        &mut self,
        code: Code,
        kind: KindKey,
        node: Node<'a>,
        word: impl FnOnce() -> Wording,
    ) {
        self.add_at(code, kind, node, None, word);
    }

    /// Lists or counts a violation of an attribute in the same way.
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
            // Only these codes can be schema defects, so other violations need no text for this.
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
            text,
            detail,
            defect,
        } = word().excused(known);
        tally.defect &= defect.is_some();
        let violation = Violation {
            code,
            node,
            attribute,
            detail,
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
