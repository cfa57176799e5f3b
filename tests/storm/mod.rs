//! The storm: a driver that does everything to a farm that can happen to one, and what must be so
//! when it is over.

mod driver;
mod tally;
mod trouble;

use std::time::{Duration, Instant};

use driver::Driver;

use crate::support::content::Content;
use crate::support::farm::{Farm, shm_segments, tail};
use crate::support::inside::is_inside;
use crate::support::judge::{judge, verdicts_in_journal};
use crate::support::processes::{peak_private_kib, private_kib};
use crate::support::watchdog::{until, until_or};
use crate::{end, report};

/// Length of the storm.
pub fn seconds() -> u64 {
    crate::number_from("QCBUS_CHAOS_SECONDS", 20)
}

/// More private memory than this, at its peak, and the broker's memory is not bounded.
const PEAK_KIB: u64 = 500 << 10;

/// Lets the storm rage, waits until it is calm, and judges.
pub fn rage(seed: u64, seconds: u64) {
    report(&format!(
        "chaos: QCBUS_CHAOS_SEED={seed} QCBUS_CHAOS_SECONDS={seconds}"
    ));
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    std::fs::write(&config, trouble::CALM).unwrap();
    farm.arguments = arguments(&config);
    let mut driver = Driver::new(farm, seed);
    driver.start_broker();
    driver.write_some(40);
    driver.calm_down();
    let start_kib = driver.memory_kib();
    let until = Instant::now() + Duration::from_secs(seconds);
    while Instant::now() < until {
        driver.step();
    }
    driver.calm_down();
    let end_kib = driver.memory_kib();
    demand(driver, start_kib, end_kib, seconds);
}

fn arguments(config: &std::path::Path) -> Vec<String> {
    let config = config.to_string_lossy();
    let words = [
        "-c",
        &config,
        "--report",
        "text",
        "--silence-limit",
        "4s",
        "--job-deadline",
        "6s",
        "--max-restarts",
        "100000",
        "--memory-limit",
        "1024",
    ];
    words.iter().map(|it| (*it).to_owned()).collect()
}

fn demand(mut driver: Driver, start_kib: u64, end_kib: u64, seconds: u64) {
    let judgement = judge(&driver.farm, &driver.files, &[]);
    let log = format!(
        "{}\n{}",
        driver.tally.last_lines(),
        tail(&driver.farm.log())
    );
    judgement.demand(&log);
    reports_are_there(&driver);
    let fresh = Content::Good(driver.dice.roll());
    driver.farm.write("fresh.xodr", &fresh.bytes());
    let verdict = driver.farm.verdict("fresh.xodr");
    assert_eq!(verdict.verdict, fresh.verdict(), "{verdict:?}");
    driver.sample();
    let verdicts: u64 = verdicts_in_journal(&driver.farm.journal()).values().sum();
    let (files, condemned, peak) = (driver.files.len(), judgement.condemned, driver.peak_kib);
    let tally = driver.tally.clone();
    let broker = driver.broker.take().unwrap();
    let everything = is_inside();
    end(&driver.farm, broker);
    if everything {
        until("nothing is left in /dev/shm", || {
            shm_segments("qc").is_empty().then_some(())
        });
    }
    assert!(peak < PEAK_KIB, "a broker took {peak} KiB");
    report(&format!(
        "chaos: {seconds} s: {} kills survived ({tally}); {files} files in the end, {verdicts} \
         verdicts in the journal, 0 lost, {condemned} undetermined because a bundle was killed \
         twice while alone with the file; 0 segments and 0 processes left; private memory of the \
         broker {start_kib} KiB before, {end_kib} KiB after, {peak} KiB at most",
        tally.kills()
    ));
}

/// The reporter has everything, too, and nothing about files that have gone.
fn reports_are_there(driver: &Driver) {
    for name in driver.files.keys() {
        let path = driver.farm.out().join(format!("{name}.txt"));
        until_or(
            "a report",
            || path.exists().then_some(()),
            || format!("{}\n{:#?}", path.display(), driver.farm.status()),
        );
    }
    let left = || -> Vec<String> {
        let entries = std::fs::read_dir(driver.farm.out()).unwrap().flatten();
        let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
        let gone = |name: &String| {
            let file = name.strip_suffix(".txt");
            file.is_some_and(|file| !driver.files.contains_key(file))
        };
        names.filter(gone).collect()
    };
    until_or(
        "no report of a file that has gone",
        || left().is_empty().then_some(()),
        || format!("{:?}\n{:#?}", left(), driver.farm.status()),
    );
}

impl Driver {
    /// Private memory of the broker that runs.
    fn memory_kib(&self) -> u64 {
        let pid = self.broker.as_ref().unwrap().pid();
        private_kib(pid).unwrap()
    }

    /// Remembers how much memory brokers take at most.
    pub fn sample(&mut self) {
        let Some(broker) = &self.broker else { return };
        let now = private_kib(broker.pid()).unwrap_or_default();
        let peak = peak_private_kib(broker.pid()).unwrap_or_default();
        self.peak_kib = self.peak_kib.max(now).max(peak);
    }
}
