//! ALPHA-2 codes of countries (ISO 3166-1).

/// All assigned codes.
const ASSIGNED: &str = "\
    AD AE AF AG AI AL AM AO AQ AR AS AT AU AW AX AZ BA BB BD BE BF BG BH BI BJ BL \
    BM BN BO BQ BR BS BT BV BW BY BZ CA CC CD CF CG CH CI CK CL CM CN CO CR CU CV \
    CW CX CY CZ DE DJ DK DM DO DZ EC EE EG EH ER ES ET FI FJ FK FM FO FR GA GB GD \
    GE GF GG GH GI GL GM GN GP GQ GR GS GT GU GW GY HK HM HN HR HT HU ID IE IL IM \
    IN IO IQ IR IS IT JE JM JO JP KE KG KH KI KM KN KP KR KW KY KZ LA LB LC LI LK \
    LR LS LT LU LV LY MA MC MD ME MF MG MH MK ML MM MN MO MP MQ MR MS MT MU MV MW \
    MX MY MZ NA NC NE NF NG NI NL NO NP NR NU NZ OM PA PE PF PG PH PK PL PM PN PR \
    PS PT PW PY QA RE RO RS RU RW SA SB SC SD SE SG SH SI SJ SK SL SM SN SO SR SS \
    ST SV SX SY SZ TC TD TF TG TH TJ TK TL TM TN TO TR TT TV TW TZ UA UG UM US UY \
    UZ VA VC VE VG VI VN VU WF WS YE YT ZA ZM ZW";

/// Codes that are written by mistake, each with the intended one: names of languages, domains and
/// abbreviations.
const MISTAKEN: [(&str, &str); 9] = [
    ("UK", "GB"),
    ("EN", "GB"),
    ("JA", "JP"),
    ("KO", "KR"),
    ("ZH", "CN"),
    ("DA", "DK"),
    ("CS", "CZ"),
    ("EL", "GR"),
    ("SP", "ES"),
];

/// Checks whether two capital letters are the code of no country. Codes that users may assign
/// themselves, and that of the European Union, are left out.
pub(crate) fn is_unassigned(code: &str) -> bool {
    let mut letters = code.bytes();
    let (Some(one), Some(two), None) = (letters.next(), letters.next(), letters.next()) else {
        return false;
    };
    if !(one.is_ascii_uppercase() && two.is_ascii_uppercase()) {
        return false;
    }
    let is_free = match one {
        b'A' => two == b'A',
        b'Q' => two >= b'M',
        b'X' => true,
        b'Z' => two == b'Z',
        _ => code == "EU",
    };
    !is_free && !ASSIGNED.split(' ').any(|known| known == code)
}

/// Returns the text of a finding about such a code.
pub(crate) fn unassigned_text(code: &str) -> String {
    let known = MISTAKEN.iter().find(|(mistaken, _)| *mistaken == code);
    let instead = known.map_or_else(
        || "such as `DE`".to_owned(),
        |(_, meant)| format!("probably `{meant}`"),
    );
    format!(
        "no country has the code `{code}`, so readers find no signs for it; it must be an ALPHA-2 code of ISO 3166-1, \
         {instead}"
    )
}
