//! Building blocks of a random world: files, contents, bundles.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_configuration::InForce;
use qcbus_document::FileKind;
use qcbus_formats::pool::RuleUids;
use qcbus_formats::xqar::{Issue, Level};
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::{Catalogue, CheckerInfo, Digest, Hello, PROTOCOL_VERSION, Role};
use qcbus_types::{ChildSpec, RequiredBundle, RequiredSet, Restart, VersionDigest};

use super::super::*;

pub const CAPACITY: usize = 2;

/// Name of the bundle that a manifest adds. The other bundles join by hand.
pub const CHILD: &str = "Child";

/// Returns the first message of a bundle's process.
pub fn hello(session: SessionId, name: &str, version: u8, launch: Option<u64>) -> Hello {
    Hello {
        protocol: PROTOCOL_VERSION,
        role: Role::Bundle,
        name: name.to_owned(),
        version: version.to_string(),
        incarnation: session.0,
        pid: u32::try_from(session.0).unwrap() + 1000,
        launch,
        capacity: u16::try_from(CAPACITY).unwrap(),
        threads: 1,
    }
}

pub fn child(version: u8) -> ChildSpec {
    ChildSpec {
        name: CHILD.to_owned(),
        role: Role::Bundle,
        version: Some(version.to_string()),
        command: vec!["child".to_owned()],
        restart: Restart::Always,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

/// Name of the bundle that the shadow's manifest adds. It checks files but does not affect verdicts.
pub const SHADOW: &str = "Shadow";

pub fn shadow(version: u8) -> ChildSpec {
    ChildSpec {
        name: SHADOW.to_owned(),
        shadow: true,
        ..child(version)
    }
}

pub fn fresh_state(generation: u64, configuration: u8) -> State {
    let in_force = InForce::new(None, SearchPath::default()).unwrap();
    let settings = Settings {
        generation,
        numbers: generation,
        collect: Duration::ZERO,
        max_active: 4,
        max_preparing: 2,
        max_storing: 2,
        max_findings_bytes: 1000,
        // Bundles change all the time in random worlds. `flapping.rs` tests the effect of such changes.
        changes_forgiven: u32::MAX,
        ..Settings::default()
    };
    State::new(settings, digest(configuration.into()), in_force.demand())
}

/// Returns a required set in a form that can be compared.
pub fn named(required_set: &RequiredSet) -> Vec<(String, Option<VersionDigest>)> {
    let required_bundle = |it: &RequiredBundle| (it.name.clone(), it.version_digest);
    required_set.0.iter().map(required_bundle).collect()
}

/// Returns the path of a file. Files 0 to 5 are checked. Files 6 and 7 are only dependencies of
/// them. Later files are known only to clients that ask for them. File 10 is a part of these.
pub fn path_of(file: u8) -> Arc<Path> {
    let ending = if matches!(file, 6 | 7 | 10) {
        "part"
    } else {
        "xodr"
    };
    Path::new(&format!("/farm/{file}.{ending}")).into()
}

/// Returns the dependencies of a verdict besides the file itself. They are a file with its own
/// verdict, a private part, a shared part, all of these, or none.
pub fn dependencies_of(file: u8) -> &'static [u8] {
    match file {
        1 => &[0, 6],
        2 => &[6],
        3 => &[4],
        5 => &[4, 6, 7],
        8 => &[10],
        9 => &[0, 10],
        _ => &[],
    }
}

pub fn file_of(path: &Path) -> u8 {
    path.file_stem()
        .and_then(|it| it.to_str())
        .and_then(|it| it.parse().ok())
        .unwrap()
}

pub fn stamp(number: u64) -> Stamp {
    Stamp {
        size: number,
        mtime_ns: i128::from(number),
        ctime_ns: i128::from(number),
        inode: 1,
    }
}

pub fn digest(number: u64) -> Digest {
    let mut digest = Digest::default();
    digest.0[..8].copy_from_slice(&number.to_le_bytes());
    digest
}

/// Contents with this number or a higher one have an error.
pub const BAD: u64 = 1 << 40;

/// Checks whether the bytes with this digest have an error.
pub fn is_bad(digest: Digest) -> bool {
    let first = digest.0.first_chunk().copied();
    first.is_some_and(|it| u64::from_le_bytes(it) >= BAD)
}

pub fn basis(inputs: &[Input]) -> Digest {
    let mut basis = Digest::default();
    for (at, input) in inputs.iter().enumerate() {
        if let Some(digest) = input.digest() {
            basis.0[at * 8..][..8].copy_from_slice(&digest.0[..8]);
        }
    }
    basis
}

pub fn catalogue(name: &str) -> Catalogue {
    let checker = |id: String| CheckerInfo {
        id: id.into(),
        description: "".into(),
        rule_uids: RuleUids::default(),
        kinds: vec![FileKind::Xodr],
        default_on: true,
        level: Level::Error,
        params: Vec::new(),
    };
    Catalogue {
        alias: name.to_lowercase(),
        kinds: vec![FileKind::Xodr],
        checkers: vec![
            checker(format!("{name}.one")),
            checker(format!("{name}.two")),
        ],
        ..Catalogue::default()
    }
}

pub fn finding() -> Issue {
    Issue {
        id: 0,
        description: "too much".to_owned(),
        level: Level::Warning,
        rule_uid: String::new(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}
