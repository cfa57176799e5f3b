//! `<include>` of OpenDRIVE: it is spliced at its place, and each failure is a fault with its
//! place.

use std::fs;
use std::path::Path;

use qcbus_document::{Document, FaultCode};
use qcbus_ingest::{FileStamp, Limits, prepare};

struct Built {
    image: Vec<u8>,
    files: Vec<FileStamp>,
}

impl Built {
    fn document(&self) -> Document<'_> {
        let document = Document::open(&self.image).unwrap();
        document.validate().unwrap();
        document
    }

    fn faults(&self) -> Vec<(FaultCode, String)> {
        let document = self.document();
        let place = |offset| {
            let place = document.position(offset);
            let name = Path::new(place.path)
                .file_name()
                .unwrap()
                .to_string_lossy()
                .into_owned();
            format!("{name}:{}:{}", place.row, place.column)
        };
        document
            .faults()
            .map(|fault| (fault.code, place(fault.offset)))
            .collect()
    }
}

/// Writes the files into a fresh directory and builds `maps/root.xodr` with `maps` as boundary.
fn build(files: &[(&str, &str)], limits: &Limits) -> Built {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = dir.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let boundary = dir.path().join("maps");
    let prepared = prepare(&boundary.join("root.xodr"), &boundary, limits).unwrap();
    Built {
        image: prepared.build(),
        files: prepared.files().to_vec(),
    }
}

fn built(files: &[(&str, &str)]) -> Built {
    build(files, &Limits::default())
}

const ROOT: &str = "<OpenDRIVE>\n  <road id='1'>\n    <planView>\n      <geometry s='0'/>\n      \
                    <include file='sub/view.xml'/>\n      <geometry s='9'/>\n    </planView>\n  \
                    </road>\n</OpenDRIVE>";

#[test]
fn children_of_an_included_root_follow_the_include() {
    let built = built(&[
        ("maps/root.xodr", ROOT),
        (
            "maps/sub/view.xml",
            "<?xml version='1.0'?>\n<planView>\n  <geometry s='3'/>\n  <include file='more.xml'/>\n</planView>\n",
        ),
        (
            "maps/sub/more.xml",
            "<planView><!-- ü --><geometry s='6'/></planView>",
        ),
    ]);
    assert_eq!(built.faults(), []);
    let document = built.document();
    let view = document.elements("planView").next().unwrap();
    assert_eq!(
        document.elements("planView").count(),
        1,
        "the included roots are the same element"
    );
    let order: Vec<(&str, Option<&str>)> = view
        .children()
        .map(|node| (node.name(), node.attr("s").or(node.attr("file"))))
        .collect();
    assert_eq!(
        order,
        [
            ("geometry", Some("0")),
            ("include", Some("sub/view.xml")),
            ("geometry", Some("3")),
            ("include", Some("more.xml")),
            ("geometry", Some("6")),
            ("geometry", Some("9"))
        ]
    );
    let places: Vec<(String, u32, u32, bool)> = view
        .children_named("geometry")
        .map(|node| {
            let place = node.position();
            let name = Path::new(place.path)
                .file_name()
                .unwrap()
                .to_string_lossy()
                .into_owned();
            (name, place.row, place.column, place.is_root_file)
        })
        .collect();
    let expected = [
        ("root.xodr", 4, 7, true),
        ("view.xml", 3, 3, false),
        ("more.xml", 1, 21, false),
        ("root.xodr", 6, 7, true),
    ];
    assert_eq!(
        places,
        expected.map(|(name, row, column, root)| (name.to_string(), row, column, root))
    );
    assert_eq!(built.files.len(), 3);
    assert!(built.files.iter().all(|file| file.content.is_some()));
    assert_eq!(document.sources().count(), 3);
}

#[test]
fn missing_include_is_a_fault_and_is_watched() {
    let built = built(&[("maps/root.xodr", ROOT)]);
    assert_eq!(
        built.faults(),
        [(FaultCode::IncludeMissing, "root.xodr:5:7".to_string())]
    );
    let missing = &built.files[1];
    assert!(missing.path.ends_with("maps/sub/view.xml") && missing.content.is_none());
    assert_eq!(built.document().elements("geometry").count(), 2);
}

#[test]
fn include_cycle_ends_where_it_closes() {
    let built = built(&[
        (
            "maps/root.xodr",
            "<OpenDRIVE><include file='a.xml'/></OpenDRIVE>",
        ),
        (
            "maps/a.xml",
            "<OpenDRIVE><road id='1'/>\n<include file='b.xml'/></OpenDRIVE>",
        ),
        (
            "maps/b.xml",
            "<OpenDRIVE><include file='./a.xml'/><road id='2'/></OpenDRIVE>",
        ),
    ]);
    assert_eq!(
        built.faults(),
        [(FaultCode::IncludeCycle, "b.xml:1:12".to_string())]
    );
    assert_eq!(built.document().elements("road").count(), 2);
    let itself = self::built(&[(
        "maps/root.xodr",
        "<OpenDRIVE><include file='root.xodr'/></OpenDRIVE>",
    )]);
    assert_eq!(
        itself.faults(),
        [(FaultCode::IncludeCycle, "root.xodr:1:12".to_string())]
    );
}

#[test]
fn files_outside_the_boundary_are_not_read() {
    let files = |written: &str| format!("<OpenDRIVE><include file='{written}'/></OpenDRIVE>");
    for written in ["../secret.xml", "/etc/hostname", "sub/../../secret.xml"] {
        let built = built(&[
            ("maps/root.xodr", &files(written)),
            ("maps/sub/part.xml", "<OpenDRIVE/>"),
            ("secret.xml", "<OpenDRIVE><road/></OpenDRIVE>"),
        ]);
        assert_eq!(
            built.faults(),
            [(FaultCode::IncludeEscapes, "root.xodr:1:12".to_string())]
        );
        assert_eq!(built.files.len(), 1);
        assert_eq!(built.document().elements("road").count(), 0);
    }
}

/// A simulator that opens such a path gets no file, although its text alone leads to one.
#[test]
fn include_is_missing_where_the_system_cannot_follow_it() {
    let files = |written: &str| format!("<OpenDRIVE><include file='{written}'/></OpenDRIVE>");
    for written in [
        "gone/../part.xml",
        "part.xml/../part.xml",
        "part.xml/",
        "part.xml/.",
    ] {
        let built = built(&[
            ("maps/root.xodr", &files(written)),
            ("maps/part.xml", "<OpenDRIVE><road/></OpenDRIVE>"),
        ]);
        assert_eq!(
            built.faults(),
            [(FaultCode::IncludeMissing, "root.xodr:1:12".to_string())],
            "{written}"
        );
        assert_eq!(built.document().elements("road").count(), 0);
    }
}

#[cfg(unix)]
#[test]
fn symbolic_link_does_not_leave_the_boundary() {
    let dir = tempfile::tempdir().unwrap();
    let boundary = dir.path().join("maps");
    fs::create_dir(&boundary).unwrap();
    fs::write(
        dir.path().join("secret.xml"),
        "<OpenDRIVE><road/></OpenDRIVE>",
    )
    .unwrap();
    std::os::unix::fs::symlink("../secret.xml", boundary.join("link.xml")).unwrap();
    let root = boundary.join("root.xodr");
    fs::write(&root, "<OpenDRIVE><include file='link.xml'/></OpenDRIVE>").unwrap();
    let image = prepare(&root, &boundary, &Limits::default())
        .unwrap()
        .build();
    let document = Document::open(&image).unwrap();
    assert_eq!(
        document.faults().next().unwrap().code,
        FaultCode::IncludeEscapes
    );
    assert_eq!(document.elements("road").count(), 0);
}

#[test]
fn malformed_includes_are_faults() {
    let root = |inner: &str| format!("<OpenDRIVE>\n<road>{inner}</road></OpenDRIVE>");
    let case = |inner: &str, included: &str| {
        built(&[("maps/root.xodr", &root(inner)), ("maps/i.xml", included)])
    };
    let include = "<include file='i.xml'/>";
    for (inner, included, code, place) in [
        (
            include,
            "<OpenDRIVE/>",
            FaultCode::IncludeParentMismatch,
            "root.xodr:2:7",
        ),
        (
            "<include/>",
            "",
            FaultCode::IncludeMalformed,
            "root.xodr:2:7",
        ),
        (
            "<include file=''/>",
            "",
            FaultCode::IncludeMalformed,
            "root.xodr:2:7",
        ),
        (
            "<include file='http://x/i.xml'/>",
            "",
            FaultCode::IncludeMalformed,
            "root.xodr:2:7",
        ),
        (include, "", FaultCode::Empty, "i.xml:1:1"),
        (include, "<road>\n<lanes>", FaultCode::Unclosed, "i.xml:2:8"),
        (
            include,
            "<road/><road/>",
            FaultCode::SecondRoot,
            "i.xml:1:8",
        ),
        (
            include,
            "<road>\n</lanes></road>",
            FaultCode::MismatchedTag,
            "i.xml:2:1",
        ),
        (
            include,
            "<road a='1' a='2'/>",
            FaultCode::DuplicateAttribute,
            "i.xml:1:13",
        ),
    ] {
        let built = case(&format!("{inner}<link/>"), included);
        assert_eq!(
            built.faults(),
            [(code, place.to_string())],
            "{inner} {included}"
        );
        let document = built.document();
        let link = document.elements("link").next().unwrap();
        assert!(
            link.parent().unwrap().is("road"),
            "content after the include keeps its place"
        );
    }
}

#[test]
fn doubling_includes_stop_at_the_limit() {
    let doubling = "<OpenDRIVE><include file='N.xml'/><include file='N.xml'/></OpenDRIVE>";
    let names: Vec<String> = (0..30).map(|n| format!("maps/{n}.xml")).collect();
    let texts: Vec<String> = (1..31)
        .map(|n| doubling.replace('N', &n.to_string()))
        .collect();
    let mut files: Vec<(&str, &str)> = names
        .iter()
        .map(String::as_str)
        .zip(texts.iter().map(String::as_str))
        .collect();
    files.push(("maps/30.xml", "<OpenDRIVE><road/></OpenDRIVE>"));
    files.push((
        "maps/root.xodr",
        "<OpenDRIVE><include file='0.xml'/></OpenDRIVE>",
    ));
    let built = built(&files);
    let faults = built.faults();
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].0, FaultCode::IncludeLimit);
    let limits = Limits {
        max_includes: 3,
        ..Limits::default()
    };
    let built = build(&files, &limits);
    assert!(
        built
            .document()
            .faults()
            .any(|fault| fault.text.contains("raise the limit max_includes"))
    );
}

#[test]
fn only_opendrive_has_includes() {
    let text = "<OpenSCENARIO><include file='nowhere.xml'/></OpenSCENARIO>";
    assert_eq!(built(&[("maps/root.xodr", text)]).faults(), []);
}
