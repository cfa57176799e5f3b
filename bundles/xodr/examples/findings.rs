//! Prints every finding of the bundle on the files that are named: `findings [--checker PART] FILE…`

#![expect(clippy::print_stdout, reason = "a tool for the terminal")]

use std::path::Path;

use qcbus_sdk::{Loaded, Plan, examine};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).peekable();
    let part = match arguments.next_if(|argument| argument == "--checker") {
        Some(_) => arguments.next().unwrap_or_default(),
        None => String::new(),
    };
    let plan = Plan::new(
        &qcbus_xodr::BUNDLE,
        |checker| checker.id.contains(&part),
        |_, _| None,
    );
    for argument in arguments {
        let path = Path::new(&argument);
        let loaded = Loaded::from_path(path, path.parent().unwrap_or(path))?;
        for checker in examine(&plan, &loaded)?.checkers {
            for issue in checker.issues {
                let place = issue
                    .locations
                    .first()
                    .map(|place| format!("{:?}", place.places));
                println!(
                    "{argument}\t{}\t{:?}\t{}\t{}",
                    checker.id,
                    issue.level,
                    issue.description,
                    place.unwrap_or_default()
                );
            }
        }
    }
    Ok(())
}
