//! Tests of manifests: their values and their error messages.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use qcbus_formats::manifest::{
    May, Mode, Module, ModuleType, Sources, expand, load, parse_modules,
};

const MODULE: &str = r#"{ "module": [
  { "name": "mine", "exec_type": "executable", "module_type": "checker_bundle",
    "exec_command": "mine -c $ASAM_QC_FRAMEWORK_CONFIG_FILE", "mode": "bus",
    "qcbus.memory_mb": 512, "qcbus.kinds": "xodr", "else": [] },
  { "name": "mine", "exec_type": "executable", "module_type": "report_module",
    "exec_command": "report" } ] }"#;

fn variable(name: &str) -> Option<String> {
    (name == "HERE").then(|| String::from("/etc/qc"))
}

fn load_from(files: &[(&str, &str)], path: &str) -> Result<Vec<Module>, String> {
    let files: HashMap<PathBuf, Vec<u8>> = files
        .iter()
        .map(|(path, text)| (path.into(), text.as_bytes().to_vec()))
        .collect();
    let read = |path: &Path| {
        files
            .get(path)
            .cloned()
            .ok_or_else(|| String::from("no such file"))
    };
    load(
        Path::new(path),
        &Sources {
            read: &read,
            variable: &variable,
        },
    )
    .map_err(|error| error.to_string())
}

#[test]
fn framework_manifest_leads_to_its_modules() {
    let framework = r#"{"manifest_file_path": ["$HERE/a.json", "${HERE}/b.json"]}"#;
    let empty = r#"{"module": []}"#;
    let files = [
        ("f.json", framework),
        ("/etc/qc/a.json", MODULE),
        ("/etc/qc/b.json", empty),
    ];
    let modules = load_from(&files, "f.json").unwrap();
    assert_eq!(
        modules.len(),
        2,
        "a bundle and a report may have the same name"
    );
    assert_eq!(modules[0].mode, Mode::Bus);
    assert_eq!(modules[0].module_type, ModuleType::CheckerBundle);
    assert_eq!(modules[0].manifest, Path::new("/etc/qc/a.json"));
    let extra = [
        ("qcbus.kinds".into(), "xodr".into()),
        ("qcbus.memory_mb".into(), "512".into()),
    ];
    assert_eq!(modules[0].extra, extra);
    assert_eq!(modules[1].mode, Mode::Once);
    assert_eq!(load_from(&files, "/etc/qc/a.json").unwrap(), modules);
}

#[test]
fn known_variables_are_expanded_and_unknown_ones_kept() {
    for (text, expanded) in [
        ("$HERE/x", "/etc/qc/x"),
        ("a${HERE}b", "a/etc/qcb"),
        ("$HEREx", "$HEREx"),
        ("${HERE", "${HERE"),
        ("cost: 5$", "cost: 5$"),
        ("$$HERE", "$/etc/qc"),
        ("${NOPE}/ä$", "${NOPE}/ä$"),
    ] {
        assert_eq!(expand(text, &variable), expanded);
    }
}

#[test]
fn manifest_errors_name_file_and_key() {
    let module = |keys: &str| format!(r#"{{"module": [{{{keys}}}]}}"#);
    let bundle = r#""name": "a", "exec_type": "executable", "module_type": "checker_bundle""#;
    let cases = [
        String::from("{ \"module\": [ }"),
        String::from("[]"),
        String::from("{}"),
        String::from(r#"{"modules": []}"#),
        String::from(r#"{"module": {}}"#),
        String::from(r#"{"module": [1]}"#),
        String::from(r#"{"manifest_file_path": "a.json"}"#),
        String::from(r#"{"manifest_file_path": [1]}"#),
        String::from(r#"{"manifest_file_path": ["$HERE/gone.json"]}"#),
        module(bundle),
        module(&format!(r#"{bundle}, "exec_comand": "x""#)),
        module(&format!(r#"{bundle}, "exec_command": """#)),
        module(&format!(r#"{bundle}, "exec_command": "x", "mode": "buss""#)),
        module(r#""name": "a", "exec_type": "library""#),
        module(r#""name": "a", "exec_type": "executable", "module_type": "checker-bundle""#),
        format!(
            r#"{{"module": [{{{bundle}, "exec_command": "x"}}, {{{bundle}, "exec_command": "y"}}]}}"#
        ),
    ];
    let told = cases
        .iter()
        .map(|text| load_from(&[("m.json", text)], "m.json").unwrap_err());
    let mut told: Vec<String> = told.collect();
    told.push(load_from(&[], "none.json").unwrap_err());
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn byte_order_mark_in_manifest_is_accepted() {
    let text = format!("\u{FEFF}{MODULE}");
    assert_eq!(
        parse_modules(Path::new("m.json"), text.as_bytes())
            .unwrap()
            .len(),
        2
    );
}

#[test]
fn only_checker_bundle_can_be_shadow() {
    let of = |module_type: &str, shadow: &str| {
        let text = format!(
            r#"{{"module": [{{"name": "a", "exec_type": "executable", "module_type": "{module_type}",
                "exec_command": "x"{shadow}}}]}}"#
        );
        let loaded = load_from(&[("m.json", &text)], "m.json");
        loaded.map(|mut modules| modules.remove(0).shadow)
    };
    let shadow = r#", "shadow": true"#;
    assert_eq!(of("checker_bundle", ""), Ok(false));
    assert_eq!(of("checker_bundle", shadow), Ok(true));
    let error = of("report_module", shadow).unwrap_err();
    assert!(
        error.contains("`module[0].shadow` is only allowed for checker bundles"),
        "{error}"
    );
    let error = of("checker_bundle", r#", "shadow": "yes""#).unwrap_err();
    assert!(error.contains("is neither true nor false"), "{error}");
}

#[test]
fn module_permissions_are_read_or_refused() {
    let of = |may: &str| {
        let text = format!(
            r#"{{"module": [{{"name": "a", "exec_type": "executable", "module_type": "checker_bundle",
                "exec_command": "x"{may}}}]}}"#
        );
        let loaded = load_from(&[("m.json", &text)], "m.json");
        loaded.map(|mut modules| modules.remove(0).may)
    };
    assert_eq!(of(""), Ok(May::default()));
    let all =
        r#", "may": {"read": ["/a", "/b"], "write": ["/c"], "network": true, "programs": true}"#;
    let may = of(all).unwrap();
    assert_eq!(may.read, [Path::new("/a"), Path::new("/b")]);
    assert_eq!(may.write, [Path::new("/c")]);
    assert!(may.network && may.programs);
    for (wrong, reason) in [
        (r#""may": true"#, "`module[0].may` is not an object"),
        (
            r#""may": {"netwrok": true}"#,
            "`module[0].may.netwrok` is not one of",
        ),
        (r#""may": {"network": "yes"}"#, "is neither true nor false"),
        (r#""may": {"read": "/a"}"#, "is not a list of paths"),
        (
            r#""may": {"write": ["a"]}"#,
            "`module[0].may.write[0]` is not an absolute path",
        ),
    ] {
        let error = of(&format!(", {wrong}")).unwrap_err();
        assert!(error.contains(reason), "{wrong}: {error}");
    }
}
