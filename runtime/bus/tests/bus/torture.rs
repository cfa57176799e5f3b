//! Kills at random moments: processes that are started afterwards work as if nothing had happened.
//! No answer is lost, doubled or out of order within a session, and nothing is left behind.
//!
//! `QCBUS_TORTURE_SECONDS` makes it longer, `QCBUS_TORTURE_SEED` repeats a run.

use std::time::{Duration, Instant};

use crate::helper::Helper;
use crate::support::{Site, files_of, fresh_number, identity_of, run, shared_memory_named};

const BUNDLES: usize = 3;

fn from_environment(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
fn random_kills_lose_nothing_and_leave_nothing() {
    let seed = from_environment("QCBUS_TORTURE_SEED").unwrap_or_else(fresh_number);
    let seconds = from_environment("QCBUS_TORTURE_SECONDS").unwrap_or(5);
    println!("QCBUS_TORTURE_SEED={seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    let site = Site::new();
    let start = |role| Helper::start(role, &site.instance);
    let mut broker = start("serves");
    let mut bundles: Vec<Helper> = (0..BUNDLES).map(|_| start("answers_jobs")).collect();
    assert!(broker.line().starts_with("serves"));
    let identity = identity_of(&site.instance);

    let until = Instant::now() + Duration::from_secs(seconds);
    let (mut kills, mut jobs) = (0, 0);
    while Instant::now() < until {
        jobs += judge(&mut broker);
        // Most kills come in bursts, within the first milliseconds of a process.
        let calm = if dice.u64(..3) == 0 { 600 } else { 30 };
        pause(Duration::from_millis(dice.u64(..calm)));
        kills += 1;
        let whom = dice.u64(..BUNDLES as u64 + 2) as usize;
        if whom < BUNDLES {
            std::mem::replace(&mut bundles[whom], start("answers_jobs")).kill();
        } else {
            judge(&mut broker);
            // The lock is free only after the death of the old broker.
            broker.kill();
            broker = start("serves");
        }
    }
    judge(&mut broker);
    broker.kill();
    broker = start("serves");
    jobs += settle(&mut broker);
    println!("{kills} kills, {jobs} hundred jobs");
    broker.kill();
    for bundle in bundles {
        bundle.kill();
    }
    run(async move {
        drop(site.host());
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
        assert_eq!(shared_memory_named(&identity), Vec::<String>::new());
    });
}

/// Pauses for a random time in which things can happen. It waits for no event.
fn pause(time: Duration) {
    std::thread::sleep(time);
}

/// Counts the reported jobs of a broker, and fails if it reports a fault.
fn judge(broker: &mut Helper) -> usize {
    let lines = broker.lines_so_far();
    let wrong: Vec<_> = lines.iter().filter(|line| line.contains("wrong")).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    lines.iter().filter(|line| line.starts_with("done")).count()
}

/// Waits until each bundle has done a few hundred jobs with this broker after the storm.
fn settle(broker: &mut Helper) -> usize {
    let mut done = 0;
    let mut past_three_hundred = 0;
    while past_three_hundred < BUNDLES {
        let line = broker.line();
        assert!(!line.contains("wrong"), "{line}");
        if line.starts_with("done") {
            done += 1;
        }
        if line == "done 301" {
            past_three_hundred += 1;
        }
    }
    done
}
