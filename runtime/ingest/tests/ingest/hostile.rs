//! Malicious input: it ends in an error or in faults, soon, and within bounds.

use std::fs;
use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use qcbus_document::{Document, FaultCode};
use qcbus_ingest::{IngestError, Limits, prepare, prepare_bytes};

/// Returns the codes of the image's faults after a full validation, and the image's length.
fn codes_within(name: &str, bytes: Vec<u8>, limits: &Limits) -> (Vec<FaultCode>, usize) {
    let prepared = prepare_bytes(Path::new(name), bytes, limits);
    let image = prepared.build();
    let document = Document::open(&image).unwrap();
    document.validate().unwrap();
    (
        document.faults().map(|fault| fault.code).collect(),
        prepared.upper_bound(),
    )
}

fn codes(name: &str, bytes: impl Into<Vec<u8>>) -> Vec<FaultCode> {
    codes_within(name, bytes.into(), &Limits::default()).0
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn empty_file_is_a_fault() {
    assert_eq!(codes("a.xodr", ""), [FaultCode::Empty]);
    assert_eq!(codes("a.xodrz", ""), [FaultCode::Empty]);
    assert_eq!(codes("a.mosc", ""), [FaultCode::ArchiveMalformed]);
}

#[test]
fn directory_with_a_map_name_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.xodr");
    fs::create_dir(&path).unwrap();
    let error = prepare(&path, dir.path(), &Limits::default()).unwrap_err();
    assert!(matches!(
        error,
        IngestError::NotAFile {
            what: "a directory",
            ..
        }
    ));
    let error = prepare(&dir.path().join("y.xodr"), dir.path(), &Limits::default()).unwrap_err();
    assert!(matches!(error, IngestError::Missing { .. }));
}

#[cfg(unix)]
#[test]
fn unreadable_file_is_an_error() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.xodr");
    fs::write(&path, "<OpenDRIVE/>").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&path).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    let error = prepare(&path, dir.path(), &Limits::default()).unwrap_err();
    assert!(matches!(error, IngestError::Unreadable { .. }), "{error}");
}

#[test]
fn two_hundred_megabytes_of_start_tags_need_little_memory() {
    let text = b"<a>".repeat((200 << 20) / 3);
    let len = text.len();
    let (codes, bound) = codes_within("a.xodr", text, &Limits::default());
    assert_eq!(codes, [FaultCode::DepthLimit]);
    assert!(
        bound < len + (len >> 6) + (1 << 20),
        "bound {bound} for {len} bytes of text"
    );
}

#[test]
fn deeply_nested_elements_stop_at_the_limit() {
    let text = ["<a>".repeat(100_000), "</a>".repeat(100_000)].concat();
    let prepared = prepare_bytes(Path::new("a.xodr"), text.into_bytes(), &Limits::default());
    let image = prepared.build();
    let document = Document::open(&image).unwrap();
    document.validate().unwrap();
    assert_eq!(document.elements("a").count(), 1024);
    let fault = document.faults().next().unwrap();
    assert_eq!(
        (fault.code, fault.offset),
        (FaultCode::DepthLimit, 3 * 1024)
    );
    assert!(fault.text.contains("max_depth"));
    let limits = Limits {
        max_depth: 3,
        ..Limits::default()
    };
    let (codes, _) = codes_within("a.xodr", b"<a><a><a/></a></a>".to_vec(), &limits);
    assert_eq!(codes, []);
    let (codes, _) = codes_within("a.xodr", b"<a><a><a><a/></a></a></a>".to_vec(), &limits);
    assert_eq!(codes, [FaultCode::DepthLimit]);
}

#[test]
fn entity_bombs_and_external_entities_are_never_expanded() {
    let bomb = "<!DOCTYPE a [<!ENTITY x 'xxxxxxxxxx'><!ENTITY y '&x;&x;&x;'>]><a b='&y;'>&y;</a>";
    let image = prepare_bytes(Path::new("a.xosc"), bomb.into(), &Limits::default()).build();
    let document = Document::open(&image).unwrap();
    let codes: Vec<FaultCode> = document.faults().map(|fault| fault.code).collect();
    assert_eq!(codes, [FaultCode::Doctype]);
    assert_eq!(document.root().unwrap().attr("b"), Some("&y;"));
    assert_eq!(document.root().unwrap().text(), "&y;");
    let external = "<!DOCTYPE a [<!ENTITY x SYSTEM 'file:///etc/hostname'>]><a>&x;</a>";
    assert_eq!(self::codes("a.xosc", external), [FaultCode::Doctype]);
}

#[test]
fn gzip_bombs_and_truncated_gzip_are_faults() {
    let bomb = gzip(&vec![b' '; 8 << 20]);
    assert_eq!(codes("a.xodrz", bomb.clone()), [FaultCode::RatioLimit]);
    assert_eq!(codes("a.xodr", bomb.clone()), [FaultCode::RatioLimit]);
    let limits = Limits {
        max_ratio: 10_000,
        max_unpacked: 1 << 20,
        ..Limits::default()
    };
    let (codes, _) = codes_within("a.xodr.gz", bomb, &limits);
    assert_eq!(codes, [FaultCode::UnpackedLimit]);

    let roads: String = (0..5000)
        .map(|i| format!("<road id='{i}' length='{}'/>", i * 7919))
        .collect();
    let packed = gzip(format!("<OpenDRIVE>{roads}</OpenDRIVE>").as_bytes());
    let half = packed[..packed.len() / 2].to_vec();
    let image = prepare_bytes(Path::new("a.xodr.gz"), half, &Limits::default()).build();
    let document = Document::open(&image).unwrap();
    assert_eq!(
        document.faults().next().unwrap().code,
        FaultCode::GzipTruncated
    );
    assert!(
        document.elements("road").count() > 100,
        "the decompressed part is in the tree"
    );
}

#[test]
fn packing_that_contradicts_the_name_is_noticed() {
    assert_eq!(
        codes("a.xodr.gz", "<OpenDRIVE/>"),
        [FaultCode::GzipMalformed]
    );
    assert_eq!(
        codes("a.xodr", gzip(b"<OpenDRIVE/>")),
        [FaultCode::EncodingTranscoded]
    );
    assert_eq!(codes("a.xodrz", gzip(b"<OpenDRIVE/>")), []);
    assert_eq!(
        codes("a.xosc", b"PK\x03\x04...".to_vec()),
        [FaultCode::ArchiveMalformed]
    );
}

#[test]
fn bytes_that_are_no_text_are_faults() {
    let utf8 = "<?xml version='1.0' encoding='UTF-8'?><a b='\u{0}'/>";
    assert_eq!(codes("a.xodr", utf8), [FaultCode::BadCharacter]);
    let latin1 = b"<?xml version='1.0' encoding='UTF-8'?><a b='\xE4'/>";
    assert_eq!(
        codes("a.xodr", latin1.to_vec()),
        [FaultCode::EncodingMalformed]
    );
    let wrong = b"<?xml version='1.0' encoding='UTF-16'?><a/>";
    assert_eq!(
        codes("a.xodr", wrong.to_vec()),
        [FaultCode::EncodingMismatch]
    );
    let zeros = codes("a.xodr", vec![0; 1 << 20]);
    assert!(
        zeros.contains(&FaultCode::BadCharacter) && zeros.len() < 20,
        "{zeros:?}"
    );
}

#[test]
fn many_attributes_and_faults_take_linear_time() {
    let many: String = (0..60_000).map(|i| format!(" a{i}='{i}'")).collect();
    assert_eq!(codes("a.xodr", format!("<a{many}/>")), []);
    let twice = format!("<a{many} a59999=''/>");
    assert_eq!(codes("a.xodr", twice), [FaultCode::DuplicateAttribute]);
    let names: String = (0..70_000).map(|i| format!("<n{i}/>")).collect();
    assert_eq!(
        codes("a.xodr", format!("<a>{names}</a>")),
        [FaultCode::NameLimit]
    );
    let prefixes: String = (0..50_000).map(|i| format!(" xmlns:p{i}='u'")).collect();
    assert_eq!(codes("a.xodr", format!("<a{prefixes}><p7:b/></a>")), []);
    let faulty = codes("a.xodr", format!("<a>{}</a>", "</b>".repeat(1_000_000)));
    assert_eq!(faulty.len(), 65);
    assert_eq!(faulty.last(), Some(&FaultCode::FaultLimit));
    assert_eq!(
        codes("a.xodr", format!("<a b='{}'/>", "&".repeat(1 << 20))).len(),
        65
    );
}

#[test]
fn values_above_the_quick_bound_need_a_second_attempt() {
    let long = "x\n".repeat(2_000_000);
    let text = format!("<a b='{long}'/>");
    let prepared = prepare_bytes(Path::new("a.xodr"), text.into_bytes(), &Limits::default());
    let mut small = vec![0; prepared.upper_bound()];
    let error = prepared.build_into(&mut small).unwrap_err();
    assert!(
        matches!(error, qcbus_ingest::BuildError::SmallBuffer { .. }),
        "{error}"
    );
    let image = prepared.build();
    let document = Document::open(&image).unwrap();
    document.validate().unwrap();
    assert_eq!(
        document.root().unwrap().attr("b"),
        Some(&*long.replace('\n', " "))
    );
}

#[test]
fn image_above_its_limit_is_a_named_fault() {
    let limits = Limits {
        max_image: 100_000,
        ..Limits::default()
    };
    let text = format!("<a>{}</a>", "<b/>".repeat(20_000));
    let image = prepare_bytes(Path::new("a.xodr"), text.into_bytes(), &limits).build();
    assert!(image.len() < 100_000);
    let document = Document::open(&image).unwrap();
    let fault = document.faults().next().unwrap();
    assert_eq!(fault.code, FaultCode::ImageLimit);
    assert!(
        fault
            .text
            .contains("100000 are allowed; raise the limit max_image"),
        "{}",
        fault.text
    );
    assert_eq!(document.path(), "a.xodr");
}
