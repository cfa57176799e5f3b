//! Tests of user schemas: the files that make one schema, the files that it is for, and the errors
//! for unusable ones.

use std::path::Path;

use crate::support::{image, open};
use qcbus_document::FileKind;
use qcbus_schema::{
    Options, Outcome, Override, SHIPPED, UserSchemaContent, UserSchemaFile, Version, check,
    user_schemas,
};

/// Makes schemas from files, given as path below the directory and text.
fn made(files: &[(&str, &str)]) -> Result<Vec<Override>, String> {
    let images: Vec<Vec<u8>> = files
        .iter()
        .map(|(path, text)| image(&format!("dir/{path}"), text))
        .collect();
    let paths: Vec<String> = files
        .iter()
        .map(|(path, _)| format!("dir/{path}"))
        .collect();
    let files: Vec<UserSchemaFile<'_>> = files
        .iter()
        .zip(images.iter().zip(&paths))
        .map(|((below, text), (image, path))| UserSchemaFile {
            path,
            below: Path::new(below),
            sha256: "5ca1ab1e",
            content: if below.ends_with(".tbl") {
                UserSchemaContent::Tables(text.as_bytes())
            } else {
                UserSchemaContent::Xsd(image)
            },
        })
        .collect();
    user_schemas(&files).map_err(|error| error.to_string())
}

fn xsd(body: &str) -> String {
    format!("<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\">\n{body}\n</xs:schema>")
}

fn root(name: &str) -> String {
    xsd(&format!("<xs:element name='{name}'/>"))
}

fn names(overrides: &[Override]) -> Vec<String> {
    let name = |one: &Override| {
        let version = one
            .version
            .map_or("*".to_owned(), |version| version.to_string());
        let files: Vec<&str> = one.sources.iter().map(|file| file.path.as_str()).collect();
        format!("{:?} {version}: {}", one.kind, files.join(" "))
    };
    overrides.iter().map(name).collect()
}

#[test]
fn schemas_that_include_each_other_become_single_schema() {
    let main =
        xsd("<xs:include schemaLocation='./parts.xsd'/>\n<xs:element name='OpenDRIVE' type='t'/>");
    let parts = xsd("<xs:complexType name='t'/>");
    let scenario = root("OpenSCENARIO");
    let files = [
        ("1.7/map.xsd", main.as_str()),
        ("1.7/parts.xsd", &parts),
        ("map.xsd", &main),
        ("parts.xsd", &parts),
        ("scenario_12.xsd", &scenario),
    ];
    assert_eq!(
        names(&made(&files).expect("the schemas are valid")),
        [
            "Xodr 1.7: dir/1.7/map.xsd dir/1.7/parts.xsd",
            "Xosc 1.2: dir/scenario_12.xsd",
            "Xodr *: dir/map.xsd dir/parts.xsd",
        ]
    );
}

#[test]
fn table_title_gives_its_version() {
    let shipped = SHIPPED
        .iter()
        .find(|one| one.version == Version { major: 1, minor: 4 });
    let notation = shipped.expect("OpenDRIVE 1.4").notation;
    let found = made(&[("own.tbl", notation)]).expect("the tables are valid");
    assert_eq!(names(&found), ["Xodr 1.4: dir/own.tbl"]);
}

#[test]
fn unusable_user_schema_is_reported_by_file_and_line() {
    let (drive, broken) = (root("OpenDRIVE"), xsd("<xs:import namespace='x'/>"));
    let (other, missing) = (root("otx"), xsd("<xs:include schemaLocation='gone.xsd'/>"));
    for (files, expected) in [
        (
            vec![("a.xsd", drive.as_str()), ("b.xsd", &broken)],
            "compile dir/b.xsd:2:1: <xs:import>: this construct is not supported here",
        ),
        (
            vec![("a.xsd", &missing)],
            "dir/a.xsd:2:1: <xs:include schemaLocation=\"gone.xsd\">",
        ),
        (vec![("a.xsd", "<xs:schema")], "dir/a.xsd:1:1"),
        (
            vec![("a.xsd", &other)],
            "dir/a.xsd: it declares neither <OpenDRIVE> nor",
        ),
        (
            vec![("a.xsd", &drive), ("b.xsd", &drive)],
            "dir/a.xsd and dir/b.xsd are both for every version of OpenDRIVE",
        ),
        (
            vec![("1.7/a.xsd", &drive), ("b-1.7.xsd", &drive)],
            "are both for OpenDRIVE 1.7",
        ),
        (
            vec![("a.tbl", "qcbus-schema 1\nnonsense")],
            "dir/a.tbl: failed to",
        ),
        (vec![("a.tbl", "qcbus-schema 1\nnonsense")], "line 2"),
    ] {
        let error = made(&files).expect_err(expected);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn schema_for_version_comes_before_general_schema() {
    let any = xsd("<xs:element name='OpenDRIVE'><xs:complexType/></xs:element>");
    let files = [
        ("any.xsd", any.as_str()),
        ("1.6/map.xsd", &root("OpenDRIVE")),
    ];
    let options = Options {
        overrides: made(&files).expect("the schemas are valid"),
        ..Options::default()
    };
    let used = |minor: u32| {
        let text = format!("<OpenDRIVE><header revMajor='1' revMinor='{minor}'/></OpenDRIVE>");
        let image = image("a.xodr", &text);
        match check(&open(&image), FileKind::Xodr, &options) {
            Outcome::Checked(checked) => (
                checked.provenance()[0].value.clone(),
                checked.violations.len(),
            ),
            Outcome::Skipped(reason) => panic!("{reason}"),
        }
    };
    assert_eq!(used(6), ("dir/1.6/map.xsd sha256:5ca1ab1e".to_owned(), 0));
    assert_eq!(used(7), ("dir/any.xsd sha256:5ca1ab1e".to_owned(), 1));
}

#[test]
fn result_names_shipped_schema_without_user_schema() {
    let image = image(
        "a.xodr",
        "<OpenDRIVE><header revMajor='1' revMinor='8'/></OpenDRIVE>",
    );
    let Outcome::Checked(checked) = check(&open(&image), FileKind::Xodr, &Options::default())
    else {
        panic!("the version is known");
    };
    assert_eq!(checked.provenance()[0].value, "OpenDRIVE 1.8.1");
}
