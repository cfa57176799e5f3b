//! The bus alone: jobs per second and the time from queued to done, with peers that only answer.
//!
//! `cargo bench -p qcbus-benches --bench bus`

use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};

use qcbus_benches::Result;
use qcbus_benches::figures::{digits, head, micros, quantile, row, size};
use qcbus_benches::peers::{Broker, publish, runtime, was_started_as_peer};
use qcbus_bus::MappedImage;

const JOB_TIME: Duration = Duration::from_secs(2);
const RUNS: usize = 3;

fn main() -> Result<()> {
    if was_started_as_peer()? {
        return Ok(());
    }
    let runtime = runtime()?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n", qcbus_benches::machine::describe())?;
    let columns = [
        "bundles",
        "document",
        "jobs under way",
        "jobs/s",
        "p50 µs",
        "p99 µs",
    ];
    writeln!(out, "{}", head(&columns))?;
    for bytes in [1_000, 50_000] {
        for bundles in [1, 3, 8] {
            for in_flight in [1, 8, 32] {
                let mut best = Measured::default();
                for _ in 0..RUNS {
                    let measured = runtime.block_on(jobs(bundles, bytes, in_flight))?;
                    if measured.rate > best.rate {
                        best = measured;
                    }
                }
                let cells = [
                    bundles.to_string(),
                    size(bytes),
                    in_flight.to_string(),
                    format!("{:.0}", best.rate),
                    digits(best.p50),
                    digits(best.p99),
                ];
                writeln!(out, "{}", row(&cells))?;
            }
        }
    }
    Ok(())
}

#[derive(Default)]
struct Measured {
    rate: f64,
    p50: f64,
    p99: f64,
}

/// Measures jobs. Each has its own document for every peer, and is done when all have answered.
async fn jobs(bundles: usize, bytes: usize, in_flight: usize) -> Result<Measured> {
    let mut broker = Broker::with(bundles).await?;
    let documents = broker.host.documents();
    let mut open: BTreeMap<u64, (Instant, usize, MappedImage)> = BTreeMap::new();
    let mut latencies = Vec::new();
    let (mut number, start) = (0, Instant::now());
    loop {
        let over = start.elapsed() >= JOB_TIME;
        if over && open.is_empty() {
            break;
        }
        while !over && open.len() < in_flight {
            number += 1;
            let queued = Instant::now();
            let held = publish(&documents, number, bytes)?;
            broker.send_job(number);
            open.insert(number, (queued, bundles, held));
        }
        let job = broker.next_done().await?.0;
        let Some((queued, left, _)) = open.get_mut(&job) else {
            return Err("an answer to no question".into());
        };
        *left -= 1;
        if *left == 0 {
            latencies.push(micros(queued.elapsed()));
            open.remove(&job);
        }
    }
    let elapsed = start.elapsed().as_secs_f64();
    broker.end().await?;
    Ok(Measured {
        rate: latencies.len() as f64 / elapsed,
        p50: quantile(&mut latencies, 0.5),
        p99: quantile(&mut latencies, 0.99),
    })
}
