//! Sections of the standard that define the rules.

/// Name of a rule, number and title of the section in ASAM OpenDRIVE 1.9.0.
const SECTIONS: &str = include_str!("sections.tsv");

/// Base address of the standard's pages.
const PAGES: &str = "https://publications.pages.asam.net/standards/ASAM_OpenDRIVE/\
    ASAM_OpenDRIVE_Specification/v1.9.0/specification/";

/// First pages of the chapters, by chapter number.
const CHAPTERS: [(&str, &str); 12] = [
    ("6", "06_general_architecture/06_01_introduction.html"),
    ("7", "07_additional_data/07_00_additional_data.html"),
    ("8", "08_coordinate_systems/08_01_introduction.html"),
    ("9", "09_geometries/09_01_introduction.html"),
    ("10", "10_roads/10_01_introduction.html"),
    ("11", "11_lanes/11_01_introduction.html"),
    ("12", "12_junctions/12_01_introduction.html"),
    ("13", "13_objects/13_01_introduction.html"),
    ("14", "14_signals/14_01_introduction.html"),
    ("15", "15_railroads/15_01_introduction.html"),
    ("D", "index.html"),
    ("F", "index.html"),
];

/// Returns the section of ASAM OpenDRIVE 1.9.0 that states a rule, given by the end of its UID. The
/// result is the name of the section for citations and the address of the chapter.
pub fn section(rule: &str) -> Option<(String, String)> {
    let mut rows = SECTIONS.lines().map(|row| row.split('\t'));
    let (number, title) = rows.find_map(|mut row| {
        let is_it = row.next() == Some(rule);
        is_it.then(|| Some((row.next()?, row.next()?))).flatten()
    })?;
    let chapter = number.split('.').next().unwrap_or(number);
    let page = CHAPTERS.iter().find(|(of, _)| *of == chapter)?.1;
    let kind = match number.starts_with(char::is_alphabetic) {
        true => "annex",
        false => "section",
    };
    let name = format!("ASAM OpenDRIVE 1.9.0, {kind} {number} {title}");
    Some((name, format!("{PAGES}{page}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_row_names_a_chapter() {
        for row in SECTIONS.lines() {
            let rule = row.split('\t').next().unwrap();
            let (name, page) = section(rule).unwrap_or_else(|| panic!("{rule}"));
            assert!(name.len() > 30 && page.ends_with(".html"), "{name} {page}");
        }
        assert_eq!(section("no.such_rule"), None);
    }

    #[test]
    fn nearly_every_rule_has_a_section() {
        let rules = crate::BUNDLE.rules.iter();
        let uids = rules.flat_map(|rule| rule.facts().uids);
        let ours = uids.filter(|uid| uid.starts_with("asam.net:xodr:"));
        let name = |uid: &&&str| uid.rsplit(':').next().unwrap().to_owned();
        let names: Vec<String> = ours.map(|uid| name(&uid)).collect();
        let without = names.iter().filter(|name| section(name).is_none());
        let without: Vec<&String> = without.collect();
        assert!(without.len() * 20 < names.len(), "{without:?}");
    }
}
