//! The sources that a start reads, and the changes that a reload applies.

use qcbus_types::Restart;

use super::*;

fn sources(directory: &Path) -> Sources {
    Sources {
        config: Some(directory.join("config.xml")),
        lasting: true,
        bundles_d: Some(directory.join("bundles.d")),
        own_verdicts: false,
        choice: Default::default(),
        strict: false,
        all: false,
        standard: vec![child("xodrBundle")],
        reporters: vec![child("qc-report-text")],
        known: Known::default(),
        adapter: Adapter::default(),
    }
}

fn child(name: &str) -> ChildSpec {
    ChildSpec {
        name: name.to_owned(),
        role: Role::Bundle,
        version: None,
        command: vec!["program".to_owned()],
        restart: Restart::Always,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

fn put(directory: &Path, config: &str, manifests: &[(&str, &str)]) {
    let bundles_d = directory.join("bundles.d");
    let _ = std::fs::remove_dir_all(&bundles_d);
    std::fs::create_dir(&bundles_d).unwrap();
    std::fs::write(directory.join("config.xml"), config).unwrap();
    for (name, text) in manifests {
        std::fs::write(bundles_d.join(name), text).unwrap();
    }
}

fn manifest(name: &str, mode: &str) -> String {
    format!(
        r#"{{"module": [{{"name": "{name}", "exec_type": "executable", "mode": "{mode}",
        "module_type": "checker_bundle", "exec_command": "/opt/{name}"}}]}}"#
    )
}

const CONFIG: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\"/>\n</Config>\n";

#[test]
fn start_reads_configuration_and_every_manifest() {
    let dir = tempfile::tempdir().unwrap();
    let mine = manifest("mine", "bus");
    let theirs = manifest("theirs", "once").replace("checker_bundle", "report_module");
    let hidden = (".hidden.json", "no manifest at all");
    put(
        dir.path(),
        CONFIG,
        &[("a.json", &mine), ("b.json", &theirs), hidden],
    );
    let loaded = sources(dir.path()).load().unwrap();
    let names: Vec<&str> = loaded.children.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["xodrBundle", "mine"], "{:?}", loaded.notices);
    assert!(loaded.notices.iter().any(|it| it.contains("theirs")));
    assert_eq!(loaded.config.unwrap().bundles.len(), 1);
}

#[test]
fn unreadable_configuration_is_refused_as_a_whole() {
    let dir = tempfile::tempdir().unwrap();
    put(dir.path(), "<Config>", &[]);
    assert!(matches!(
        sources(dir.path()).load(),
        Err(LoadError::Config(_))
    ));
    put(dir.path(), CONFIG, &[("a.json", "{")]);
    assert!(matches!(
        sources(dir.path()).load(),
        Err(LoadError::Manifest(_))
    ));
}

#[test]
fn changes_are_listed_line_by_line() {
    let dir = tempfile::tempdir().unwrap();
    let sources = sources(dir.path());
    let (mine, yours) = (manifest("mine", "bus"), manifest("yours", "bus"));
    put(dir.path(), CONFIG, &[("a.json", &mine)]);
    let old = sources.load().unwrap();
    assert_eq!(sources.fingerprint(&old.read), old.read);
    assert_eq!(differences(&old, &old), Vec::<String>::new());
    let config = CONFIG.replace("xodrBundle", "xoscBundle");
    put(dir.path(), &config, &[("b.json", &yours)]);
    assert_ne!(sources.fingerprint(&old.read), old.read);
    let mut lines = differences(&old, &sources.load().unwrap());
    lines.sort();
    let expected = [
        "added yours",
        "removed mine",
        "xodrBundle is no longer required",
        "xoscBundle is required",
    ];
    assert_eq!(lines, expected);
}

#[test]
fn configuration_without_names_requires_everything() {
    let dir = tempfile::tempdir().unwrap();
    let sources = sources(dir.path());
    let chosen = "<Config>\n  <CheckerBundle application=\"xodrBundle\">\n    \
                  <Checker checkerId=\"a\" maxLevel=\"1\" minLevel=\"3\"/>\n  \
                  </CheckerBundle>\n</Config>\n";
    put(dir.path(), chosen, &[]);
    let old = sources.load().unwrap();
    for (config, expected) in [
        (
            CONFIG,
            "xodrBundle: every checker is required, because none is named",
        ),
        (
            "<Config>\n</Config>\n",
            "every bundle is required, because none is named",
        ),
    ] {
        put(dir.path(), config, &[]);
        assert_eq!(differences(&old, &sources.load().unwrap()), [expected]);
    }
}

#[test]
fn manifest_listed_by_another_is_watched() {
    let dir = tempfile::tempdir().unwrap();
    let sources = sources(dir.path());
    let listed = dir.path().join("mine.manifest");
    std::fs::write(&listed, manifest("mine", "bus")).unwrap();
    let list = format!(r#"{{"manifest_file_path": ["{}"]}}"#, listed.display());
    put(dir.path(), CONFIG, &[("all.json", &list)]);
    let old = sources.load().unwrap();
    assert!(old.children.iter().any(|it| it.name == "mine"));
    assert_eq!(sources.fingerprint(&old.read), old.read);
    std::fs::write(&listed, manifest("another", "bus")).unwrap();
    assert_ne!(sources.fingerprint(&old.read), old.read);
}

#[test]
fn child_with_replaced_program_counts_as_changed() {
    let dir = tempfile::tempdir().unwrap();
    let sources = sources(dir.path());
    let program = dir.path().join("mine");
    let mine = manifest("mine", "bus").replace("/opt/mine", &program.to_string_lossy());
    put(dir.path(), CONFIG, &[("a.json", &mine)]);
    let missing = sources.load().unwrap();
    std::fs::write(&program, "one").unwrap();
    assert_ne!(
        sources.fingerprint(&missing.read),
        missing.read,
        "the program exists now"
    );
    let old = sources.load().unwrap();
    assert_eq!(sources.fingerprint(&old.read), old.read);
    let aside = dir.path().join("aside");
    std::fs::write(&aside, "two").unwrap();
    std::fs::rename(&aside, &program).unwrap();
    assert_ne!(sources.fingerprint(&old.read), old.read);
    let new = sources.load().unwrap();
    assert_eq!(differences(&old, &new), ["changed mine"]);
    let digest = |loaded: &Loaded| loaded.children.last().unwrap().digest();
    assert_ne!(digest(&old), digest(&new));
    assert_eq!(
        old.children[0], new.children[0],
        "the bundles of qcbus itself are unchanged"
    );
}

#[test]
fn missing_manifest_directory_removes_no_bundle() {
    let dir = tempfile::tempdir().unwrap();
    let sources = sources(dir.path());
    let (bundles_d, aside) = (dir.path().join("bundles.d"), dir.path().join("aside"));
    let mine = manifest("mine", "bus");
    put(dir.path(), CONFIG, &[("a.json", &mine)]);
    let old = sources.load().unwrap();
    let still_has = || sources.still_has(&old, &sources.load().unwrap());
    assert_eq!(still_has(), Ok(()));
    std::fs::rename(&bundles_d, &aside).unwrap();
    assert!(still_has().is_err(), "gone");
    std::fs::create_dir(&bundles_d).unwrap();
    assert!(still_has().is_err(), "an empty directory in its place");
    std::fs::write(bundles_d.join("b.json"), &mine).unwrap();
    assert_eq!(still_has(), Ok(()), "another manifest in its place");
    std::fs::remove_dir_all(&bundles_d).unwrap();
    std::fs::rename(&aside, &bundles_d).unwrap();
    std::fs::remove_file(bundles_d.join("a.json")).unwrap();
    assert_eq!(still_has(), Ok(()), "a manifest was removed on purpose");
}

#[test]
fn duplicate_or_reserved_name_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let sources = sources(dir.path());
    let (mine, standard) = (manifest("mine", "bus"), manifest("xodrBundle", "bus"));
    let own = manifest("qcbus", "bus");
    let cases = [
        vec![("a.json", &*mine), ("b.json", &*mine)],
        vec![("a.json", &*standard)],
        vec![("a.json", &*own)],
    ];
    for manifests in cases {
        put(dir.path(), CONFIG, &manifests);
        let refused = sources.load().unwrap_err().to_string();
        assert!(refused.contains("another name"), "{refused}");
    }
}

#[test]
fn file_that_only_resembles_manifest_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let mine = manifest("mine", "bus");
    put(dir.path(), CONFIG, &[("mine.JSON", &mine), (".hidden", "")]);
    let notices = sources(dir.path()).load().unwrap().notices;
    let said: Vec<&String> = notices
        .iter()
        .filter(|it| it.contains("not a manifest"))
        .collect();
    assert!(
        matches!(said[..], [one] if one.contains("mine.JSON")),
        "{notices:?}"
    );
}

#[test]
fn bundle_without_bus_mode_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let once = manifest("mine", "once");
    put(dir.path(), CONFIG, &[("a.json", &once)]);
    let refused = sources(dir.path()).load().unwrap_err().to_string();
    assert!(refused.contains("mode"), "{refused}");
}
