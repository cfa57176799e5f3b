//! Checks that rules, files and pages agree, and that every example matches its page.

#[test]
fn pages_keep_their_word() {
    qcbus_rule_tests::pages::assert_pages(
        &qcbus_xosc::BUNDLE,
        crate::templates::TEMPLATES,
        concat!(env!("CARGO_MANIFEST_DIR"), "/src/rules"),
    );
}
