//! Targets whose tests are switched off must have none. Each would be linked and run for nothing.

use cargo_metadata::Target;

use super::{metadata, sources};

/// First words of a block in a documentation comment that rustdoc compiles.
const COMPILED: &[&str] = &[
    "",
    "rust",
    "no_run",
    "should_panic",
    "compile_fail",
    "edition2024",
];

#[test]
fn targets_that_are_not_tested_have_no_tests() {
    let mut wrong = Vec::new();
    for package in metadata().packages {
        let directory = package.manifest_path.parent().unwrap().join("src");
        let of_lib = |target: &&Target| target.is_lib();
        let Some(lib) = package.targets.iter().find(of_lib) else {
            continue;
        };
        let bins = package.targets.iter().filter(|target| target.is_bin());
        for (file, text) in sources(directory.as_std_path()) {
            let bin = bins.clone().find(|bin| bin.src_path.as_std_path() == file);
            let is_tested = bin.unwrap_or(lib).test;
            if !is_tested && text.contains("#[test]") {
                wrong.push(format!("{} has a test", file.display()));
            }
            if bin.is_none() && !lib.doctest && has_doctest(&text) {
                wrong.push(format!("{} has an example", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns whether a documentation comment has a block of Rust code.
fn has_doctest(text: &str) -> bool {
    let doc = text.lines().filter_map(|line| {
        let line = line.trim_start();
        line.strip_prefix("///").or(line.strip_prefix("//!"))
    });
    let fences = doc.filter_map(|line| line.trim().strip_prefix("```"));
    // Every second fence ends a block.
    let mut openings = fences.step_by(2);
    openings.any(|words| COMPILED.contains(&words.split(',').next().unwrap_or_default()))
}

#[test]
fn examples_are_recognised() {
    assert!(has_doctest("/// Text.\n///\n/// ```\n/// f();\n/// ```\n"));
    assert!(has_doctest("//! ```no_run\n//! f();\n//! ```\n"));
    assert!(!has_doctest(
        "/// ```text\n/// f();\n/// ```\nlet a = \"```\";\n"
    ));
}
