//! The broker's end of the bus for a bundle under test: one configuration, and jobs of one
//! document.

use std::path::Path;

use qcbus_bus::{Host, HostOptions, Instance};
use qcbus_document::FileKind;
use qcbus_formats::config::Config;
use qcbus_messages::{Digest, DocId, DocumentRole, Job, JobDocument, JobId, codec};

/// Digest that stands for a missing configuration.
pub const CONFIG: Digest = Digest([7; 32]);

/// Starts the broker's end of the bus.
pub fn host(directory: &Path) -> Host {
    let instance = Instance::at(directory.to_path_buf());
    let mut host = Host::start(&instance, HostOptions::default()).unwrap();
    host.set_config(CONFIG, &codec::encode(&None::<Config>).unwrap());
    host
}

/// Publishes the image of a map. The history of the bus holds it. A broker would hold it until the
/// job ends.
pub fn publish(host: &Host, doc: DocId, map: &str) {
    let limits = qcbus_ingest::Limits::default();
    let bytes = map.as_bytes().to_vec();
    let image = qcbus_ingest::prepare_bytes(Path::new("/a.xodr"), bytes, &limits).build();
    let mut loan = host.documents().loan(image.len()).unwrap();
    loan[..image.len()].copy_from_slice(&image);
    let published = loan.publish(doc, image.len(), Digest([1; 32]), FileKind::Xodr);
    drop(published.unwrap());
}

/// Returns a job for such a map.
pub fn job(job: JobId, doc: DocId) -> Job {
    let root = JobDocument {
        doc,
        role: DocumentRole::Root,
        path: "/a.xodr".to_owned(),
        digest: Digest([1; 32]),
        referred_at: 0,
        links: Vec::new(),
    };
    Job {
        job,
        config: CONFIG,
        kind: FileKind::Xodr,
        documents: vec![root],
        missing: Vec::new(),
    }
}
