//! A bundle in Rust, built outside of this workspace with the SDK of a checkout.

use std::path::{Path, PathBuf};

use qcbus_messages::path_text::to_text;

use super::Layout;
use crate::commands::manifests::{Refusal, usage};
use crate::commands::settings::absolute;

/// Directory in which this program was built.
const BUILT_AT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Paths of the files and their templates.
const TEMPLATES: [(&str, &str); 8] = [
    ("Cargo.toml", include_str!("rust/Cargo.toml.in")),
    ("README.md", include_str!("rust/README.md.in")),
    (".gitignore", include_str!("rust/gitignore.in")),
    ("src/main.rs", include_str!("rust/main.rs.in")),
    ("src/model.rs", include_str!("rust/model.rs.in")),
    ("src/rules/mod.rs", include_str!("rust/rules.rs.in")),
    (
        "src/rules/driving_lane_width.rs",
        include_str!("rust/driving_lane_width.rs.in"),
    ),
    (
        "src/rules/driving_lane_width.md",
        include_str!("rust/driving_lane_width.md.in"),
    ),
];

/// Returns the files of a bundle with this name.
pub(super) fn layout(name: &str, sdk: Option<&Path>) -> Result<Layout, Refusal> {
    let begins = name.starts_with(|c: char| c.is_ascii_alphabetic());
    let good = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if !begins || !name.chars().all(good) {
        return Err(usage(format!(
            "`{name}` is not a valid crate name: begin with a letter, and use A-Z a-z 0-9 _ -"
        )));
    }
    let sdk = checkout(sdk)?;
    let Some(sdk_text) = sdk.to_str().filter(|it| !it.contains(['"', '\\'])) else {
        let shown = to_text(&sdk);
        return Err(usage(format!(
            "{shown}: Cargo.toml cannot contain this path"
        )));
    };
    let ident = name.replace('-', "_").to_ascii_lowercase();
    let fill = |text: &str| {
        text.replace("{{name}}", name)
            .replace("{{ident}}", &ident)
            .replace("{{sdk}}", sdk_text)
    };
    let mut files: Vec<(&'static str, String)> = TEMPLATES
        .iter()
        .map(|(path, text)| (*path, fill(text)))
        .collect();
    // The bundle uses the compiler and the versions with which the SDK is tested.
    for shared in ["rust-toolchain.toml", "Cargo.lock"] {
        if let Ok(text) = std::fs::read_to_string(sdk.join(shared)) {
            files.push((shared, text));
        }
    }
    let next = format!(
        "  cargo test\n  cargo build --release\n  qcbus bundle add {name} target/release/{name}"
    );
    Ok(Layout { files, next })
}

/// Returns the named checkout that contains the SDK, else the one that this program was built from.
fn checkout(named: Option<&Path>) -> Result<PathBuf, Refusal> {
    let path = named.map_or_else(|| PathBuf::from(BUILT_AT), absolute);
    let has_the_sdk = path.join("bundles/sdk/Cargo.toml").is_file();
    let path = path.canonicalize().unwrap_or(path);
    if has_the_sdk {
        return Ok(path);
    }
    let shown = to_text(&path);
    Err(usage(match named {
        Some(_) => format!("{shown} is not a checkout of qcbus: it has no bundles/sdk"),
        None => format!(
            "the crates of qcbus are not published, and the checkout that this program was built from is no \
             longer at {shown}; name one with --sdk DIR"
        ),
    }))
}
