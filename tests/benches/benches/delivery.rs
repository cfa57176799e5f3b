//! Costs of delivering a document to several processes: over the bus, over Unix sockets, and over
//! Unix sockets with subsequent decoding by bincode.
//!
//! `cargo bench -p qcbus-benches --bench delivery`

use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use qcbus_benches::Result;
use qcbus_benches::figures::{digits, head, micros, quantile, row, size};
use qcbus_benches::maps::map;
use qcbus_benches::peers::{Broker, runtime, was_started_as_peer};
use qcbus_document::{Document, FileKind};
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_messages::{Digest, DocId};
use serde::{Deserialize, Serialize};

const SOCKET: &str = "QCBUS_BENCH_SOCKET";
const DECODE: &str = "QCBUS_BENCH_DECODE";
const SIZES: [usize; 3] = [1_000, 1_000_000, 100_000_000];

fn main() -> Result<()> {
    if let Some(socket) = std::env::var_os(SOCKET) {
        return receive(Path::new(&socket), std::env::var_os(DECODE).is_some());
    }
    if was_started_as_peer()? {
        return Ok(());
    }
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n", qcbus_benches::machine::describe())?;
    let columns = [
        "consumers",
        "document",
        "bus, after a rest: publish",
        "to the last reader",
        "bus, hot loop: publish",
        "to the last reader",
        "Unix sockets",
        "sockets and bincode",
        "sockets ÷ bus (after a rest)",
    ];
    writeln!(out, "{}", head(&columns))?;
    for consumers in [1, 4, 8] {
        for bytes in SIZES {
            let rested = runtime()?.block_on(over_the_bus(consumers, bytes, true))?;
            let hot = runtime()?.block_on(over_the_bus(consumers, bytes, false))?;
            let text = map(bytes, 1);
            let copied = over_sockets(consumers, text.as_bytes(), false)?;
            let decoded = over_sockets(consumers, &encode(&text)?, true)?;
            let mut cells = vec![consumers.to_string(), size(bytes)];
            let times = [rested.0, rested.1, hot.0, hot.1, copied, decoded];
            cells.extend(times.map(|micros| format!("{} µs", digits(micros))));
            cells.push(digits(copied / rested.1));
            writeln!(out, "{}", row(&cells))?;
        }
    }
    Ok(())
}

/// Returns how often a document of this size is sent.
fn rounds(bytes: usize) -> u64 {
    if bytes > 10_000_000 { 20 } else { 200 }
}

/// Measures publishing, and the time until the last reader, who reads both ends, has answered.
/// Returns medians in microseconds. Filling is not measured and would leave every cache cold, so
/// only the ends are written. Lending 100 MB takes milliseconds, in which all processes fall
/// asleep. With `rest` it waits before each send, so that every size starts from the same state.
async fn over_the_bus(consumers: usize, bytes: usize, rest: bool) -> Result<(f64, f64)> {
    let mut broker = Broker::with(consumers).await?;
    let documents = broker.host.documents();
    let (mut published, mut delivered) = (Vec::new(), Vec::new());
    for number in 1..=rounds(bytes) {
        let mut loan = documents.loan(bytes)?;
        let last = loan.len() - 1;
        (loan[0], loan[last]) = (number as u8, number as u8);
        if rest {
            let _ = tokio::time::timeout(Duration::from_millis(15), broker.host.next()).await;
        }
        let start = Instant::now();
        let held = loan.publish(DocId(number), bytes, Digest::default(), FileKind::Xodr)?;
        published.push(micros(start.elapsed()));
        broker.send_job(number);
        for _ in 0..consumers {
            broker.next_done().await?;
        }
        delivered.push(micros(start.elapsed()));
        drop(held);
    }
    broker.end().await?;
    Ok((quantile(&mut published, 0.5), quantile(&mut delivered, 0.5)))
}

/// Measures from the first byte written to the answer of the last reader; median in microseconds.
fn over_sockets(consumers: usize, bytes: &[u8], decode: bool) -> Result<f64> {
    let dir = tempfile::TempDir::new()?;
    let place = dir.path().join("s");
    let listener = UnixListener::bind(&place)?;
    let mut readers: Vec<(Child, UnixStream)> = Vec::new();
    for _ in 0..consumers {
        let mut command = Command::new(std::env::current_exe()?);
        command.env(SOCKET, &place);
        if decode {
            command.env(DECODE, "1");
        }
        let child = command.spawn()?;
        readers.push((child, listener.accept()?.0));
    }
    let mut times = Vec::new();
    let rounds = if decode && bytes.len() > 10_000_000 {
        2
    } else {
        rounds(bytes.len()) / 2
    };
    for _ in 0..rounds {
        // The pause is the same as for the bus.
        std::thread::sleep(Duration::from_millis(15));
        let start = Instant::now();
        for (_, stream) in &mut readers {
            stream.write_all(&(bytes.len() as u64).to_le_bytes())?;
            stream.write_all(bytes)?;
        }
        for (_, stream) in &mut readers {
            stream.read_exact(&mut [0])?;
        }
        times.push(micros(start.elapsed()));
    }
    for (mut child, stream) in readers {
        drop(stream);
        child.wait()?;
    }
    Ok(quantile(&mut times, 0.5))
}

/// Runs a socket reader: it copies everything into its memory, may decode it, and answers.
fn receive(socket: &Path, decode: bool) -> Result<()> {
    let mut stream = UnixStream::connect(socket)?;
    let mut bytes = Vec::new();
    loop {
        let mut len = [0; 8];
        if stream.read_exact(&mut len).is_err() {
            return Ok(());
        }
        bytes.resize(usize::try_from(u64::from_le_bytes(len))?, 0);
        stream.read_exact(&mut bytes)?;
        let answer = if decode {
            let config = bincode::config::standard();
            let (tree, _): (Tree, usize) = bincode::serde::decode_from_slice(&bytes, config)?;
            tree.elements.len() as u8
        } else {
            bytes.first().zip(bytes.last()).map_or(0, |(a, b)| a ^ b)
        };
        stream.write_all(&[answer])?;
    }
}

/// A document in the form for readers that do not read in place.
#[derive(Serialize, Deserialize)]
struct Tree {
    names: Vec<String>,
    elements: Vec<Element>,
}

#[derive(Serialize, Deserialize)]
struct Element {
    name: u16,
    parent: u32,
    attributes: Vec<(u16, String)>,
}

fn encode(text: &str) -> Result<Vec<u8>> {
    let limits = Limits::default();
    let prepared = prepare_bytes(Path::new("map.xodr"), text.as_bytes().to_vec(), &limits);
    let image = prepared.build();
    let document = Document::open(&image)?;
    let mut tree = Tree {
        names: Vec::new(),
        elements: Vec::new(),
    };
    let mut index = std::collections::HashMap::new();
    let mut number = |name: &str| {
        *index.entry(name.to_owned()).or_insert_with(|| {
            tree.names.push(name.to_owned());
            tree.names.len() as u16 - 1
        })
    };
    let root = document.root();
    for node in root.into_iter().flat_map(|root| root.descendants()) {
        let attributes = node.attributes().map(|it| {
            let value = it.value().to_owned();
            (number(it.name()), value)
        });
        let attributes = attributes.collect();
        tree.elements.push(Element {
            name: number(node.name()),
            parent: node.parent().map_or(0, |parent| parent.index()),
            attributes,
        });
    }
    Ok(bincode::serde::encode_to_vec(
        &tree,
        bincode::config::standard(),
    )?)
}
