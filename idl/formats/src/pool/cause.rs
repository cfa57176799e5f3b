//! Causes: which findings of a bundle are about one fault.

use crate::xqar::{DomainInfo, InfoElement, Issue};

/// Name of the information about the cause of a finding. Pooling uses and removes it.
pub const CAUSE_INFO: &str = "qcbus.cause";

/// Name of the information about a further rule that the same fact violates. The format has room
/// for only one rule per issue.
pub const RULE_INFO: &str = "qcbus.rule";

/// Start of the description of a place that stands for another finding about the same fault.
pub const ALSO: &str = "also: ";

/// Description of a place of which the same is true as of the first.
pub const ALSO_HERE: &str = "also here";

/// The cause of a finding. Findings of one bundle with the same key are about one fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cause {
    /// Names the fault, in the words of the bundle.
    pub key: String,
    /// Whether the finding is a consequence of the fault. The fault itself is reported first.
    pub follows: bool,
}

impl Cause {
    /// Returns it as information of an issue.
    pub fn to_info(&self) -> DomainInfo {
        let element = if self.follows { "Follows" } else { "Cause" };
        info(CAUSE_INFO, element, ("key", &self.key))
    }

    /// Returns the causes of an issue.
    pub fn of(issue: &Issue) -> impl Iterator<Item = Cause> {
        let infos = issue.domain_info.iter();
        let elements = infos
            .filter(|info| info.name == CAUSE_INFO)
            .flat_map(|info| &info.content);
        elements.filter_map(|element| {
            let (_, key) = element.attributes.iter().find(|(name, _)| name == "key")?;
            Some(Cause {
                key: key.clone(),
                follows: element.name == "Follows",
            })
        })
    }
}

/// Returns the information that an issue violates a further rule.
pub fn rule_info(uid: &str) -> DomainInfo {
    info(RULE_INFO, "Rule", ("ruleUID", uid))
}

fn info(name: &str, element: &str, (key, value): (&str, &str)) -> DomainInfo {
    let element = InfoElement {
        name: element.to_owned(),
        attributes: vec![(key.to_owned(), value.to_owned())],
        text: String::new(),
        children: Vec::new(),
    };
    DomainInfo {
        name: name.to_owned(),
        content: vec![element],
    }
}
