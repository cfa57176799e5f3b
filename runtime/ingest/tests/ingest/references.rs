//! References of a scenario to other files.

use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use qcbus_document::Document;
use qcbus_ingest::modular::SearchPath;
use qcbus_ingest::{Limits, Reference, prepare_bytes, references};
use qcbus_messages::{Absence, DocumentRole};

fn of(path: &Path, text: &str) -> Vec<Reference> {
    let image = prepare_bytes(path, text.into(), &Limits::default()).build();
    references(&Document::open(&image).unwrap(), &SearchPath::default())
}

fn map(filepath: &str) -> Reference {
    let text = format!(
        "<OpenSCENARIO><ParameterDeclarations><ParameterDeclaration name='map' value='maps/a.xodr'/>\
         <ParameterDeclaration name='ext' value='xodr'/></ParameterDeclarations>\
         <RoadNetwork><LogicFile filepath='{filepath}'/></RoadNetwork></OpenSCENARIO>"
    );
    let mut found = of(Path::new("/farm/s/x.xosc"), &text);
    assert_eq!(found.len(), 1);
    let reference = found.remove(0);
    assert!(text[reference.offset as usize..].starts_with("<LogicFile"));
    assert_eq!(
        (reference.role, &*reference.text),
        (DocumentRole::Map, filepath)
    );
    reference
}

#[test]
fn maps_are_relative_to_the_scenario() {
    for (filepath, expected) in [
        ("m/./a.xodr", &["/farm/s/m/a.xodr"][..]),
        ("/abs/a.xodr", &["/abs/a.xodr"]),
        ("a%20b.xodr", &["/farm/s/a%20b.xodr", "/farm/s/a b.xodr"]),
        ("m\\a.xodr", &["/farm/s/m\\a.xodr", "/farm/s/m/a.xodr"]),
        ("file:///abs/a.xodr", &["/abs/a.xodr"]),
        ("$map", &["/farm/s/maps/a.xodr"]),
        ("a.$ext", &["/farm/s/a.xodr"]),
        ("./Town05/map", &["/farm/s/Town05/map"]),
    ] {
        let reference = map(filepath);
        let expected: Vec<PathBuf> = expected.iter().map(PathBuf::from).collect();
        assert_eq!(reference.candidates, expected, "{filepath}");
        assert_eq!(reference.unresolved, None);
    }
}

/// Creates a directory with `s/x.xosc` to refer from, `maps/deep/`, a link to it, and
/// `maps/a.xodr`.
fn directories() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let root = directory.path().canonicalize().unwrap();
    fs::create_dir_all(root.join("maps/deep")).unwrap();
    fs::create_dir(root.join("s")).unwrap();
    fs::write(root.join("maps/a.xodr"), "<OpenDRIVE/>").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("../maps/deep", root.join("s/link")).unwrap();
    (directory, root)
}

#[test]
fn path_is_resolved_as_by_the_system() {
    let (_directory, root) = directories();
    let from = root.join("s/x.xosc");
    for (filepath, expected) in [
        ("../maps/a.xodr", "maps/a.xodr"),
        ("./../maps/deep/../a.xodr", "maps/a.xodr"),
        ("../maps/gone.xodr", "maps/gone.xodr"),
        #[cfg(unix)]
        ("link/../a.xodr", "s/link/../a.xodr"),
        #[cfg(unix)]
        ("link/a.xodr", "s/link/a.xodr"),
        // No file can be opened through a missing directory or through a file.
        ("../gone/../maps/a.xodr", "gone/../maps/a.xodr"),
        ("../gone/../../maps/a.xodr", "gone/../../maps/a.xodr"),
        ("../maps/a.xodr/../a.xodr", "maps/a.xodr/../a.xodr"),
    ] {
        let text = format!(
            "<OpenSCENARIO><RoadNetwork><LogicFile filepath='{filepath}'/></RoadNetwork></OpenSCENARIO>"
        );
        let found = of(&from, &text);
        assert_eq!(found[0].candidates, [root.join(expected)], "{filepath}");
    }
}

/// The directory existed when the scenario was read. It may exist again when the map is opened.
#[test]
fn missing_scenario_directory_still_resolves_paths() {
    let (_directory, root) = directories();
    let text = "<OpenSCENARIO><RoadNetwork><LogicFile filepath='../../maps/a.xodr'/></RoadNetwork></OpenSCENARIO>";
    let found = of(&root.join("moved/away/x.xosc"), text);
    assert_eq!(found[0].candidates, [root.join("maps/a.xodr")]);
}

#[test]
fn path_that_ends_as_a_directory_names_no_map() {
    for filepath in ["a.xodr/", "a.xodr/.", "maps/..", "a.xodr\\", "..", "."] {
        let reference = map(filepath);
        assert_eq!(reference.candidates, Vec::<PathBuf>::new(), "{filepath}");
        assert_eq!(reference.unresolved, Some(Absence::Directory), "{filepath}");
    }
}

#[test]
fn exclamation_mark_alone_makes_no_archive() {
    let text =
        "<OpenSCENARIO><RoadNetwork><LogicFile filepath='map.xodr'/></RoadNetwork></OpenSCENARIO>";
    let found = of(Path::new("/farm/NEW!/s.xosc"), text);
    assert_eq!(found[0].candidates, [PathBuf::from("/farm/NEW!/map.xodr")]);
}

#[test]
fn unresolvable_reference_gives_the_reason() {
    let unknown = Absence::Parameter {
        name: "unknown".to_owned(),
    };
    for (filepath, why) in [
        ("Town05", Absence::SimulatorMap),
        ("", Absence::EmptyPath),
        ("http://x/a.xodr", Absence::Remote),
        ("$unknown/a.xodr", unknown),
        ("${1+2}.xodr", Absence::Expression),
    ] {
        let reference = map(filepath);
        assert_eq!(reference.candidates, Vec::<PathBuf>::new());
        assert_eq!(reference.unresolved, Some(why), "{filepath}");
    }
}

#[test]
fn catalog_directories_are_listed() {
    let dir = tempfile::tempdir().unwrap();
    let catalogs = dir.path().join("catalogs");
    fs::create_dir(&catalogs).unwrap();
    for name in ["b.xosc", "a.xosc", "readme.txt"] {
        fs::write(catalogs.join(name), "").unwrap();
    }
    let text = "<OpenSCENARIO><CatalogLocations><VehicleCatalog><Directory path='./catalogs'/>\
                </VehicleCatalog><RouteCatalog><Directory path='nowhere'/></RouteCatalog>\
                </CatalogLocations></OpenSCENARIO>";
    let found = of(&dir.path().join("x.xosc"), text);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].role, DocumentRole::Catalog);
    assert_eq!(found[0].catalogs.as_deref(), Some("VehicleCatalog"));
    assert_eq!(
        found[0].candidates,
        [catalogs.join("a.xosc"), catalogs.join("b.xosc")]
    );
    assert_eq!(found[0].directory, Some(catalogs));
    assert_eq!(found[1].unresolved, Some(Absence::NotThere));
    assert_eq!(found[1].directory, Some(dir.path().join("nowhere")));
}

#[test]
fn distribution_refers_to_its_scenario() {
    let text = "<OpenSCENARIO xmlns:xsi='http://www.w3.org/2001/XMLSchema-instance' \
                xsi:noNamespaceSchemaLocation='http://x/OpenSCENARIO.xsd'>\
                <ParameterValueDistribution><ScenarioFile filepath='b/a.xosc'/>\
                </ParameterValueDistribution></OpenSCENARIO>";
    let found = of(Path::new("/farm/d/x.xosc"), text);
    assert_eq!(found.len(), 1, "schemas are never fetched");
    assert_eq!(
        (found[0].role, &found[0].candidates[0]),
        (DocumentRole::Scenario, &PathBuf::from("/farm/d/b/a.xosc"))
    );
}

#[test]
fn members_of_an_archive_are_found_inside_it() {
    let main = "<OpenSCENARIO><RoadNetwork><LogicFile filepath='m.xodr'/></RoadNetwork>\
                <ManeuverGroup><ScenarioReference scenarioFileName='lib.xosc'/></ManeuverGroup>\
                </OpenSCENARIO>";
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in [("main.xosc", main), ("lib.xosc", "<lib/>")] {
        writer
            .start_file(name, zip::write::SimpleFileOptions::default())
            .unwrap();
        writer.write_all(text.as_bytes()).unwrap();
    }
    let archive = writer.finish().unwrap().into_inner();
    let prepared = prepare_bytes(
        Path::new("/farm/x.mosc"),
        archive.clone(),
        &Limits::default(),
    );
    assert_eq!(prepared.path(), Path::new("/farm/x.mosc!main.xosc"));
    let image = prepared.build();
    let found = references(&Document::open(&image).unwrap(), &SearchPath::default());
    assert_eq!(found[0].candidates, [PathBuf::from("/farm/m.xodr")]);
    let member = PathBuf::from("/farm/x.mosc!lib.xosc");
    assert_eq!(found[1].role, DocumentRole::Scenario);
    assert_eq!(found[1].candidates, std::slice::from_ref(&member));

    let image = prepare_bytes(&member, archive, &Limits::default()).build();
    let document = Document::open(&image).unwrap();
    assert!(document.root().unwrap().is("lib"));
    assert_eq!(document.path(), "/farm/x.mosc!lib.xosc");
}

#[test]
fn too_many_catalogs_are_reported() {
    let dir = tempfile::tempdir().unwrap();
    for number in 0..=1000 {
        fs::write(dir.path().join(format!("{number}.xosc")), "").unwrap();
    }
    let text = "<OpenSCENARIO><CatalogLocations><VehicleCatalog><Directory path='.'/>\
                </VehicleCatalog></CatalogLocations></OpenSCENARIO>";
    let found = of(&dir.path().join("x.xosc"), text);
    assert_eq!(found[0].candidates.len(), 1000);
    assert_eq!(found[0].unresolved, Some(Absence::TooMany { most: 1000 }));
}
