use crate::families::countries;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "1.1.0" },
    each: Some(each),
    ..Rule::after(READABLE)
};

/// ALPHA-3 codes of countries that are frequent in maps, and the names that older versions allow,
/// each with the intended code.
const ALPHA_2: &[(&str, &str)] = &[
    ("ARG", "AR"),
    ("AUS", "AU"),
    ("AUT", "AT"),
    ("BEL", "BE"),
    ("BGR", "BG"),
    ("BRA", "BR"),
    ("CAN", "CA"),
    ("CHE", "CH"),
    ("CHL", "CL"),
    ("CHN", "CN"),
    ("CZE", "CZ"),
    ("DEU", "DE"),
    ("DNK", "DK"),
    ("ESP", "ES"),
    ("EST", "EE"),
    ("FIN", "FI"),
    ("FRA", "FR"),
    ("GBR", "GB"),
    ("GRC", "GR"),
    ("HRV", "HR"),
    ("HUN", "HU"),
    ("IDN", "ID"),
    ("IND", "IN"),
    ("IRL", "IE"),
    ("ISL", "IS"),
    ("ISR", "IL"),
    ("ITA", "IT"),
    ("JPN", "JP"),
    ("KOR", "KR"),
    ("LTU", "LT"),
    ("LUX", "LU"),
    ("LVA", "LV"),
    ("MEX", "MX"),
    ("MYS", "MY"),
    ("NLD", "NL"),
    ("NOR", "NO"),
    ("NZL", "NZ"),
    ("POL", "PL"),
    ("PRT", "PT"),
    ("ROU", "RO"),
    ("RUS", "RU"),
    ("SGP", "SG"),
    ("SRB", "RS"),
    ("SVK", "SK"),
    ("SVN", "SI"),
    ("SWE", "SE"),
    ("THA", "TH"),
    ("TUR", "TR"),
    ("TWN", "TW"),
    ("UKR", "UA"),
    ("USA", "US"),
    ("ZAF", "ZA"),
    ("Austria", "AT"),
    ("Brazil", "BR"),
    ("China", "CN"),
    ("France", "FR"),
    ("Germany", "DE"),
    ("Italy", "IT"),
    ("Switzerland", "CH"),
];

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for record in road.types() {
            let Some(country) = record.node().attribute("country") else {
                continue;
            };
            let code = country.value();
            let is_alpha = code.bytes().all(|byte| byte.is_ascii_alphabetic());
            if countries::is_unassigned(code) {
                let text = countries::unassigned_text(code);
                found.issue(country, text).in_every_version(Level::Warning);
                continue;
            }
            let kind = match code.len() {
                2 if code.bytes().all(|byte| byte.is_ascii_uppercase()) => continue,
                2 if is_alpha => "is not written in capital letters",
                3 if is_alpha => "has three letters",
                _ => "is not a code",
            };
            let upper = code.to_ascii_uppercase();
            let known = ALPHA_2
                .iter()
                .find(|(other, _)| other.to_ascii_uppercase() == upper);
            let instead = match known {
                Some((_, instead)) => format!("`{instead}` in this case"),
                None => "such as `DE`".to_owned(),
            };
            let text = format!(
                "the country `{code}` {kind}; it must be an ALPHA-2 code of ISO 3166-1, {instead}"
            );
            found.issue(country, text);
        }
    }
}
