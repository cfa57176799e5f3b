//! Rules of bundles that do not come with qcbus, as offered by the bundles of a running broker.

use std::fmt::Write;

use qcbus_control::{AskError, ask_broker};
use qcbus_messages::CheckerInfo;
use qcbus_messages::control::{Offer, Request, Response};
use qcbus_messages::shown;

use super::settings;
use crate::args::InstanceArgs;
use crate::standard;

/// Rules that a running broker knows, if there is one.
pub struct Offered {
    /// Bundles with their rules, sorted by name.
    offers: Vec<Offer>,
    /// Reason for the user why no rules are known.
    pub why_not: Option<String>,
}

/// A rule and the bundle that offers it.
pub type OfferedRule<'o> = (&'o Offer, &'o CheckerInfo);

impl Offered {
    /// Asks the broker of an instance.
    ///
    /// # Errors
    /// Returns an error if the instance is invalid.
    pub fn ask(args: &InstanceArgs) -> Result<Offered, String> {
        let instance = settings::instance(args)?;
        let without = standard::BUNDLES.iter().map(|it| it.name.to_owned());
        let request = Request::Offers {
            without: without.collect(),
        };
        let (offers, why_not) = match ask_broker(instance.dir(), &request) {
            Ok(Response::Offers { offers }) => (offers, None),
            Ok(other) => (Vec::new(), Some(format!("unexpected answer: {other:?}"))),
            Err(AskError::NoBroker { .. }) => {
                let why = format!("no broker runs as instance `{}`", instance.name());
                (Vec::new(), Some(why))
            }
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        let why_not = why_not.map(|it| format!("only rules that come with qcbus are known: {it}"));
        Ok(Offered { offers, why_not })
    }

    /// Returns all rules.
    pub fn rules(&self) -> impl Iterator<Item = OfferedRule<'_>> {
        let offers = self.offers.iter();
        offers.flat_map(|offer| offer.catalogue.checkers.iter().map(move |it| (offer, it)))
    }

    /// Returns the rules that match a name: an id or UID, else the end of one.
    pub fn find(&self, name: &str) -> Vec<OfferedRule<'_>> {
        let meant = |fits: &dyn Fn(&str) -> bool| -> Vec<OfferedRule<'_>> {
            let is_it = |it: &CheckerInfo| fits(&it.id) || it.rule_uids.iter().any(|it| fits(it));
            self.rules().filter(|(_, it)| is_it(it)).collect()
        };
        let exact = meant(&|id| id == name);
        if !exact.is_empty() || name.is_empty() {
            return exact;
        }
        meant(&|id| {
            let rest = id.strip_suffix(name);
            rest.is_some_and(|it| it.ends_with(['_', ':', '.']))
        })
    }
}

/// Returns a line for lists.
pub fn line((offer, rule): OfferedRule<'_>) -> String {
    let line = format!("{:<72} {} ({})", rule.id, rule.description, offer.name);
    shown::line(&line).to_string()
}

/// Returns the known facts about a rule. Its page stays with its bundle.
pub fn page((offer, rule): OfferedRule<'_>) -> String {
    let mut lines = vec![rule.id.to_string()];
    lines.extend(rule.rule_uids.iter().map(|uid| format!("  {uid}")));
    let level = rule.level.as_str();
    let kinds: Vec<&str> = rule.kinds.iter().map(|it| it.as_str()).collect();
    let asked = if rule.default_on {
        ""
    } else {
        ", off by default"
    };
    lines.push(format!(
        "  level {level}, files: {}{asked}",
        kinds.join(", ")
    ));
    let (name, version) = (&offer.name, &offer.version);
    lines.push(format!("  from the running bundle {name} {version}"));
    lines.push(String::new());
    lines.push(rule.description.to_string());
    for param in &rule.params {
        lines.push(String::new());
        lines.push(format!("{} = {}", param.name, param.default));
        lines.push(format!("  {}", param.description));
    }
    let mut text = String::new();
    for line in lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", shown::line(&line));
    }
    text
}

/// Returns the same facts as JSON.
pub fn describe((offer, rule): OfferedRule<'_>) -> serde_json::Value {
    let params = rule.params.iter().map(|it| {
        serde_json::json!({"name": it.name, "default": it.default, "description": it.description})
    });
    let kinds: Vec<&str> = rule.kinds.iter().map(|it| it.as_str()).collect();
    let uids: Vec<&str> = rule.rule_uids.iter().map(|it| &**it).collect();
    serde_json::json!({
        "id": &*rule.id,
        "bundle": offer.name,
        "uids": uids,
        "level": rule.level.as_str(),
        "kinds": kinds,
        "default": rule.default_on,
        "description": &*rule.description,
        "params": params.collect::<Vec<_>>(),
    })
}
