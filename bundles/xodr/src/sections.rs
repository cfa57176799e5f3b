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
