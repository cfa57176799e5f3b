use crate::families::names;
use crate::families::references::quoted;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_naming_no_double_colon_prefix_in_names",
    uids: &["asam.net:xosc:1.0.0:naming.no_double_colon_prefix_in_names"],
    after: super::READABLE,
    page: include_str!("naming_no_double_colon_prefix_in_names.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (element, name) in names::keys(scenario) {
        if name.contains("::") {
            let text = format!(
                "the name {} contains `::`, which joins names in references: `a::b` is the element `b` in `a`",
                quoted(element, "name", &name)
            );
            found.about(element, "name", text);
        }
    }
}
