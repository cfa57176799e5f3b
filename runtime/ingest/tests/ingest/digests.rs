//! A document is bound to the bytes on disk, even if their digest is computed late.

use std::fs;
use std::io::Write;
use std::path::Path;

use qcbus_document::Document;
use qcbus_ingest::{Limits, Prepared, prepare};
use sha2::{Digest, Sha256};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Size above the limit for hashing during the read.
const LARGE: usize = 3 << 20;

fn map(encoding: &str) -> String {
    let mut text = format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?>\n<OpenDRIVE>");
    while text.len() < LARGE {
        text.push_str("<road name=\"Straße\" length=\"1.0000000000000000e+02\" id=\"1\"/>\n");
    }
    text.push_str("</OpenDRIVE>\n");
    text
}

fn zipped(text: &str) -> Result<Vec<u8>, std::io::Error> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
    packed.write_all(text.as_bytes())?;
    packed.finish()
}

/// Returns files of all sorts by name.
fn files() -> Result<Vec<(&'static str, Vec<u8>)>, std::io::Error> {
    let latin = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let wide = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let (plain, ascii) = (map("UTF-8"), map("US-ASCII").replace('ß', "ss"));
    Ok(vec![
        ("plain.xodr", plain.clone().into_bytes()),
        ("small.xodr", b"<OpenDRIVE/>".to_vec()),
        ("marked.xodr", format!("\u{FEFF}{plain}").into_bytes()),
        ("broken.xodr", latin(&plain)),
        ("latin.xodr", latin(&map("ISO-8859-1"))),
        ("wide.xodr", wide(&map("UTF-16"))),
        ("ascii.xodr", ascii.into_bytes()),
        ("wide-ascii.xodr", map("US-ASCII").into_bytes()),
        ("packed.xodr.gz", zipped(&plain)?),
        ("packed.xodr", zipped(&plain)?),
        ("zip.xodr", [b"PK\x03\x04", plain.as_bytes()].concat()),
        ("archive.xosc", vec![b' '; LARGE]),
    ])
}

fn is_bound(prepared: &Prepared, bytes: &[u8]) -> Outcome {
    let image = prepared.build();
    let digest: [u8; 32] = Sha256::digest(bytes).into();
    assert_eq!(Document::open(&image)?.content_hash(), digest);
    assert_eq!(prepared.digest(), digest);
    let content = prepared.files()[0].content.as_ref();
    assert_eq!(content.map(|content| content.digest), Some(digest));
    Ok(())
}

fn prepared(path: &Path, limits: &Limits) -> Result<Prepared, qcbus_ingest::IngestError> {
    prepare(path, path.parent().unwrap_or(path), limits)
}

#[test]
fn digest_covers_the_bytes_on_disk() -> Outcome {
    let dir = tempfile::tempdir()?;
    let limits = Limits::default();
    for (name, bytes) in files()? {
        let path = dir.path().join(name);
        fs::write(&path, &bytes)?;
        is_bound(&prepared(&path, &limits)?, &bytes)?;
        // The order does not matter.
        let other = prepared(&path, &limits)?;
        let digest: [u8; 32] = Sha256::digest(&bytes).into();
        let content = other.files()[0].content.as_ref();
        assert_eq!(
            content.map(|content| content.digest),
            Some(digest),
            "{name}"
        );
    }
    Ok(())
}

#[test]
fn abandoned_file_still_has_its_digest() -> Outcome {
    let dir = tempfile::tempdir()?;
    for limits in [
        Limits {
            max_image: 1 << 20,
            ..Limits::default()
        },
        Limits {
            max_unpacked: 1 << 20,
            ..Limits::default()
        },
    ] {
        for (name, bytes) in files()? {
            let path = dir.path().join(name);
            fs::write(&path, &bytes)?;
            is_bound(&prepared(&path, &limits)?, &bytes)?;
        }
    }
    Ok(())
}
