//! Brokers of other users: a command of the wrong user reports the right user.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Returns a readable name of a user.
pub(super) fn user(uid: u32) -> String {
    let users = std::fs::read_to_string("/etc/passwd").unwrap_or_default();
    match name_of(uid, &users) {
        Some(name) => format!("user `{name}` (uid {uid})"),
        None => format!("uid {uid}"),
    }
}

fn name_of(uid: u32, users: &str) -> Option<&str> {
    let mut lines = users.lines().map(|line| line.split(':'));
    lines.find_map(|mut fields| {
        let (name, id) = (fields.next()?, fields.nth(1)?);
        (id.parse() == Ok(uid)).then_some(name)
    })
}

/// Returns the owner of an instance's directory, or of its nearest visible parent directory.
pub(super) fn owner_of(directory: &Path) -> Option<u32> {
    let visible = directory.ancestors().find_map(|it| it.metadata().ok());
    visible.as_ref().map(Metadata::uid)
}

/// Returns the brokers of other users that serve an instance of this name, each as a text.
pub(super) fn brokers(instance: &str) -> Vec<String> {
    let own = rustix::process::geteuid().as_raw();
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let found = processes.filter_map(|process| {
        let pid: u32 = process.file_name().to_str()?.parse().ok()?;
        let uid = process.metadata().ok()?.uid();
        if uid == own {
            return None;
        }
        let line = std::fs::read(process.path().join("cmdline")).ok()?;
        let words = line.split(|byte| *byte == 0);
        let words: Vec<_> = words.map(String::from_utf8_lossy).collect();
        let words: Vec<&str> = words.iter().map(|it| &**it).collect();
        let is_it = served(&words) == Some(instance);
        is_it.then(|| format!("process {pid} of {}", user(uid)))
    });
    found.collect()
}

/// Returns the instance that a command line serves, or `None` if it is not the command line of a broker.
fn served<'w>(words: &[&'w str]) -> Option<&'w str> {
    let (program, rest) = words.split_first()?;
    let (command, rest) = rest.split_first()?;
    if Path::new(program).file_name()? != "qcbus" || *command != "serve" {
        return None;
    }
    let value = |option: &str| {
        let mut words = rest.iter().enumerate();
        words.find_map(|(at, word)| match word.strip_prefix(option)? {
            "" => rest.get(at + 1).copied(),
            value => value.strip_prefix('='),
        })
    };
    let directory = value("--instance-dir").and_then(|it| Path::new(it).file_name()?.to_str());
    directory
        .or_else(|| value("--instance"))
        .or(Some("default"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instance_is_read_from_broker_command_line() {
        let of = |line: &'static str| served(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(of("/usr/bin/qcbus serve in"), Some("default"));
        assert_eq!(of("qcbus serve --instance farm in"), Some("farm"));
        assert_eq!(of("qcbus serve in --instance=farm"), Some("farm"));
        assert_eq!(of("qcbus serve in --instance-dir /run/x"), Some("x"));
        assert_eq!(of("qcbus status --instance farm"), None);
        assert_eq!(of("sh serve in"), None);
    }

    #[test]
    fn user_without_name_is_shown_as_number() {
        let users = "root:x:0:0:root:/root:/bin/sh\nfarm:x:1001:1001::/:/bin/sh\n";
        assert_eq!(name_of(1001, users), Some("farm"));
        assert_eq!(name_of(7, users), None);
    }
}
