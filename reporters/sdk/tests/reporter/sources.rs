//! Tests of source lines of files on disk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::xqar::Results;
use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};
use qcbus_reporter_sdk::{FileSources, Sources as _};

fn farm(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/farm");
    root.canonicalize().unwrap().join(name)
}

fn result(input: &Path, xqar: &Path, digest: Digest) -> ResultMessage {
    ResultMessage {
        job: JobId(1),
        input: input.to_string_lossy().into_owned(),
        display_path: "a".into(),
        xqar: xqar.to_string_lossy().into_owned(),
        verdict: Verdict::Accepted,
        digest,
        config: Digest::default(),
        document: None,
        results: Results::default(),
        rules: BTreeMap::new(),
        params: Vec::new(),
    }
}

fn digest(path: &Path) -> Digest {
    let limits = qcbus_ingest::Limits::default();
    let prepared = qcbus_ingest::prepare(path, path.parent().unwrap(), &limits).unwrap();
    Digest(prepared.digest())
}

/// Returns a line of a farm file as a report shows it.
fn line(name: &str, row: u64) -> String {
    let file = farm(name);
    let result = result(&file, Path::new("none.xqar"), digest(&file));
    let line = FileSources::new(&result).line(&result.input, row, 1);
    line.unwrap_or_else(|| panic!("{name}:{row} must have a line"))
        .text
}

#[test]
fn packed_and_transcoded_files_show_their_text() {
    let plain = std::fs::read_to_string(farm("maps/ring.xodr")).unwrap();
    assert_eq!(
        line("maps/ring_packed.xodrz", 5),
        plain.lines().nth(4).unwrap()
    );
    let name = line("maps/alte_muehle_latin1.xodr", 5);
    assert!(name.contains("Mühlenstraße"), "{name}");
    let mill = line("scenarios/braking_utf16.xosc", 4);
    assert!(mill.contains("Mühle"), "{mill}");
}

#[test]
fn file_without_digest_must_be_older_than_result() {
    let dir = tempfile::tempdir().unwrap();
    let (file, xqar) = (dir.path().join("a.xodr"), dir.path().join("a.xodr.xqar"));
    let write = |path: &Path, at: u64| {
        std::fs::write(path, "<OpenDRIVE/>\n").unwrap();
        let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(at);
        let file = std::fs::File::options().write(true).open(path).unwrap();
        file.set_modified(time).unwrap();
    };
    write(&file, 1000);
    write(&xqar, 2000);
    let result = result(&file, &xqar, Digest::default());
    let shown = || FileSources::new(&result).line(&result.input, 1, 1);
    assert_eq!(shown().unwrap().text, "<OpenDRIVE/>");
    write(&file, 3000);
    assert_eq!(shown(), None);
}

#[test]
fn unreadable_path_has_no_source_lines() {
    let dir = tempfile::tempdir().unwrap();
    let result = result(dir.path(), Path::new("none.xqar"), Digest::default());
    let sources = FileSources::new(&result);
    assert_eq!(sources.line(&result.input, 1, 1), None);
    assert_eq!(sources.line("relative.xodr", 1, 1), None);
    assert_eq!(sources.line("/no/such/file.xodr", 1, 1), None);
}
