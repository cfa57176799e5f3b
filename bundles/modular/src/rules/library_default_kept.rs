use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::{key_of, taken_at};
use crate::prelude::*;
use qcbus_sdk::modular::offered;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Information,
    run,
    ..Rule::DEFAULTS
};

/// Maximum number of attributes that a finding lists.
const MOST: usize = 8;

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    // Fixing the other faults first may set some of the attributes that would be listed here.
    if !assembly.expansion.is_complete() {
        return;
    }
    // An outer scenario may still replace values that an inner scenario keeps.
    let of_root = assembly.expansion.references.iter();
    for reference in of_root.filter(|reference| reference.piece == 0) {
        for one in &reference.uses {
            say(reference, one, found);
        }
    }
}

fn say(reference: &Followed<'_>, one: &Use<'_>, found: &mut Sink<'_>) {
    let mut kept: Vec<Attribute<'_>> = Vec::new();
    let mut all = 0;
    for copy in &one.copies {
        for attribute in copy.group.descendants().flat_map(offered) {
            all += 1;
            let is_kept = !copy.edits.contains_key(&attribute.offset());
            kept.extend(is_kept.then_some(attribute));
        }
    }
    let (Some(first), Some(copy)) = (kept.first(), one.copies.first()) else {
        return;
    };
    let shown = kept.iter().take(MOST);
    let shown = shown.map(|one| format!("`{}` is `{}`", key_of(*one), one.value()));
    let mut list = shown.collect::<Vec<_>>().join(", ");
    if kept.len() > MOST {
        list.push_str(&format!(" and {} more", kept.len() - MOST));
    }
    let which = match (kept.len(), all) {
        (1, 1) => "the only attribute".to_owned(),
        (kept, all) if kept == all => format!("all {all} attributes"),
        (kept, all) => format!("{kept} of the {all} attributes"),
    };
    let text = format!(
        "{which} that the group `{}` offers {}: {list}",
        copy.group.attr("name").unwrap_or(""),
        if kept.len() == 1 {
            "keeps the value of the library file"
        } else {
            "keep the values of the library file"
        }
    );
    found
        .issue(place(taken_at(reference, one)), text)
        .at(*first, "the first of them");
}
