//! A bundle that behaves correctly, with two rules written like real ones. Other tests use it as
//! "one more bundle".

mod no_blank_values;
mod root_has_children;

use std::ffi::OsString;
use std::process::ExitCode;

use qcbus_document::FileKind;
use qcbus_sdk::{AnyRule, Bundle, Mode, Version, basic};

use crate::Args;

/// Name of the bundle.
pub const NAME: &str = "polite";

static RULES: &[&dyn AnyRule] = qcbus_sdk::rules! {
    polite root_has_children "example.org:xodr:1.0.0:polite.root_has_children",
    polite no_blank_values "example.org:xodr:1.0.0:polite.no_blank_values",
};

/// The bundle.
pub static BUNDLE: Bundle = Bundle {
    name: NAME,
    alias: NAME,
    version: "1.0.0",
    description: "two harmless checkers",
    standard: "OpenDRIVE",
    kinds: &[FileKind::Xodr, FileKind::Xosc],
    versions: &[Version::new(1, 8)],
    reads: qcbus_sdk::Reads::Written,
    version_of: |document| basic::version_of(document, "header"),
    rules: RULES,
};

/// Runs the bundle under the requested name and version.
pub fn run(args: Args) -> ExitCode {
    let bundle: &'static Bundle = Box::leak(Box::new(Bundle {
        name: args.name.clone().map_or(NAME, leak),
        version: leak(args.version.clone()),
        ..BUNDLE
    }));
    match Mode::parse(bus_arguments(args)) {
        Ok(mode) => qcbus_sdk::run(bundle, mode).into(),
        Err(error) => {
            crate::complain(&error.to_string());
            ExitCode::from(2)
        }
    }
}

/// Leaks a text, because the texts of a bundle live as long as its process.
fn leak(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}

fn bus_arguments(args: Args) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = match args.instance_dir {
        Some(dir) => vec!["--instance-dir".into(), dir.into()],
        None => vec!["--instance".into(), args.instance.into()],
    };
    if let Some(launch) = args.launch {
        arguments.extend(["--launch".into(), launch.to_string().into()]);
    }
    if args.die_with_parent {
        arguments.push("--die-with-parent".into());
    }
    arguments
}

#[cfg(test)]
mod tests {
    #[test]
    fn rule_pages_are_consistent() {
        qcbus_rule_tests::pages::assert_pages(
            &super::BUNDLE,
            &[],
            concat!(env!("CARGO_MANIFEST_DIR"), "/src/polite"),
        );
    }
}
