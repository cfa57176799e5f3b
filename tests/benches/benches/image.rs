//! The cost of building an image compared with a parser alone, and the cost of reading an image.
//!
//! `cargo bench -p qcbus-benches --bench image`

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use qcbus_benches::Result;
use qcbus_benches::figures::{best_of, digits, head, micros, millis, row, size};
use qcbus_benches::maps::map;
use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use quick_xml::Reader;
use quick_xml::events::Event;

fn main() -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n", qcbus_benches::machine::describe())?;
    let columns = ["", "1 MB", "100 MB"];
    let (small, large) = (measure(1_000_000, 60)?, measure(100_000_000, 7)?);
    writeln!(out, "{}", head(&columns))?;
    for ((name, small), (_, large)) in small.into_iter().zip(large) {
        writeln!(out, "{}", row(&[name.to_owned(), small, large]))?;
    }
    Ok(())
}

type Figures = Vec<(&'static str, String)>;

fn measure(bytes: usize, runs: usize) -> Result<Figures> {
    let text = map(bytes, 1);
    let limits = Limits::default();
    let prepared = prepare_bytes(Path::new("map.xodr"), text.clone().into_bytes(), &limits);
    let mut image = vec![1; prepared.upper_bound()];
    let used = prepared.build_into(&mut image)?;
    // The measurements alternate, so that disturbances of the machine affect all of them.
    let [mut own, mut build, mut dom, mut prepare] = [Duration::MAX; 4];
    for _ in 0..runs {
        own = own.min(best_of(1, || quick_xml_loop(&text)));
        build = build.min(best_of(1, || prepared.build_into(&mut image)));
        let bytes = text.clone().into_bytes();
        let mut bytes = Some(bytes);
        prepare = prepare.min(best_of(1, || {
            let bytes = bytes.take().unwrap_or_default();
            prepare_bytes(Path::new("map.xodr"), bytes, &limits).upper_bound()
        }));
        dom = dom.min(best_of(1, || {
            roxmltree::Document::parse(&text).is_ok_and(|document| document.root().has_children())
        }));
    }
    let image = &image[..used];
    let document = Document::open(image)?;
    let open = best_of(1000, || Document::open(image).is_ok());
    let validate = best_of(runs, || document.validate().is_ok());
    let len = text.len() as f64;
    let rate = |time: Duration| format!("{:.0} MB/s", len / 1e6 / time.as_secs_f64());
    Ok(vec![
        ("source", size(text.len())),
        ("quick-xml's own loop with attributes", rate(own)),
        ("build of the image, buffer warm", rate(build)),
        (
            "build ÷ quick-xml's loop",
            digits(own.as_secs_f64() / build.as_secs_f64()),
        ),
        ("roxmltree, a tree on the heap", rate(dom)),
        (
            "before the build: SHA-256, encoding, upper bound",
            rate(prepare),
        ),
        ("image ÷ source", digits(used as f64 / len)),
        (
            "room asked for ÷ source",
            digits(prepared.upper_bound() as f64 / len),
        ),
        ("open", format!("{} µs", digits(micros(open)))),
        ("validate", format!("{} ms", digits(millis(validate)))),
        (
            "validate per MB of source",
            format!("{} ms", digits(millis(validate) / (len / 1e6))),
        ),
    ])
}

fn quick_xml_loop(text: &str) -> usize {
    let mut reader = Reader::from_str(text);
    let mut sum = 0;
    loop {
        match reader.read_event() {
            Ok(Event::Start(tag) | Event::Empty(tag)) => {
                let mut attributes = tag.attributes();
                attributes.with_checks(false);
                sum += attributes
                    .flatten()
                    .map(|attribute| attribute.value.len())
                    .sum::<usize>();
            }
            Ok(Event::Eof) | Err(_) => return sum,
            Ok(_) => {}
        }
    }
}
