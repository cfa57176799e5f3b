//! Tests of edits and selectors, on small documents. An edit without an effect would find nothing.

use std::collections::BTreeSet;
use std::path::Path;

use super::encode::Storage;
use super::{Action, Changed, Edit, Overlay, Rows, Scan, Selector, apply};

const TEXT: &str = "<?xml version=\"1.0\"?>\n<!-- <Act name=\"none\"/> -->\n<Story name=\"one\">\n  \
                    <Act name=\"a b\"\n       n='1'/>\n  <Act name=\"c\">x</Act>\n  <Group><Act name=\"d\"/>\
                    </Group>\n</Story>\n";

fn edited(selector: &str, action: &str) -> Result<(String, Vec<u64>), String> {
    let action = Action::parse(action)?;
    let (text, rows) = action.apply(&Selector::parse(selector)?, TEXT)?;
    Ok((text, rows.into_iter().collect()))
}

/// Asserts that the edit replaces one passage by another and reports these rows.
#[track_caller]
fn assert_edit(selector: &str, action: &str, from: &str, to: &str, rows: &[u64]) {
    assert_eq!(TEXT.matches(from).count(), 1, "{from}");
    let (text, seen) = edited(selector, action).unwrap();
    assert_eq!(text, TEXT.replace(from, to), "{selector} | {action}");
    assert_eq!(seen, rows, "{selector} | {action}");
}

#[test]
fn attribute_is_edited_in_place() {
    assert_edit("Act#c", "set @name=e", "\"c\"", "\"e\"", &[6]);
    assert_edit("Act[n=1]", "set @n=2", "'1'", "'2'", &[4, 5]);
    assert_edit(
        "Act#c",
        "set @z=$x",
        "<Act name=\"c\"",
        "<Act z=\"$x\" name=\"c\"",
        &[6],
    );
    assert_edit("Act[n=1]", "drop @n", "\n       n='1'", "\n", &[4, 5]);
    assert_edit("Act[n=1]", "quote", "\"a b\"", "'a b'", &[4, 5]);
    let (from, to) = (" name=\"a b\"\n       n='1'", "\n       n='1' name=\"a b\"");
    assert_edit("Act[n=1]", "reverse", from, to, &[4, 5]);
}

#[test]
fn element_is_edited_in_place() {
    let (a, c) = (
        "<Act name=\"a b\"\n       n='1'/>",
        "<Act name=\"c\">x</Act>",
    );
    assert_edit("Act[name='a b']", "drop", a, "\n", &[3]);
    assert_edit("Act#c", "duplicate", c, &c.repeat(2), &[6]);
    let copy = format!("{a}{}", a.replace('\n', " "));
    assert_edit("Act:1[n=1]", "duplicate", a, &copy, &[4, 5]);
    let (from, to) = (format!("{a}\n  {c}"), format!("{c}\n  {a}"));
    assert_edit("Act[n=1]", "swap", &from, &to, &[4, 5]);
    assert_edit(
        "Act#c",
        "rename Scene",
        c,
        "<Scene name=\"c\">x</Scene>",
        &[6],
    );
    assert_edit("Act#c", "unclose", c, "<Act name=\"c\">x", &[6]);
}

#[test]
fn text_is_inserted_at_selected_element() {
    let c = "<Act name=\"c\">x</Act>";
    assert_edit("Act#c", "prepend <p/>", ">x<", "><p/>x<", &[6]);
    assert_edit("Act#c", "append <p/>", ">x<", ">x<p/><", &[6]);
    assert_edit("Act#c", "before <p/>", c, &format!("<p/>{c}"), &[6]);
    assert_edit("Act#c", "after <p/>", c, &format!("{c}<p/>"), &[6]);
    assert_edit("Act#c", "replace <p/>", c, "<p/>", &[6]);
    assert_edit(
        "Group Act",
        "append <p/>",
        "\"d\"/>",
        "\"d\"><p/></Act>",
        &[7],
    );
    assert_edit(
        "Act[n=1]",
        "replace <p/>",
        "<Act name=\"a b\"\n       n='1'/>",
        "<p/>\n",
        &[4],
    );
    assert_edit("Story", "append <p/>", "</Story>", "<p/></Story>", &[8]);
}

#[test]
fn empty_element_gets_end_tag_when_appended_to() {
    assert_edit("Act#d", "append", "\"d\"/>", "\"d\"></Act>", &[7]);
}

#[test]
fn impossible_edit_is_refused_with_reason() {
    for (selector, action, why) in [
        ("Act#x", "drop", "one element, found 0"),
        ("Act", "drop", "one element, found 3"),
        ("Act:3", "drop", "one element, found 0"),
        ("Story > Act#d", "drop", "one element, found 0"),
        ("Act#c", "set @name=c", "changes nothing"),
        ("Act#c", "rename Act", "changes nothing"),
        ("Act#c", "drop @n", "no attribute"),
        ("Act#d", "unclose", "no end tag"),
        ("Act#d", "swap", "no element follows"),
        ("Act#d", "reverse", "fewer than two"),
        ("Act#c", "set @n=\"", "an attribute value must not"),
        ("Act#c", "set n=1", "not an edit"),
        ("Act#c", "dropp", "not an edit"),
        ("Act#c", "append", "changes nothing"),
        ("Act#c", "after", "not an edit"),
        ("Act#c", "swap now", "not an edit"),
        ("Act >", "drop", "not a selector"),
        ("#c", "drop", "not a word"),
        ("Act[n]", "drop", "not a word"),
    ] {
        let error = edited(selector, action).unwrap_err();
        assert!(error.contains(why), "{selector} | {action}: {error}");
    }
}

#[test]
fn selector_matches_exactly_one_element() {
    for (selector, row) in [
        ("Story > Act:1", 4),
        ("Act[n=1]", 4),
        ("Act[name='a b'][n=1]", 4),
        ("Story Act#d", 7),
        ("Story > Group > Act", 7),
        ("Group Act:1", 7),
        ("Story#one", 3),
    ] {
        let scan = Scan::of(TEXT).unwrap();
        let id = Selector::parse(selector).unwrap().one(&scan).unwrap();
        assert_eq!(*scan.rows(id).start(), row, "{selector}");
    }
}

#[test]
fn elements_of_ill_formed_file_are_found() {
    let scan = Scan::of("<a><b><c></b></x>\n<d>").unwrap();
    let ends: Vec<_> = scan
        .elements
        .iter()
        .map(|it| (it.end, it.end_tag.is_some()))
        .collect();
    assert_eq!(ends, [(21, false), (13, true), (13, false), (21, false)]);
    assert!(Scan::of("<a b=c>").is_err());
    assert!(Scan::of("<a").is_err());
}

#[test]
fn storage_edit_changes_encoding_and_line_ends() {
    let of = |edit: &str, bytes: &[u8]| Storage::parse(edit).and_then(|it| it.apply(bytes));
    let declared =
        |encoding: &str| format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?>\n<ü/>\n");
    let text = "<?xml version=\"1.0\"?>\n<ü/>\n".as_bytes();
    let utf16 = declared("UTF-16");
    let units = || std::iter::once(0xfeff).chain(utf16.encode_utf16());
    let little: Vec<u8> = units().flat_map(u16::to_le_bytes).collect();
    assert_eq!(of("encode UTF-16", text).unwrap(), little);
    let big: Vec<u8> = units().flat_map(u16::to_be_bytes).collect();
    assert_eq!(of("encode UTF-16BE", text).unwrap(), big);
    let latin: Vec<u8> = declared("ISO-8859-1").chars().map(|c| c as u8).collect();
    assert_eq!(of("encode ISO-8859-1", text).unwrap(), latin);
    assert!(of("encode US-ASCII", text).is_err());
    let marked = of("bom", text).unwrap();
    assert_eq!(marked, [b"\xef\xbb\xbf", text].concat());
    assert!(of("bom", &marked).is_err());
    assert_eq!(of("crlf", b"a\nb\n").unwrap(), b"a\r\nb\r\n");
    assert!(of("crlf", b"a\r\nb").is_err());
    assert_eq!(of("undeclare", text).unwrap(), "\n<ü/>\n".as_bytes());
    assert!(of("undeclare", b"<a/>").is_err());
    assert_eq!(of("cut 1", b"a\nb\nc").unwrap(), b"a\nb");
    assert!(of("cut 4", b"a\nb\nc").is_err());
    assert!(of("encode EBCDIC", text).is_err());
}

#[test]
fn overlay_changes_files_temporarily() {
    let source = tempfile::tempdir().unwrap();
    std::fs::create_dir(source.path().join("maps")).unwrap();
    std::fs::write(source.path().join("a.xosc"), TEXT).unwrap();
    std::fs::write(source.path().join("maps/m.xodr"), "<m/>").unwrap();
    let edit = |line: &str, file: &str| Edit::parse(line, file.into()).unwrap();
    let edits = [
        edit("Act#c | set @name=e", "a.xosc"),
        edit("Act#e | drop", "a.xosc"),
        edit(". | remove", "maps/m.xodr"),
        edit(". | write <n/>", "new/n.xodr"),
    ];
    let (changed, spots) = apply(&edits, &[], source.path()).unwrap();
    let rows = Rows::These(BTreeSet::from([3, 6]));
    assert_eq!(spots[Path::new("a.xosc")], rows);
    let overlay = Overlay::of(source.path()).unwrap();
    let read = |path: &str| std::fs::read_to_string(overlay.root().join(path)).ok();
    let seen = overlay.with(&changed, |_| {
        ["a.xosc", "maps/m.xodr", "new/n.xodr"].map(read)
    });
    let [scenario, map, new] = seen.unwrap();
    assert_eq!(
        scenario.unwrap(),
        TEXT.replace("<Act name=\"c\">x</Act>", "")
    );
    assert_eq!((map, new.as_deref()), (None, Some("<n/>")));
    let seen = overlay.with(&Changed::new(), |_| ["a.xosc", "maps/m.xodr"].map(read));
    assert_eq!(
        seen.unwrap(),
        [Some(TEXT.to_owned()), Some("<m/>".to_owned())]
    );
    assert!(!overlay.root().join("new").exists());
    let original = std::fs::read_to_string(source.path().join("a.xosc")).unwrap();
    assert_eq!(original, TEXT);
}
