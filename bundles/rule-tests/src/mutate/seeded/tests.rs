//! Tests of the lists and the verdicts, on small documents.

use std::collections::BTreeSet;
use std::path::Path;

use crate::mutate::{Rows, Said, Spots, new_ones};
use qcbus_sdk::Level;

use super::judge::{Found, judge};
use super::table;

#[test]
fn seeded_fault_list_is_parsed() {
    let head = "@a = p:d/a.xosc\nid | sort | @a | warning\n";
    let entry = format!("{head}  A | set @b=c | in: ../m.xodr\n  at: A B\n  at: .\n  why: so\n");
    let all = table::read(&entry, "name").unwrap();
    assert_eq!((all.len(), all[0].at.len()), (1, 2));
    assert_eq!(all[0].edits[0].file, Path::new("m.xodr"));
    assert_eq!(all[0].level, Some(Level::Warning));
    for (wrong, why) in [
        (format!("{head}  why: so\n"), "no edit"),
        (format!("{head}  A | drop\n"), "no reason"),
        (
            format!("{head}  A drop\n  why: so\n"),
            "expected an edit or a place",
        ),
        (
            format!("{head}  A | drop | in: ../../m\n  why: so\n"),
            "leads out of",
        ),
        (
            format!("{entry}{}", entry.replace("@a = p:d/a.xosc", "")),
            "twice",
        ),
        ("id | sort | @b | error\n".to_owned(), "unknown alias"),
        ("id | sort | p:b | grave\n".to_owned(), "unknown level"),
    ] {
        let error = table::read(&wrong, "name").unwrap_err();
        assert!(error.contains(why), "{wrong}: {error}");
    }
}

#[test]
fn fault_is_found_only_at_its_place() {
    let list = "id | sort | p:a.xosc | error\n  Act#c | drop\n  why: so\n";
    let entries = table::read(list, "name").unwrap();
    let said = |level: Level, rows: &[u64]| Said {
        checker: "c".to_owned(),
        level,
        text: "t".to_owned(),
        rows: rows.iter().map(|row| ("a.xosc".into(), *row)).collect(),
    };
    let spots = Spots::from([("a.xosc".into(), Rows::These(BTreeSet::from([3, 4])))]);
    let found = |said: Said| judge(&entries[0], spots.clone(), vec![said]).found;
    assert_eq!(found(said(Level::Error, &[4])), Found::Here);
    assert_eq!(found(said(Level::Error, &[9, 3])), Found::Beside);
    assert_eq!(found(said(Level::Warning, &[3])), Found::Weakly);
    assert_eq!(found(said(Level::Error, &[5])), Found::Elsewhere);
    assert_eq!(found(said(Level::Warning, &[5])), Found::Not);
    let old = [said(Level::Error, &[3])];
    assert_eq!(new_ones(&old, vec![old[0].clone()]), []);
    let twice = vec![old[0].clone(), old[0].clone()];
    assert_eq!(new_ones(&old, twice), old);
    let other = said(Level::Error, &[4]);
    assert_eq!(new_ones(&old, vec![other.clone()]), [other]);
}
