//! Tests of values and attributes that old schemas do not restrict, and of content that only looks
//! wrong.

use super::Row;

/// Returns a straight road of 100 m with the given elements before its lanes and after them.
fn road(version: &str, head: &str, tail: &str) -> String {
    format!(
        r#"<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="{version}"/>
<road name="" id="1" length="100" junction="-1">{head}<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
<right><lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes>
{tail}</road></OpenDRIVE>"#
    )
}

fn objects(version: &str, objects: &str) -> String {
    road(version, "", &format!("<objects>{objects}</objects>"))
}

fn signals(version: &str, signals: &str) -> String {
    road(version, "", &format!("<signals>{signals}</signals>"))
}

const POST: &str =
    r#"type="pole" s="10" t="5" zOffset="0" hdg="0" orientation="none" height="1" radius="0.1""#;
const LIMIT: &str = r#"s="10" t="-5" zOffset="2" orientation="+" dynamic="no" country="DEU" type="274" subtype="50""#;

#[test]
fn unknown_words_give_expected_findings() {
    let kind = |version, kind: &str| road(version, &format!(r#"<type s="0" type="{kind}"/>"#), "");
    let rows: Vec<Row> = vec![
        ("a word of a later version", kind("2", "townLocal"), &[]),
        (
            "a word of none",
            kind("2", "highway"),
            &["error words_are_known"],
        ),
        (
            "what the schema says is said once",
            kind("4", "highway"),
            &[],
        ),
        (
            "types of objects are free",
            objects(
                "2",
                &format!(r#"<object id="1" name="x" {POST}/>"#).replace("pole", "bin"),
            ),
            &[],
        ),
    ];
    super::run_files(&rows);
}

#[test]
fn missing_attributes_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "an empty id",
            objects("4", &format!(r#"<object id=" " {POST}/>"#)),
            &["error attributes_are_given"],
        ),
        (
            "two empty ids are not the same one",
            objects(
                "4",
                &format!(
                    r#"<object id="" {POST}/><object id="" {}/>"#,
                    POST.replace("10", "30")
                ),
            ),
            &["error attributes_are_given", "error attributes_are_given"],
        ),
        (
            "no orientation",
            signals(
                "4",
                &format!(
                    r#"<signal id="1" {}/>"#,
                    LIMIT.replace(r#"orientation="+""#, "")
                ),
            ),
            &["error attributes_are_given"],
        ),
    ];
    super::run_files(&rows);
}
