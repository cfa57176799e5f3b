//! Hidden directories contain private files of copy tools, snapshots and volumes. No file in them
//! is judged or published, unless the directory is named explicitly.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use crate::support::broker::Broker;
use crate::support::cli::{Cli, files_below};
use crate::support::content::{CATALOG, Content, Mark};
use crate::support::farm::{Farm, tail};
use crate::support::judge::verdicts_in_journal;
use crate::support::watchdog::{until_or, until_so};
use qcbus_messages::Verdict;
use qcbus_messages::control::{FileVerdict, Request, Response};

/// Creates a farm with a gate.
fn farm() -> Farm {
    let mut farm = Farm::new();
    let gate = farm.gate().to_string_lossy().into_owned();
    farm.arguments.extend(["--gate".to_owned(), gate]);
    farm
}

/// Puts a file into the watched directory and creates missing directories.
fn put(farm: &Farm, name: &str, content: &Content) {
    let path = farm.root().join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, content.bytes()).unwrap();
}

/// Asks for the verdict on a file.
fn ask(farm: &Farm, file: &Path) -> Option<Response> {
    farm.ask(&Request::Wait {
        file: file.to_path_buf(),
        timeout_ms: Some(120_000),
    })
}

/// Returns the verdict on a file at any place.
fn verdict_at(farm: &Farm, file: &Path) -> FileVerdict {
    let answer = ask(farm, file);
    let Some(Response::Verdict(verdict)) = answer else {
        panic!("{}: {answer:?}\n{}", file.display(), tail(&farm.log()));
    };
    verdict
}

fn is_published(farm: &Farm, expected: &[&str]) {
    let expected: Vec<PathBuf> = expected.iter().map(PathBuf::from).collect();
    let now = || {
        let mut found = files_below(&farm.gate());
        found.retain(|it| it != Path::new(".qcbus-gate"));
        found
    };
    until_or(
        "exactly this is published",
        || (now() == expected).then_some(()),
        || format!("{:?}\n{}", now(), tail(&farm.log())),
    );
}

fn down(farm: &Farm, mut broker: Broker) {
    farm.qcbus(&["down"]);
    broker.wait();
}

/// Directories in which copy tools and file servers keep their own files.
const OF_OTHERS: [&str; 5] = [
    ".~tmp~",
    ".snapshot/hourly.0",
    ".stversions",
    ".Trash-1000/files",
    "maps/.sync",
];

#[test]
fn files_in_hidden_directories_are_ignored() {
    let farm = farm();
    // Some files are there at the start, and some come later.
    for (number, directory) in (0..).zip(OF_OTHERS) {
        put(
            &farm,
            &format!("{directory}/old.xodr"),
            &Content::Good(number),
        );
    }
    let _broker = farm.serve_ready();
    for (number, directory) in (10..).zip(OF_OTHERS) {
        put(
            &farm,
            &format!("{directory}/b.xodr"),
            &Content::Good(number),
        );
    }
    put(&farm, "maps/a.xodr", &Content::Good(20));
    farm.settle(1);
    is_published(&farm, &["maps/a.xodr"]);
    // `rsync --delay-updates` ends like this.
    let (aside, place) = (
        farm.root().join(".~tmp~/b.xodr"),
        farm.root().join("b.xodr"),
    );
    let Some(Response::Unwatched { reason }) = ask(&farm, &aside) else {
        panic!("{}", tail(&farm.log()));
    };
    assert!(reason.contains("hidden directory"), "{reason}");
    std::fs::rename(aside, place).unwrap();
    assert_eq!(farm.verdict("b.xodr").verdict, Verdict::Accepted);
    // A directory that gets a hidden name takes its files away, and later brings them back.
    let (maps, hidden) = (farm.root().join("maps"), farm.root().join(".maps"));
    std::fs::rename(&maps, &hidden).unwrap();
    is_published(&farm, &["b.xodr"]);
    std::fs::rename(&hidden, &maps).unwrap();
    is_published(&farm, &["b.xodr", "maps/a.xodr"]);
}

#[test]
fn hidden_directory_is_judged_while_a_qcignore_names_it() {
    let farm = farm();
    put(&farm, ".work/a.xodr", &Content::Good(1));
    put(&farm, "b.xodr", &Content::Good(2));
    let _broker = farm.serve_ready();
    farm.settle(1);
    farm.write(".qcignore", b"!.work/\n");
    is_published(&farm, &[".work/a.xodr", "b.xodr"]);
    put(&farm, ".work/c.xodr", &Content::NoHeader(3));
    assert_eq!(farm.verdict(".work/c.xodr").verdict, Verdict::Rejected);
    std::fs::remove_file(farm.root().join(".qcignore")).unwrap();
    is_published(&farm, &["b.xodr"]);
    farm.settle(1);
}

#[test]
fn hidden_directory_that_is_watched_itself_is_judged() {
    let mut farm = farm();
    let work = farm.root().join(".work");
    for name in [".work/a.xodr", ".work/.deeper/b.xodr", ".other/c.xodr"] {
        put(&farm, name, &Content::Good(1));
    }
    farm.arguments.push(work.to_string_lossy().into_owned());
    let _broker = farm.serve_ready();
    farm.settle(1);
    put(&farm, ".work/later.xodr", &Content::Good(2));
    assert_eq!(farm.verdict(".work/later.xodr").verdict, Verdict::Accepted);
    // Two directories are watched, so results are below the names of both.
    is_published(&farm, &["farm/.work/a.xodr", "farm/.work/later.xodr"]);
}

/// Replaces the contents of a volume, as Kubernetes does it.
fn swap(volume: &Path, generation: &str, content: &Content) {
    let directory = volume.join(generation);
    std::fs::create_dir_all(&directory).unwrap();
    std::fs::write(directory.join("map.xodr"), content.bytes()).unwrap();
    symlink(generation, volume.join("..data_tmp")).unwrap();
    std::fs::rename(volume.join("..data_tmp"), volume.join("..data")).unwrap();
}

#[test]
fn kubernetes_file_is_judged_once_for_each_generation() {
    let farm = farm();
    let volume = farm.root().join("cm");
    swap(&volume, "..2026_11_27", &Content::Good(1));
    symlink("..data/map.xodr", volume.join("map.xodr")).unwrap();
    let _broker = farm.serve_ready();
    farm.settle(1);
    is_published(&farm, &["cm/map.xodr"]);
    swap(&volume, "..2026_11_28", &Content::NoHeader(2));
    assert_eq!(farm.verdict("cm/map.xodr").verdict, Verdict::Rejected);
    is_published(&farm, &[]);
    swap(&volume, "..2026_11_29", &Content::Good(3));
    is_published(&farm, &["cm/map.xodr"]);
    std::fs::remove_dir_all(volume.join("..2026_11_27")).unwrap();
    // A link from elsewhere leads to the visible name.
    let elsewhere = farm.base().join("elsewhere.xodr");
    symlink(volume.join("map.xodr"), &elsewhere).unwrap();
    let told = verdict_at(&farm, &elsewhere);
    assert_eq!(
        (told.file, told.verdict),
        (volume.join("map.xodr"), Verdict::Accepted)
    );
    assert!(farm.settle(1).unseen.is_empty());
    let verdicts = verdicts_in_journal(&farm.journal());
    let once =
        |((path, ..), count): (&(String, _, _), &u64)| path.ends_with("cm/map.xodr") && *count == 1;
    assert!(
        verdicts.len() == 3 && verdicts.iter().all(once),
        "{verdicts:?}"
    );
}

/// Creates an acceptable scenario on a map in a hidden directory.
fn scenario_on_a_hidden_map(farm: &Farm) {
    put(farm, CATALOG, &Content::Catalog(1, Mark::Clean));
    put(farm, ".work/map.xodr", &Content::Good(2));
    put(
        farm,
        "s.xosc",
        &Content::Scenario(3, ".work/map.xodr".to_owned()),
    );
}

#[test]
fn hidden_map_is_read_and_published_with_its_scenario() {
    let farm = farm();
    scenario_on_a_hidden_map(&farm);
    let _broker = farm.serve_ready();
    let all = [".work/map.xodr", CATALOG, "s.xosc"];
    assert_eq!(farm.verdict("s.xosc").verdict, Verdict::Accepted);
    is_published(&farm, &all);
    farm.settle(2);
    // A scenario is not published with a map that it does not fit.
    put(&farm, ".work/map.xodr", &Content::Elsewhere(4));
    assert_eq!(farm.verdict("s.xosc").verdict, Verdict::Rejected);
    is_published(&farm, &[CATALOG]);
    put(&farm, ".work/map.xodr", &Content::Good(5));
    assert_eq!(farm.verdict("s.xosc").verdict, Verdict::Accepted);
    is_published(&farm, &all);
}

/// The journal is from a version that judged files in hidden directories. A `.qcignore` simulates
/// it.
#[test]
fn results_of_hidden_directories_are_withdrawn_at_the_start() {
    let farm = farm();
    scenario_on_a_hidden_map(&farm);
    put(&farm, ".work/alone.xodr", &Content::Good(6));
    farm.write(".qcignore", b"!.work/\n");
    let broker = farm.serve_ready();
    farm.settle(4);
    let all = [".work/alone.xodr", ".work/map.xodr", CATALOG, "s.xosc"];
    is_published(&farm, &all);
    down(&farm, broker);
    std::fs::remove_file(farm.root().join(".qcignore")).unwrap();
    let _broker = farm.serve_ready();
    assert_eq!(farm.verdict("s.xosc").verdict, Verdict::Accepted);
    farm.settle(2);
    is_published(&farm, &all[1..]);
    let of_hidden = |it: &PathBuf| it.starts_with(".work");
    assert!(!files_below(&farm.out()).iter().any(of_hidden));
    assert!(farm.log().contains("results withdrawn"), "{}", farm.log());
}

#[test]
fn check_scans_a_hidden_directory_only_when_named() {
    let cli = Cli::new();
    cli.write("maps/a.xodr", Content::Good(1).bytes());
    cli.write("maps/.work/b.xodr", Content::Good(2).bytes());
    cli.write("maps/.work/.deeper/c.xodr", Content::Good(3).bytes());
    let checks = |directory: &str, paths: &[&str], files: &str| {
        let said = cli.check_in(&cli.path().join(directory), paths, "out");
        let counted = format!("of {files};");
        assert!(
            said.stdout.contains(&counted),
            "{paths:?}: {}",
            said.whole(&cli)
        );
        assert_eq!(said.code, Some(0));
    };
    checks("maps", &["."], "1 file");
    checks("", &["maps/.work"], "1 file");
    checks("maps/.work", &["."], "1 file");
    checks("maps", &[".work/b.xodr"], "1 file");
    checks("maps", &[".", ".work"], "2 files");
    checks("maps", &[".", ".work/b.xodr", "a.xodr"], "2 files");
    cli.write("maps/.qcignore", "!.work/\n!.deeper/\n");
    checks("maps", &["."], "3 files");
    checks("maps", &[".", ".work", ".work/b.xodr"], "3 files");
}

#[test]
fn link_to_a_hidden_directory_is_reported_as_unwatched() {
    let farm = farm();
    put(&farm, ".releases/7/a.xodr", &Content::Good(1));
    put(&farm, "b.xodr", &Content::Good(2));
    symlink(".releases/7", farm.root().join("current")).unwrap();
    let _broker = farm.serve_ready();
    until_so("the link is named in the status", || {
        let status = farm.status();
        status.is_some_and(|it| it.unseen.iter().any(|it| it.path.ends_with("current")))
    });
    is_published(&farm, &["b.xodr"]);
}
