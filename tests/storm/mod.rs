//! The storm: a driver causes every possible failure in a farm, and the conditions are checked at
//! the end.

mod driver;
mod failures;
mod files;
mod history;
mod ledger;
mod operators;
mod strain;
mod tally;
mod verdicts;
mod visitors;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use driver::Driver;
use history::{Seen, Watchers};
use strain::Strain;
use verdicts::Removals;

use crate::support::cli::files_below;
use crate::support::content::Content;
use crate::support::farm::{Farm, shm_segments, tail};
use crate::support::inside::is_inside;
use crate::support::judge::{bases_in_journal, judge_with, verdicts_in_journal};
use crate::support::processes::{peak_private_kib, private_kib};
use crate::support::reports::{REPORTS, reported};
use crate::support::watchdog::until_or;
use crate::{end, report};

/// Returns the length of the storm in seconds.
pub fn seconds() -> u64 {
    crate::number_from("QCBUS_CHAOS_SECONDS", 8)
}

/// Limit for the broker's peak private memory. A higher peak means that its memory is not bounded.
const PEAK_KIB: u64 = 500 << 10;

/// Runs two storms, one after another. In the first, a configuration names the required bundles. In
/// the second, only the registry does. Waits until the farm is at rest, and judges.
pub fn rage(seed: u64, seconds: u64) {
    report(&format!(
        "chaos: QCBUS_CHAOS_SEED={seed} QCBUS_CHAOS_SECONDS={seconds}"
    ));
    let half = Duration::from_secs(seconds) / 2;
    rage_under(Demands::Configuration, seed, half);
    rage_under(Demands::Registry, seed.wrapping_add(1), half);
}

/// Source of the required bundles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Demands {
    Configuration,
    Registry,
}

fn rage_under(demands: Demands, seed: u64, length: Duration) {
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    std::fs::write(&config, failures::CALM).unwrap();
    farm.arguments = arguments(&farm);
    if demands == Demands::Configuration {
        let words = ["-c".to_owned(), config.to_string_lossy().into_owned()];
        farm.arguments.extend(words);
    }
    let mut driver = Driver::new(farm, seed);
    driver.install();
    driver.write_shared();
    let watchers = Watchers::start(&driver.farm, driver.ledger.start, seed);
    driver.start_broker();
    driver.write_some(40);
    driver.calm_down();
    let start_kib = driver.memory_kib();
    let until = Instant::now() + length;
    while Instant::now() < until {
        driver.step();
    }
    driver.calm_down();
    let end_kib = driver.memory_kib();
    let history = watchers.end();
    // A bundle required by the configuration stays required while its manifest is missing.
    let removals = match demands {
        Demands::Configuration => Removals::default(),
        Demands::Registry => Removals::new(&driver.removals, &history),
    };
    at_every_moment(&mut driver, &history, &removals);
    report(&format!("chaos: who must judge says the {demands:?}"));
    demand(driver, history.len(), start_kib, end_kib, length.as_secs());
}

fn arguments(farm: &Farm) -> Vec<String> {
    let gate = farm.gate();
    let words = [
        "--gate",
        &gate.to_string_lossy(),
        "--silence-limit",
        "4s",
        "--job-deadline",
        "6s",
        "--max-restarts",
        "100000",
        "--memory-limit",
        "1024",
    ];
    let reports = REPORTS.iter().flat_map(|(alias, _)| ["--report", alias]);
    words
        .into_iter()
        .chain(reports)
        .map(str::to_owned)
        .collect()
}

/// Checks the conditions that must hold for every observation of the storm.
fn at_every_moment(driver: &mut Driver, history: &[Seen], removals: &Removals) {
    let mut all = verdicts::complaints(history, &driver.ledger, removals);
    let strain = Strain::new(history);
    let dead = verdicts::innocent_dead(history, |name, at| driver.was_stopped(name, at));
    let mut starved = Vec::new();
    for (at, name, why) in dead {
        match strain.was_slow(at) {
            true => starved.push(name.to_owned()),
            false => all.push(format!("{:9.3} {name}: {why}", at.as_secs_f64())),
        }
    }
    report(&format!(
        "chaos: work took {:.1} times as long in the slowest ten seconds; {} bundles that were ended then are not counted",
        strain.slowest(),
        starved.len()
    ));
    for name in starved {
        *driver.harmed.entry(name).or_default() += 1;
    }
    let first: Vec<&String> = all.iter().take(20).collect();
    let (deeds, log) = (driver.tally.last_lines(), tail(&driver.farm.log()));
    assert!(
        all.is_empty(),
        "{} observations are wrong: {first:#?}\n{deeds}\n{log}",
        all.len()
    );
}

/// A pair of file and bundle is condemned only after two deaths. The count of a bundle is therefore
/// at most half its deaths.
fn condemned_are_few(driver: &Driver, condemned: &BTreeMap<String, u64>) {
    for (bundle, count) in condemned {
        let harmed = driver.harmed.get(bundle).copied().unwrap_or_default();
        assert!(
            count * 2 <= harmed,
            "{bundle} is condemned for {count} files but was harmed only {harmed} times\n{}",
            driver.tally.last_lines()
        );
    }
}

/// Restarts the broker and returns how many unchanged files are checked a second time, and why. A
/// file with a verdict must keep it over a restart.
fn judged_again_for_nothing(driver: &mut Driver) -> (u64, String) {
    let jobs =
        |driver: &Driver| -> u64 { verdicts_in_journal(&driver.farm.journal()).values().sum() };
    let (before, bases) = (jobs(driver), bases_in_journal(&driver.farm.journal()));
    if let Some(broker) = &mut driver.broker {
        broker.kill();
    }
    driver.start_broker();
    driver.farm.settle(driver.files.len());
    let doubled = jobs(driver) - before;
    if doubled == 0 {
        return (0, String::new());
    }
    let after = bases_in_journal(&driver.farm.journal());
    let changed = after
        .iter()
        .filter(|(path, now)| bases.get(*path) != Some(*now));
    let changed = changed.take(3).map(|(path, now)| {
        let before = bases.get(path);
        format!("{path}:\n  before {before:?}\n  after  {now:?}\n")
    });
    let why = format!("{}{}", changed.collect::<String>(), driver.what_is());
    (doubled, why)
}

fn demand(mut driver: Driver, seen: usize, start_kib: u64, end_kib: u64, seconds: u64) {
    let mut judgement = judge_with(&driver.farm, &driver.files, &driver.parts, &[]);
    let lost = driver.files.len() - judgement.with_result;
    judgement.gate(
        &driver.farm,
        &driver.files,
        &driver.parts,
        &driver.farm.gate(),
    );
    let log = format!(
        "{}\n{}",
        driver.tally.last_lines(),
        tail(&driver.farm.log())
    );
    judgement.demand(&log);
    condemned_are_few(&driver, &judgement.condemned);
    nothing_hidden_is_judged(&driver);
    reports_are_there(&driver);
    let fresh = Content::Good(driver.dice.roll());
    driver.farm.write("fresh.xodr", &fresh.bytes());
    driver.files.insert("fresh.xodr".to_owned(), fresh.clone());
    let verdict = driver.farm.verdict("fresh.xodr");
    assert_eq!(verdict.verdict, fresh.verdict(), "{verdict:?}");
    driver.sample();
    let (doubled, why) = judged_again_for_nothing(&mut driver);
    let verdicts: u64 = verdicts_in_journal(&driver.farm.journal()).values().sum();
    let condemned: u64 = judgement.condemned.values().sum();
    let (files, peak) = (driver.files.len(), driver.peak_kib);
    let tally = driver.tally.clone();
    let broker = driver.broker.take().unwrap();
    let everything = is_inside();
    end(&driver.farm, broker);
    let log_of_the_end = driver.farm.log();
    if everything {
        until_or(
            "nothing is left in /dev/shm",
            || shm_segments("qc").is_empty().then_some(()),
            // The names and the last log of the broker show which process left them.
            || {
                let files = files_below(std::path::Path::new("/dev/shm"));
                let (roots, log) = (shm_segments("qc"), tail(&log_of_the_end));
                format!("{roots:?} {files:#?}\n{log}")
            },
        );
    }
    assert!(peak < PEAK_KIB, "a broker used {peak} KiB");
    assert_eq!(
        (lost, doubled),
        (0, 0),
        "no verdict may be lost or doubled\n{why}"
    );
    report(&format!(
        "chaos: {seconds} s: {} kills survived ({tally}); {files} files in the end, {verdicts} \
         verdicts in the journal, {lost} lost, {doubled} judged again for nothing, {seen} things seen \
         on the way; {condemned} undetermined because a bundle was killed \
         twice while alone with the file; 0 segments and 0 processes left; private memory of the \
         broker {start_kib} KiB before, {end_kib} KiB after, {peak} KiB at most",
        tally.kills()
    ));
}

/// Checks that hidden files of copy tools have no result and are not published.
fn nothing_hidden_is_judged(driver: &Driver) {
    for directory in [driver.farm.out(), driver.farm.gate()] {
        let mut files = files_below(&directory).into_iter();
        let hidden = files.find(|it| it.starts_with(files::HIDDEN));
        assert_eq!(hidden, None, "{}", driver.tally.last_lines());
    }
}

/// Checks that the reporters have all files, and no reports about removed files.
fn reports_are_there(driver: &Driver) {
    let with_suffixes = |name: &String| REPORTS.map(|(_, suffix)| format!("{name}{suffix}"));
    for name in driver.files.keys().flat_map(with_suffixes) {
        let path = driver.farm.out().join(name);
        until_or(
            "a report",
            || path.exists().then_some(()),
            || format!("{}\n{:#?}", path.display(), driver.farm.status()),
        );
    }
    let left = || -> Vec<String> {
        let files = files_below(&driver.farm.out()).into_iter();
        let names = files.map(|it| it.to_string_lossy().into_owned());
        let gone =
            |name: &String| reported(name).is_some_and(|file| !driver.files.contains_key(file));
        names.filter(gone).collect()
    };
    until_or(
        "no report of a file that has gone",
        || left().is_empty().then_some(()),
        || format!("{:?}\n{:#?}", left(), driver.farm.status()),
    );
}

impl Driver {
    /// Returns the private memory of the running broker.
    fn memory_kib(&self) -> u64 {
        let pid = self.broker.as_ref().unwrap().pid();
        private_kib(pid).unwrap()
    }

    /// Records the maximum memory of the brokers.
    pub fn sample(&mut self) {
        let Some(broker) = &self.broker else { return };
        let now = private_kib(broker.pid()).unwrap_or_default();
        let peak = peak_private_kib(broker.pid()).unwrap_or_default();
        self.peak_kib = self.peak_kib.max(now).max(peak);
    }
}
