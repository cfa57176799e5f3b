//! What a bundle said about a job, measured, cut to size and put in the form of a result.

use qcbus_formats::xqar::{DomainInfo, InfoElement, Issue, Location, Locations, Status};

use super::jobs::{Share, ShareState};
use super::types::{BundleOutcome, CheckerOutcome};

/// What one share says in the result.
pub(super) fn outcome(name: &str, share: &Share) -> BundleOutcome {
    let failure = match &share.state {
        ShareState::Failed(why) => Some(why.clone()),
        _ => None,
    };
    let said = |checker: u32| share.staged.get(&checker).filter(|_| failure.is_none());
    let checkers = share.demanded.iter().map(|checker| {
        let staged = said(*checker);
        let done = staged.and_then(|staged| staged.done.clone());
        let withheld = staged.map_or(0, |staged| staged.withheld);
        let kept = staged.map_or(0, |staged| staged.issues.len());
        let (mut status, mut reason, params, metadata) = done.unwrap_or_else(|| {
            let why = failure.clone().unwrap_or_else(|| {
                "the bundle said that it was done without a word on this checker".to_owned()
            });
            (Status::Error, why, Vec::new(), Vec::new())
        });
        if withheld > 0 {
            status = Status::Error;
            reason = format!(
                "more findings than one checker may report: {kept} are kept, {withheld} were cut off"
            );
        }
        let issues = staged.map(|staged| staged.issues.clone()).unwrap_or_default();
        let issues = if status == Status::Skipped { Vec::new() } else { issues };
        CheckerOutcome { checker: *checker, status, reason, params, issues, metadata }
    });
    BundleOutcome {
        name: name.to_owned(),
        version: share.version.clone(),
        catalogue: share.catalogue.clone(),
        checkers: checkers.collect(),
        micros: share.micros,
        failure: failure.clone(),
    }
}

/// Roughly the memory that an issue holds.
pub(crate) fn weight(issue: &Issue) -> usize {
    let place = |place: &Location| match place {
        Location::Xml { xpath } => 64 + xpath.len(),
        _ => 64,
    };
    let places =
        |it: &Locations| 64 + it.description.len() + it.places.iter().map(place).sum::<usize>();
    let infos = |it: &DomainInfo| it.name.len() + it.content.iter().map(info_weight).sum::<usize>();
    256 + issue.description.len()
        + issue.rule_uid.len()
        + issue.locations.iter().map(places).sum::<usize>()
        + issue.domain_info.iter().map(infos).sum::<usize>()
}

fn info_weight(element: &InfoElement) -> usize {
    let attributes = element
        .attributes
        .iter()
        .map(|(name, value)| 48 + name.len() + value.len());
    let children = element.children.iter().map(info_weight);
    96 + element.name.len()
        + element.text.len()
        + attributes.sum::<usize>()
        + children.sum::<usize>()
}

/// Cuts an issue down to what may be kept.
pub(super) fn clip(issue: &mut Issue, max: usize) {
    clip_text(&mut issue.description, max);
    clip_text(&mut issue.rule_uid, 512);
    issue.locations.truncate(64);
    issue.domain_info.truncate(16);
    for place in &mut issue.locations {
        clip_text(&mut place.description, max);
        place.places.truncate(16);
    }
}

/// Cuts a text at a character.
pub(super) fn clip_text(text: &mut String, max: usize) {
    if text.len() > max {
        let end = (0..=max)
            .rev()
            .find(|at| text.is_char_boundary(*at))
            .unwrap_or(0);
        text.truncate(end);
        text.push('…');
    }
}
