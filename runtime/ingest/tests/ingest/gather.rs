//! The set of documents of a file, and the reports about missing ones.

use std::collections::HashMap;
use std::convert::Infallible;
use std::path::{Path, PathBuf};

use qcbus_document::Document;
use qcbus_formats::xqar::{Level, Location};
use qcbus_ingest::modular::{ExpandedImage, SearchPath};
use qcbus_ingest::{
    Limits, Look, Source, Walking, faults_of_root, gather, missing_references, prepare_bytes,
};
use qcbus_messages::{Absence, DocumentRole, MissingDocument};

/// Files in memory. All other files are missing.
#[derive(Default)]
struct Files {
    files: HashMap<PathBuf, &'static str>,
    kept: Vec<(PathBuf, DocumentRole)>,
    images: Vec<Vec<u8>>,
    looked: Vec<PathBuf>,
}

impl Source for Files {
    type Document = Vec<u8>;
    type Halt = Infallible;

    fn fetch(&mut self, path: &Path) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        Ok(self.files.get(path).map_or(Err(Absence::NotThere), |text| {
            Ok(prepare_bytes(path, text.as_bytes().to_vec(), &Limits::default()).build())
        }))
    }

    fn image(document: &Vec<u8>) -> &[u8] {
        document
    }

    fn listing(&mut self, _: &Path) -> Result<Option<Vec<u8>>, Infallible> {
        Ok(None)
    }

    fn expanded(
        &self,
        expanded: &ExpandedImage<'_, '_>,
    ) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        Ok(Ok(expanded.build()))
    }

    fn kept(&self, index: usize) -> &[u8] {
        &self.images[index]
    }

    fn keep(&mut self, path: &Path, role: DocumentRole, _: u32, image: Vec<u8>) {
        self.kept.push((path.to_owned(), role));
        self.images.push(image);
    }

    fn find(&self, path: &Path) -> Result<(), Absence> {
        let found = self.files.contains_key(path);
        found.then_some(()).ok_or(Absence::NotThere)
    }

    fn looked(&mut self, look: Look<'_>) {
        let (Look::NotHad(path) | Look::NotRead(path) | Look::Attached(path) | Look::Listed(path)) =
            look;
        self.looked.push(path.to_owned());
    }
}

fn gathered(
    text: &str,
    files: &[(&str, &'static str)],
    most: usize,
) -> (Files, Vec<MissingDocument>) {
    gathered_from("/farm/s/x.xosc", text, files, most)
}

fn gathered_from(
    path: &str,
    text: &str,
    files: &[(&str, &'static str)],
    most: usize,
) -> (Files, Vec<MissingDocument>) {
    let path = Path::new(path);
    let image = prepare_bytes(path, text.into(), &Limits::default()).build();
    let mut store = Files::default();
    store.files.extend(
        files
            .iter()
            .map(|(path, text)| (PathBuf::from(path), *text)),
    );
    let walking = Walking {
        max_documents: most,
        max_text: 1 << 20,
        max_image: 1 << 24,
        search: &SearchPath::default(),
    };
    let Ok(found) = gather(&Document::open(&image).unwrap(), &walking, &mut store);
    (store, found.missing)
}

const TWO_MAPS: &str = "<OpenSCENARIO><RoadNetwork><LogicFile filepath='a%20b.xodr'/>\
                        <LogicFile filepath='c.xodr'/></RoadNetwork></OpenSCENARIO>";

#[test]
fn first_existing_spelling_of_a_reference_is_used() {
    let (store, missing) = gathered(TWO_MAPS, &[("/farm/s/a b.xodr", "<OpenDRIVE/>")], 10);
    assert_eq!(
        store.kept,
        [(PathBuf::from("/farm/s/a b.xodr"), DocumentRole::Map)]
    );
    assert_eq!(missing.len(), 1);
    assert_eq!(
        (missing[0].reference.as_str(), missing[0].level),
        ("c.xodr", Level::Error)
    );
    let looked = ["/farm/s/a%20b.xodr", "/farm/s/c.xodr"].map(PathBuf::from);
    assert_eq!(
        store.looked, looked,
        "the watcher knows where a missing file may appear"
    );
}

#[test]
fn surface_grids_must_exist_and_are_not_read() {
    let map = "<OpenDRIVE><road><surface><CRG file='a.crg'/><CRG file='dir\\b.crg'/><CRG file=''/>\
               <CRG file='C:\\c.crg'/><CRG file='gone.crg'/></surface></road></OpenDRIVE>";
    let there = [("/farm/m/a.crg", "no XML"), ("/farm/m/dir/b.crg", "")];
    let (store, missing) = gathered_from("/farm/m/x.xodr", map, &there, 10);
    assert_eq!(store.kept, []);
    let missing: Vec<_> = missing
        .iter()
        .map(|it| (it.reference.as_str(), it.role, &it.why, it.level))
        .collect();
    let gone = (
        "gone.crg",
        DocumentRole::Attachment,
        &Absence::NotThere,
        Level::Error,
    );
    assert_eq!(missing, [gone], "rules report the empty path and the drive");
    let looked = ["a.crg", "dir\\b.crg", "dir/b.crg", "gone.crg"];
    let looked = looked.map(|name| PathBuf::from(format!("/farm/m/{name}")));
    assert_eq!(
        store.looked, looked,
        "all places where a grid is or may appear"
    );
}

#[test]
fn documents_above_the_limit_are_reported() {
    let both = [
        ("/farm/s/a b.xodr", "<OpenDRIVE/>"),
        ("/farm/s/c.xodr", "<OpenDRIVE/>"),
    ];
    let (store, missing) = gathered(TWO_MAPS, &both, 2);
    assert_eq!(store.kept.len(), 1);
    assert_eq!(
        (&missing[0].why, missing[0].level),
        (&Absence::TooMany { most: 2 }, Level::Warning)
    );
}

#[test]
fn broken_map_is_kept_and_reported() {
    let broken = [
        ("/farm/s/a b.xodr", "<OpenDRIVE>\n<road></OpenDRIVE>"),
        ("/farm/s/c.xodr", "<OpenDRIVE/>"),
    ];
    let (store, missing) = gathered(TWO_MAPS, &broken, 10);
    assert_eq!(store.kept.len(), 2);
    let Absence::Broken { path, row, .. } = &missing[0].why else {
        unreachable!("{missing:?}")
    };
    assert_eq!((path.as_str(), *row), ("/farm/s/a b.xodr", 2));
}

fn catalog(users: &str) -> String {
    format!(
        "<OpenSCENARIO><ParameterDeclarations><ParameterDeclaration name='p' value='V'/>\
         </ParameterDeclarations><CatalogLocations><VehicleCatalog><Directory path='/nowhere/v'/>\
         </VehicleCatalog></CatalogLocations><Entities><ScenarioObject name='a'>{users}\
         </ScenarioObject></Entities></OpenSCENARIO>"
    )
}

#[test]
fn level_of_a_missing_catalog_depends_on_its_use() {
    for (users, level) in [
        ("", Level::Information),
        (
            "<CatalogReference catalogName='V' entryName='car'/>",
            Level::Error,
        ),
        (
            "<CatalogReference catalogName='$p' entryName='car'/>",
            Level::Error,
        ),
        (
            "<CatalogReference catalogName='$v' entryName='car'/>",
            Level::Warning,
        ),
    ] {
        let (_, missing) = gathered(&catalog(users), &[], 10);
        assert_eq!((missing.len(), missing[0].level), (1, level), "{users}");
    }
}

#[test]
fn findings_are_located_at_the_reference() {
    let text = "<OpenSCENARIO>\n<RoadNetwork>\n  <LogicFile filepath='gone.xodr'/>\n\
                </RoadNetwork></OpenSCENARIO>";
    let (_, missing) = gathered(text, &[], 10);
    let image = prepare_bytes(Path::new("/farm/s/x.xosc"), text.into(), &Limits::default()).build();
    let remarks = missing_references(&Document::open(&image).unwrap(), &missing);
    assert_eq!(remarks.len(), 1);
    let issue = remarks[0].issue.as_ref().unwrap();
    assert_eq!(
        issue.description,
        "the map `gone.xodr` does not exist; the path resolves to `/farm/s/gone.xodr`, because relative paths start at the directory of the file"
    );
    let places = &issue.locations[0].places;
    let here = matches!(
        places[0],
        Location::File {
            row: 3,
            column: 14,
            ..
        }
    );
    assert!(here, "{places:?}");
}

#[test]
fn incomplete_file_reports_its_own_faults() {
    let faults = |text: &str| {
        let image = prepare_bytes(Path::new("/a.xodr"), text.into(), &Limits::default()).build();
        faults_of_root(&Document::open(&image).unwrap())
    };
    assert!(faults("<OpenDRIVE/>").is_empty());
    let torn = faults("<OpenDRIVE><road>");
    assert_eq!(
        torn[0].issue.as_ref().map(|it| it.level),
        Some(Level::Error)
    );
}
