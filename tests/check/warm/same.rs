//! Tests that an on-demand check has the same outcome as a check without the broker.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

use qcbus_document::FileKind;
use qcbus_messages::Verdict;

use super::bench::{Bench, Made, scenario, text};
use crate::support::cli::{files_below, sample_farm};
use crate::support::content::{CATALOG, Content, Mark};

/// Returns files of every kind of verdict, by name.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let torn = Content::Good(5).bytes();
    let mut files = vec![
        ("good.xodr", Content::Good(1).bytes()),
        ("no_header.xodr", Content::NoHeader(2).bytes()),
        ("no_version.xodr", Content::NoVersion(3).bytes()),
        ("wrong_root.xodr", Content::WrongRoot(4).bytes()),
        ("torn.xodr", torn[..torn.len() / 2].to_vec()),
        ("empty.xodr", Vec::new()),
        ("empty.xosc", Vec::new()),
        ("no_xml.xodr", b"this is no XML\n".to_vec()),
        ("no_archive.xodrz", b"this is no archive\n".to_vec()),
        ("no_archive.mosc", b"nor is this\n".to_vec()),
        (
            "without_map.xosc",
            Content::Scenario(6, "nosuch.xodr".to_owned()).bytes(),
        ),
        (
            "names/with spaces & ümlauts.xodr",
            Content::NoHeader(7).bytes(),
        ),
        ("names/two\nlines.xodr", Content::NoHeader(8).bytes()),
    ];
    files.extend(scenario());
    files
}

#[test]
fn references_count_with_and_without_the_broker() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    for (name, bytes) in scenario() {
        bench.beside(name, &bytes);
    }
    let file = text(&bench.cli.path().join("scenario.xosc"));
    assert_eq!(bench.compared(&[&file]), Made::Warm);
    bench.beside("map.xodr", Content::NoHeader(2).bytes());
    assert_eq!(bench.compared(&[&file]), Made::Cold);
    assert_eq!(bench.compared(&[&file, "--own-verdict"]), Made::Warm);
}

#[test]
fn verdicts_agree_inside_and_outside_the_farm() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    for (name, bytes) in files() {
        bench.beside(name, &bytes);
        bench.watched(name, &bytes);
    }
    for (name, _) in files() {
        for at in [bench.cli.path(), &bench.farm.root()] {
            let file = text(&at.join(name));
            let made = bench.compared(&[&file]);
            // The broker leaves an unreadable file to the caller, because the caller may be able to
            // read it.
            let may_be_cold = name.contains("no_archive");
            assert!(made == Made::Warm || may_be_cold, "{file} was checked cold");
        }
    }
}

#[test]
fn sample_farm_gets_the_same_verdicts() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let from = sample_farm();
    for file in files_below(&from) {
        bench.watched(
            file.to_str().unwrap(),
            std::fs::read(from.join(&file)).unwrap(),
        );
    }
    for file in files_below(&from) {
        if FileKind::of_path(&file).is_some() {
            let file = text(&bench.farm.root().join(file));
            assert_eq!(bench.compared(&[&file]), Made::Warm, "{file}");
        }
    }
}

#[test]
fn several_files_get_the_same_verdicts() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let mut maps = Vec::new();
    for number in 0..9 {
        let content = match number % 3 {
            0 => Content::Good(number),
            1 => Content::NoHeader(number),
            _ => Content::WrongRoot(number),
        };
        maps.push(bench.beside(&format!("d/{number}.xodr"), content.bytes()));
    }
    let maps: Vec<&str> = maps.iter().map(String::as_str).collect();
    assert_eq!(bench.compared(&maps), Made::Warm);
    // The same file is given twice, and under another path.
    let again = [maps[0], maps[0], "d/../d/0.xodr"];
    assert_eq!(bench.compared(&again), Made::Warm);
    let files: Vec<String> = scenario()
        .iter()
        .map(|(name, bytes)| bench.beside(name, bytes))
        .collect();
    let both: Vec<&str> = files.iter().map(String::as_str).collect();
    // A map and a scenario on it are checked together, with a good and a bad map.
    bench.compared(&both);
    bench.beside("map.xodr", Content::NoHeader(3).bytes());
    bench.compared(&both);
    bench.compared(&[both[2]]);
    // These are more files than a check asks the broker for.
    let many: Vec<String> = (0..65)
        .map(|number| bench.beside(&format!("m/{number}.xodr"), Content::Good(number).bytes()))
        .collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    assert_eq!(bench.compared(&many), Made::Cold);
    assert_eq!(bench.compared(&many[1..]), Made::Warm);
    // The check itself scans a directory, without the broker.
    assert_eq!(bench.compared(&["d"]), Made::Cold);
}

#[test]
fn every_output_format_is_the_same() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let bad = bench.beside("bad.xodr", Content::NoHeader(1).bytes());
    let good = bench.beside("good.xodr", Content::Good(2).bytes());
    for format in [
        "full",
        "concise",
        "json",
        "junit",
        "github",
        "gitlab",
        "sarif",
        "html=out/page.html",
        "json=out/all.json,junit=out/all.xml",
    ] {
        let made = bench.compared(&[&bad, &good, "--output-format", format]);
        assert_eq!(made, Made::Warm, "{format}");
    }
    for words in [
        &["--statistics"][..],
        &["--fail-level", "information"],
        &["--exit-zero"],
        &["--color", "always"],
    ] {
        let words = [&[good.as_str(), &bad], words].concat();
        assert_eq!(bench.compared(&words), Made::Warm, "{words:?}");
    }
    let quiet = [good.as_str(), &bad, "-q"];
    assert_eq!(
        bench.cold(&quiet),
        bench.outcome(&mut bench.command(&quiet))
    );
}

/// The broker sees its whole directory. A check of a file sees only what lies beside the file.
#[test]
fn includes_are_followed_as_without_the_broker() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let including = Content::Including(1, "../part.xml".to_owned()).bytes();
    let part = Content::Part(2, Mark::Clean).bytes();
    bench.watched("part.xml", &part);
    let file = bench.watched("below/map.xodr", &including);
    assert_eq!(bench.compared(&[&file]), Made::Warm);
    // The broker and the check do not change what the other sees, in either order.
    let served = |name: &str| bench.farm.verdict(name).verdict;
    assert_eq!(served("below/map.xodr"), Verdict::Accepted);
    assert_eq!(bench.compared(&[&file]), Made::Warm);
    // A map that a scenario uses is read for several files.
    let scenario = Content::Scenario(3, "map.xodr".to_owned()).bytes();
    bench.watched(
        "below/catalogs/vehicles.xosc",
        Content::Catalog(4, Mark::Clean).bytes(),
    );
    let scenario = bench.watched("below/scenario.xosc", scenario);
    // The map is rejected if the include is not followed. A check without the broker counts this
    // verdict.
    assert_eq!(bench.compared(&[&scenario]), Made::Cold);
    assert_eq!(served("below/scenario.xosc"), Verdict::Accepted);
    assert_eq!(bench.compared(&[&scenario]), Made::Cold);
    assert_eq!(bench.compared(&[&scenario, "--own-verdict"]), Made::Warm);
    // A file beside the map is included by both.
    let (whole, view) = Content::road_in_two_parts();
    bench.watched("two/view.xml", view);
    let file = bench.watched("two/map.xodr", whole);
    assert_eq!(bench.compared(&[&file]), Made::Warm);
}

#[test]
fn changed_dependency_is_noticed_at_once() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let mut files = Vec::new();
    for (name, bytes) in scenario() {
        files.push(bench.beside(name, bytes));
    }
    let scenario = &files[2];
    for number in 10..14 {
        bench.beside("map.xodr", Content::Elsewhere(number).bytes());
        assert_eq!(bench.compared(&[scenario]), Made::Warm);
        bench.beside("map.xodr", Content::Good(number).bytes());
        assert_eq!(bench.compared(&[scenario]), Made::Warm);
        bench.beside(CATALOG, Content::OtherCatalog(number).bytes());
        assert_eq!(bench.compared(&[scenario]), Made::Warm);
        bench.beside(CATALOG, Content::Catalog(number, Mark::Clean).bytes());
        std::fs::remove_file(&files[0]).unwrap();
        assert_eq!(bench.compared(&[scenario]), Made::Warm);
    }
}

#[test]
fn unusual_names_and_links_give_the_same_result() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let bytes = Content::NoHeader(1).bytes();
    let name = OsStr::from_bytes(b"no\xfftext.xodr");
    std::fs::write(bench.cli.path().join(name), &bytes).unwrap();
    let link = |to: &str, name: &str| {
        std::os::unix::fs::symlink(to, bench.cli.path().join(name)).unwrap();
    };
    bench.beside("plain.bin", &bytes);
    bench.beside("map.xodr", &bytes);
    link("plain.bin", "named.xodr");
    link("map.xodr", "other.bin");
    link("nosuch.xodr", "dangling.xodr");
    link(".", "here");
    for word in ["named.xodr", "other.bin", "here/map.xodr"] {
        assert_eq!(bench.compared(&[word]), Made::Warm, "{word}");
    }
    for word in ["dangling.xodr", "nosuch.xodr", "plain.bin"] {
        assert_eq!(bench.compared(&[word]), Made::Cold, "{word}");
    }
    let ask = |more: &[&str]| {
        let mut command = bench.command(more);
        bench.outcome(command.arg(name))
    };
    assert_eq!(ask(&["--cold"]), ask(&[]));
}

#[test]
fn unwritable_results_are_refused_alike() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let file = bench.beside("map.xodr", Content::Good(1).bytes());
    let refused = |out: &str, more: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.args(["check", &file, "--out", out]).args(more);
        command.arg("--instance-dir").arg(bench.farm.instance());
        bench.outcome(&mut command)
    };
    // The outputs are the broker's own directory, one below it, and a path that cannot be a
    // directory.
    let served = text(&bench.farm.out());
    for out in [served.as_str(), &format!("{served}/below"), &file] {
        let cold = refused(out, &["--cold"]);
        assert_eq!(cold, refused(out, &[]), "{out}");
        assert_eq!(cold.code(), Some(2), "{cold:?}");
    }
    // A directory already exists at the path of the result.
    let taken = bench.cli.path().join("taken/map.xodr.xqar/x");
    std::fs::create_dir_all(taken).unwrap();
    assert_eq!(refused("taken", &["--cold"]), refused("taken", &[]));
}
