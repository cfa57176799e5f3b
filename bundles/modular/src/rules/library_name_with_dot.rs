use std::collections::HashSet;

use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::taken_at;
use crate::families::finds::Finds;
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut finds = Finds::default();
    let mut seen = HashSet::new();
    for reference in &assembly.expansion.references {
        let group = reference.group;
        let name = group.attr("name").filter(|name| name.contains('.'));
        if let Some(name) = name.filter(|_| seen.insert((reference.piece, group.index()))) {
            let text = format!(
                "the referring group is called `{name}`; expansion puts a dot between its name and the name of \
                 the group that it takes, so a dot within a name makes the boundary ambiguous"
            );
            found.issue(place(Spot::of(group, "name")), text);
        }
        for one in &reference.uses {
            for copy in &one.copies {
                let spot = Spot::of(copy.group, "name");
                let Some(name) = copy.group.attr("name").filter(|name| name.contains('.')) else {
                    continue;
                };
                let text = format!(
                    "the group is called `{name}` in its file; expansion puts a dot between the name of the \
                     referring group and this one, so a dot within a name makes the boundary ambiguous"
                );
                let at = taken_at(reference, one);
                finds.brought(at, spot, "its name in the library file", text);
            }
        }
    }
    finds.say(found);
}
