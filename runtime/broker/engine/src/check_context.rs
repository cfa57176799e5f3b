//! Conditions under which a broker checks files. A run of `check` uses them to decide whether a
//! running broker would find the same as itself.

use qcbus_messages::Digest;
use qcbus_messages::control::CheckContext;
use qcbus_types::{ChildSpec, Settings};
use sha2::{Digest as _, Sha256};

use crate::options::Options;

/// Option that is removed from a bundle's command with its value, because it does not change the findings.
const WITHOUT: &str = "--threads";

/// Returns the check context of a broker with these `options` and a configuration of this digest.
/// `children` are those that it starts. Only brokers of the same program are comparable, because
/// the digests cover the debug format of its types.
pub fn check_context(options: &Options, config: Digest, children: &[ChildSpec]) -> CheckContext {
    let general = format!(
        "{config}{:?}{:?}{:?}{:?}{}",
        options.dialect,
        options.sandbox,
        options.memory_limit,
        options.limits,
        of_settings(&options.settings)
    );
    let bundles = children.iter().filter(|it| it.judges());
    CheckContext {
        general: digest(&general),
        bundles: bundles
            .map(|spec| (spec.name.clone(), digest(&how_started(spec))))
            .collect(),
    }
}

/// Returns why a broker with context `ours` may find other results than `asked`, for the user.
pub fn differs(ours: &CheckContext, asked: &CheckContext) -> Option<&'static str> {
    if ours.general != asked.general {
        return Some("it uses another configuration, other limits or another form of results");
    }
    let same = |(name, digest): (&String, &String)| ours.bundles.get(name) == Some(digest);
    if asked.bundles.is_empty() || !asked.bundles.iter().all(same) {
        return Some("it does not have the same bundles, or starts them differently");
    }
    None
}

fn of_settings(settings: &Settings) -> String {
    let Settings {
        job_deadline,
        silence_limit,
        max_issues,
        max_facts,
        max_pending_bytes,
        max_text,
        room_limit,
        ..
    } = settings;
    let limits = [max_issues, max_facts, max_pending_bytes, max_text];
    format!("{job_deadline:?}{silence_limit:?}{room_limit:?}{limits:?}")
}

fn how_started(spec: &ChildSpec) -> String {
    let mut command = spec.command.clone();
    if let Some(at) = command.iter().position(|it| it == WITHOUT) {
        command.drain(at..command.len().min(at + 2));
    }
    format!("{:?}{command:?}{:?}", spec.version, spec.may)
}

fn digest(text: &str) -> String {
    Digest(Sha256::digest(text).into()).to_string()
}

#[cfg(test)]
mod tests {
    use qcbus_formats::manifest::May;
    use qcbus_messages::Role;

    use super::*;
    use qcbus_types::Restart;

    fn spec(name: &str, arguments: &[&str]) -> ChildSpec {
        ChildSpec {
            name: name.to_owned(),
            role: Role::Bundle,
            version: Some("1".to_owned()),
            command: arguments.iter().map(|it| (*it).to_owned()).collect(),
            restart: Restart::Always,
            may: May::default(),
            programs: Vec::new(),
            shadow: false,
            slow_start: false,
        }
    }

    fn of(bundles: &[ChildSpec]) -> CheckContext {
        let digests = bundles
            .iter()
            .map(|it| (it.name.clone(), digest(&how_started(it))));
        CheckContext {
            general: String::new(),
            bundles: digests.collect(),
        }
    }

    #[test]
    fn bundles_started_differently_have_different_check_context() {
        let ours = of(&[spec("a", &["a", "--threads", "4"]), spec("b", &["b"])]);
        let same = [spec("a", &["a"])];
        assert_eq!(differs(&ours, &of(&same)), None);
        let others = [
            vec![],
            vec![spec("c", &["c"])],
            vec![spec("a", &["a", "--schema-dir", "x"])],
            vec![ChildSpec {
                version: Some("2".to_owned()),
                ..spec("a", &["a"])
            }],
            vec![spec("a", &["a"]), spec("c", &["c"])],
        ];
        for other in others {
            assert!(differs(&ours, &of(&other)).is_some(), "{other:?}");
        }
        let other = CheckContext {
            general: "other".to_owned(),
            ..of(&same)
        };
        assert!(differs(&ours, &other).is_some());
    }
}
