use crate::families::names;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (element, name) in names::keys(scenario) {
        let Some(sign) = name.chars().find(|sign| is_invisible(*sign)) else {
            continue;
        };
        let shown: String = name.chars().filter(|sign| !is_invisible(*sign)).collect();
        let text = format!(
            "the name `{shown}` contains the invisible character U+{:04X}; a name typed without it does not \
             match",
            u32::from(sign)
        );
        found.about(element, "name", text);
    }
}

/// Checks for control characters, invisible or unusual spaces, and marks of direction.
fn is_invisible(sign: char) -> bool {
    sign.is_control()
        || matches!(sign, '\u{a0}' | '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202f}' | '\u{2060}' | '\u{feff}')
}
