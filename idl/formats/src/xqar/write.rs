//! Writing of result files: ASAM's current form, and the form of 2023.

mod info;

use super::{
    Checker, CheckerBundle, Issue, Level, Location, Locations, Metadata, Param, Results, numbers,
    road,
};
use crate::markup::Markup;

/// Version of the result format that is written when a result has none.
pub const FORMAT_VERSION: &str = "1.0.0";

/// Form of the result file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Dialect {
    /// The form that ASAM's framework reads today.
    #[default]
    Current,
    /// The form of 2023 (QC4OpenX 1.0.0): `fileType`, `RoadLocation`, angles at `InertialLocation`.
    /// It has no status, rules, metadata and domain specific facts. An issue's rule is written in
    /// brackets after its description.
    Qc4Openx,
}

/// Writes a result as text. Elements are in the order of ASAM's schema (Param, Issue,
/// AddressedRule, Metadata). The same result gives the same bytes. Characters that XML does not
/// allow become U+FFFD. Invalid names are repaired, so every result can be read again.
///
/// In the current form, an issue's rule is added to its checker's list if it is missing there.
/// ASAM's readers refuse the whole file otherwise. A place without any location that the form
/// supports is written as row 1, column 1.
pub fn write(results: &Results, dialect: Dialect) -> String {
    write_into(String::new(), results, dialect)
}

/// Writes like [`write()`], and reuses the memory of a text that is no longer needed.
pub fn write_into(mut memory: String, results: &Results, dialect: Dialect) -> String {
    memory.clear();
    memory.reserve(room(results));
    let mut writer = Writer {
        out: Markup::new(memory),
        dialect,
        file_type: "1",
    };
    writer.results(results);
    writer.out.finish()
}

/// Estimates the size of a result as text in bytes, enough for most results.
fn room(results: &Results) -> usize {
    let checkers = results.bundles.iter().flat_map(|it| &it.checkers);
    let rows = |it: &Checker| {
        let of_rules: usize = it.addressed_rules.iter().map(|uid| 40 + uid.len()).sum();
        of_rules + 64 * it.params.len() + 128 * it.metadata.len() + 1024 * it.issues.len()
    };
    let room =
        |it: &Checker| 128 + it.id.len() + it.description.len() + it.summary.len() + rows(it);
    1024 + checkers.map(room).sum::<usize>()
}

struct Writer {
    out: Markup,
    dialect: Dialect,
    /// Value in the form of 2023: 1 for OpenDRIVE, 2 for OpenSCENARIO.
    file_type: &'static str,
}

impl Writer {
    fn results(&mut self, results: &Results) {
        let version = if results.version.is_empty() {
            FORMAT_VERSION
        } else {
            &results.version
        };
        self.out.open("CheckerResults", &[("version", version)]);
        for bundle in &results.bundles {
            self.bundle(bundle);
        }
        self.out.close("CheckerResults");
    }

    fn bundle(&mut self, bundle: &CheckerBundle) {
        self.file_type = file_type(bundle);
        self.out.open(
            "CheckerBundle",
            &[
                ("build_date", &bundle.build_date),
                ("description", &bundle.description),
                ("name", &bundle.name),
                ("summary", &bundle.summary),
                ("version", &bundle.version),
            ],
        );
        self.params(&bundle.params);
        if self.dialect == Dialect::Qc4Openx {
            self.input_file_of_2023(&bundle.params);
        }
        for checker in &bundle.checkers {
            self.checker(checker);
        }
        self.out.close("CheckerBundle");
    }

    fn checker(&mut self, checker: &Checker) {
        let id = ("checkerId", &*checker.id);
        let description = ("description", &*checker.description);
        let summary = ("summary", &*checker.summary);
        if let (Some(status), Dialect::Current) = (checker.status, self.dialect) {
            let status = ("status", status.as_str());
            self.out
                .open("Checker", &[id, description, status, summary]);
        } else {
            self.out.open("Checker", &[id, description, summary]);
        }
        self.params(&checker.params);
        for issue in &checker.issues {
            self.issue(issue);
        }
        if self.dialect == Dialect::Current {
            self.rules(checker);
            for Metadata {
                key,
                value,
                description,
            } in &checker.metadata
            {
                let attributes = [
                    ("key", key.as_str()),
                    ("value", value),
                    ("description", description),
                ];
                self.out.empty("Metadata", &attributes);
            }
        }
        self.out.close("Checker");
    }

    fn rules(&mut self, checker: &Checker) {
        let listed = &checker.addressed_rules;
        for (at, uid) in listed.iter().enumerate() {
            if !listed[..at].contains(uid) {
                self.out.empty("AddressedRule", &[("ruleUID", uid)]);
            }
        }
        let mut besides: Vec<&String> = Vec::new();
        for uid in checker.issues.iter().map(|issue| &issue.rule_uid) {
            let is_listed = || listed.iter().any(|it| **it == **uid);
            if !uid.is_empty() && !is_listed() && !besides.contains(&uid) {
                self.out.empty("AddressedRule", &[("ruleUID", uid)]);
                besides.push(uid);
            }
        }
    }

    fn params(&mut self, params: &[Param]) {
        // Readers refuse a parameter without a name.
        for Param { name, value } in params.iter().filter(|param| !param.name.is_empty()) {
            self.out.empty("Param", &[("name", name), ("value", value)]);
        }
    }

    /// Writes the parameter of the checked file in the form of 2023: `XodrFile` or `XoscFile`.
    fn input_file_of_2023(&mut self, params: &[Param]) {
        let value = |name: &str| params.iter().find(|param| param.name == name);
        let name = if self.file_type == "2" {
            "XoscFile"
        } else {
            "XodrFile"
        };
        if let (Some(input), None) = (value("InputFile"), value(name)) {
            self.out
                .empty("Param", &[("name", name), ("value", &input.value)]);
        }
    }

    fn issue(&mut self, issue: &Issue) {
        let id = issue.id.to_string();
        let level = match issue.level {
            Level::Error => "1",
            Level::Warning => "2",
            Level::Information => "3",
        };
        let mut description = issue.description.clone();
        let old = self.dialect == Dialect::Qc4Openx;
        if old && !issue.rule_uid.is_empty() {
            description = format!("{description} [{}]", issue.rule_uid);
        }
        let mut attributes = vec![
            ("issueId", id.as_str()),
            ("description", &description),
            ("level", level),
        ];
        if !old {
            attributes.push(("ruleUID", &issue.rule_uid));
        }
        self.out.open("Issue", &attributes);
        for place in issue
            .locations
            .iter()
            .filter(|place| old || !road::only_roads(place))
        {
            self.locations(place);
        }
        if !old {
            for info in issue.written_info() {
                info::write(&mut self.out, &info);
            }
            if let Some(roads) = road::to_info(issue) {
                info::write(&mut self.out, &roads);
            }
        }
        self.out.close("Issue");
    }

    fn locations(&mut self, place: &Locations) {
        self.out
            .open("Locations", &[("description", &*place.written())]);
        let mut written = false;
        for location in &place.places {
            written |= self.location(location);
        }
        if !written {
            self.file_location(1, 1, None);
        }
        self.out.close("Locations");
    }

    /// Writes one location. Returns `false` when the form has no element for it.
    fn location(&mut self, location: &Location) -> bool {
        let current = self.dialect == Dialect::Current;
        match location {
            Location::File {
                row,
                column,
                offset,
            } => self.file_location(*row, *column, *offset),
            Location::Xml { xpath } => self.out.empty("XMLLocation", &[("xpath", xpath)]),
            Location::Inertial { x, y, z } => self.inertial([*x, *y, *z]),
            Location::Road { road_id, s, t } if !current => {
                let (s, t) = (numbers::write(*s), numbers::write(*t));
                self.out
                    .empty("RoadLocation", &[("roadId", road_id), ("s", &s), ("t", &t)]);
            }
            Location::Time { time } if current => {
                self.out
                    .empty("TimeLocation", &[("time", &numbers::write(*time))]);
            }
            Location::Message {
                index,
                channel,
                field,
                time,
            } if current => {
                let (index, time) = (index.to_string(), time.map(numbers::write));
                let mut attributes = vec![("index", index.as_str())];
                attributes.extend(channel.as_ref().map(|text| ("channel", text.as_str())));
                attributes.extend(field.as_ref().map(|text| ("field", text.as_str())));
                attributes.extend(time.as_ref().map(|text| ("time", text.as_str())));
                self.out.empty("MessageLocation", &attributes);
            }
            Location::Road { .. } | Location::Time { .. } | Location::Message { .. } => {
                return false;
            }
        }
        true
    }

    fn inertial(&mut self, [x, y, z]: [f64; 3]) {
        let (x, y, z) = (numbers::write(x), numbers::write(y), numbers::write(z));
        let mut attributes = vec![("x", x.as_str()), ("y", &y), ("z", &z)];
        if self.dialect == Dialect::Qc4Openx {
            attributes.extend([("h", "0"), ("p", "0"), ("r", "0")]);
        }
        self.out.empty("InertialLocation", &attributes);
    }

    fn file_location(&mut self, row: u64, column: u64, offset: Option<u64>) {
        let (row_text, column_text) = (row.to_string(), column.to_string());
        let place = [("row", row_text.as_str()), ("column", column_text.as_str())];
        if self.dialect == Dialect::Qc4Openx {
            let [row, column] = place;
            self.out
                .empty("FileLocation", &[("fileType", self.file_type), row, column]);
            return;
        }
        let offset_text = offset.map(|offset| offset.to_string());
        let offset = offset_text.as_ref().map(|text| ("offset", text.as_str()));
        // Row 0 means that only the offset is known.
        let place = if (row, column) == (0, 0) && offset.is_some() {
            &[][..]
        } else {
            &place
        };
        let attributes: Vec<_> = place.iter().copied().chain(offset).collect();
        self.out.empty("FileLocation", &attributes);
    }
}

/// Returns 2 when the bundle's input file is a scenario, else 1.
fn file_type(bundle: &CheckerBundle) -> &'static str {
    let value = |name: &str| bundle.params.iter().find(|param| param.name == name);
    let scenario = match value("InputFile") {
        Some(input) => {
            let path = input.value.to_lowercase();
            path.ends_with(".xosc") || path.ends_with(".mosc")
        }
        None => value("XoscFile").is_some() || bundle.name.contains("xosc"),
    };
    if scenario { "2" } else { "1" }
}
