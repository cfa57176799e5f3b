//! Data of the page of a result, as `docs/html-report.md` describes it.

use std::collections::HashMap;

use qcbus_formats::xqar::{Checker, Issue};
use qcbus_messages::{Digest, ResultMessage};
use qcbus_plan::{How, Spot, Target};
use qcbus_reporter_sdk::{
    IssueLocation, Line, Pages, Sources, checkers, is_blocked, issue_locations, not_listed,
    one_line, path_for_people, printable, underlined,
};
use serde::Serialize;

use crate::placing::{Drawn, draw};
use crate::scene::Scene;
use crate::story_data::StoryData;

/// Maximum number of findings on a page: more than a person reads, but fine for a browser.
pub(crate) const MOST_FINDINGS: usize = 20_000;

/// Number of characters of a line that are shown before and after the place.
const BEFORE: usize = 60;
const AFTER: usize = 200;

/// All data on the page of a result.
#[derive(Serialize)]
pub(crate) struct ResultData<'r> {
    schema: u32,
    generator: String,
    file: FileData<'r>,
    checkers: Vec<CheckerData<'r>>,
    pub(crate) rules: Vec<RuleData>,
    pub(crate) findings: Vec<FindingData>,
    map: Option<MapData>,
    story: Option<StoryData>,
    cuts: Vec<String>,
}

#[derive(Serialize)]
struct FileData<'r> {
    path: &'r str,
    name: &'r str,
    sha256: String,
    verdict: &'static str,
    result: &'r str,
    config: String,
}

#[derive(Serialize)]
struct CheckerData<'r> {
    id: &'r str,
    bundle: &'r str,
    status: Option<&'static str>,
    blocked: bool,
    summary: &'r str,
    about: &'r str,
    findings: usize,
}

/// A violated rule.
#[derive(Serialize, Clone, serde::Deserialize, PartialEq)]
pub(crate) struct RuleData {
    pub(crate) uid: String,
    pub(crate) checker: String,
    pub(crate) about: String,
    pub(crate) page: String,
    pub(crate) link: String,
}

/// A finding.
#[derive(Serialize)]
pub(crate) struct FindingData {
    pub(crate) id: u64,
    pub(crate) level: &'static str,
    pub(crate) rule: i64,
    checker: usize,
    pub(crate) text: String,
    pub(crate) places: Vec<PlaceData>,
    facts: Vec<(String, String)>,
}

/// A place of a finding.
#[derive(Serialize, Default)]
pub(crate) struct PlaceData {
    file: Option<String>,
    pub(crate) row: Option<u64>,
    pub(crate) column: Option<u64>,
    xpath: Option<String>,
    text: String,
    line: Option<LineData>,
    road: Option<(String, f64, f64)>,
    time: Option<f64>,
    at: Option<[f64; 2]>,
    how: Option<&'static str>,
    on: Vec<TargetData>,
}

#[derive(Serialize)]
struct LineData {
    text: String,
    skipped: u64,
    more: bool,
    mark: Option<(usize, usize)>,
}

/// Target of a finding: indices into the lists of the plan.
#[derive(Serialize, Default)]
struct TargetData {
    #[serde(skip_serializing_if = "Option::is_none")]
    road: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    section: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lane: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    junction: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    signal: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<usize>,
}

/// Facts about the road network.
#[derive(Serialize)]
pub(crate) struct MapData {
    pub(crate) path: String,
    pub(crate) own: bool,
    pub(crate) cuts: Vec<String>,
}

impl<'r> ResultData<'r> {
    /// Returns the data of a result and the plan of its road network.
    pub(crate) fn of(
        result: &'r ResultMessage,
        sources: &dyn Sources,
        pages: Pages,
    ) -> (ResultData<'r>, Option<Vec<u8>>) {
        let mut collected = Collected {
            result,
            sources,
            pages,
            rules: Vec::new(),
            known: HashMap::new(),
            findings: Vec::new(),
            locations: Vec::new(),
        };
        let total = collected.collect();
        let Collected {
            rules,
            mut findings,
            locations,
            ..
        } = collected;
        let shown = |path: &str| shown(result, path);
        let scene = Scene::of(result, sources);
        let drawn = {
            let data = findings.iter_mut().flat_map(|it| &mut it.places);
            let mut places: Vec<_> = locations.into_iter().zip(data).collect();
            draw(result, sources, scene.as_ref(), &shown, &mut places)
        };
        let story = scene.and_then(|scene| scene.story(&result.input, &shown));
        let mut cuts = Vec::new();
        if total > MOST_FINDINGS {
            let left_out = total - MOST_FINDINGS;
            cuts.push(format!(
                "the {left_out} least severe of {total} findings are not on this page; the .xqar contains all of \
                 them"
            ));
        }
        let not_listed = not_listed(result);
        if not_listed > 0 {
            cuts.push(format!(
                "{not_listed} further findings are counted but not listed, because a checker lists only a \
                 limited number per file"
            ));
        }
        let (map, plan) = match drawn {
            Some(Drawn { plan, map }) => (Some(map), Some(plan)),
            None => (None, None),
        };
        let data = ResultData {
            schema: 1,
            generator: generator(),
            file: file(result),
            checkers: checkers_of(result),
            rules,
            findings,
            map,
            story,
            cuts,
        };
        (data, plan)
    }
}

/// Returns the name and version of the program that wrote a page.
pub(crate) fn generator() -> String {
    format!("qcbus {}", env!("CARGO_PKG_VERSION"))
}

/// Findings collected for the page.
struct Collected<'r, 's> {
    result: &'r ResultMessage,
    sources: &'s dyn Sources,
    pages: Pages,
    rules: Vec<RuleData>,
    known: HashMap<(&'r str, &'r str), usize>,
    findings: Vec<FindingData>,
    /// Locations of all places of all findings, in their order.
    locations: Vec<IssueLocation>,
}

impl<'r> Collected<'r, '_> {
    /// Collects the findings, the most severe first and within a level in file order. Returns their
    /// total number.
    fn collect(&mut self) -> usize {
        let bundles = self.result.results.bundles.iter();
        let checkers = bundles.flat_map(|bundle| &bundle.checkers).enumerate();
        let mut all: Vec<(usize, &Checker, &Issue, Vec<IssueLocation>)> = checkers
            .flat_map(|(number, checker)| {
                let issues = checker.issues.iter();
                issues.map(move |issue| (number, checker, issue, issue_locations(issue)))
            })
            .collect();
        let row = |places: &[IssueLocation]| {
            let first = places.first();
            first.map_or((0, 0), |it| match it.path {
                Some(_) => it.referred_at.unwrap_or_default(),
                None => (it.row.unwrap_or(0), it.column.unwrap_or(0)),
            })
        };
        all.sort_by_key(|(_, _, issue, places)| (issue.level, row(places)));
        let total = all.len();
        for (number, checker, issue, places) in all.into_iter().take(MOST_FINDINGS) {
            let finding = self.finding(number, checker, issue, &places);
            self.findings.push(finding);
            self.locations.extend(places);
        }
        total
    }

    fn finding(
        &mut self,
        checker_number: usize,
        checker: &'r Checker,
        issue: &'r Issue,
        places: &[IssueLocation],
    ) -> FindingData {
        FindingData {
            id: issue.id,
            level: issue.level.as_str(),
            rule: self.rule(checker, &issue.rule_uid),
            checker: checker_number,
            text: printable(issue.description.trim()),
            places: places.iter().map(|place| self.place(place)).collect(),
            facts: facts(issue),
        }
    }

    /// Returns the index of a rule. A new rule is added to the list.
    fn rule(&mut self, checker: &'r Checker, uid: &'r str) -> i64 {
        let index = match self.known.get(&(uid, &*checker.id)) {
            Some(index) => *index,
            None => {
                let page = (self.pages)(uid, &checker.id).unwrap_or_default();
                let about = match page.summary {
                    summary if summary.is_empty() => checker.description.to_string(),
                    summary => summary,
                };
                self.rules.push(RuleData {
                    uid: one_line(uid),
                    checker: one_line(&checker.id),
                    about: one_line(&about),
                    page: page.text.to_owned(),
                    link: page.link,
                });
                let index = self.rules.len() - 1;
                self.known.insert((uid, &*checker.id), index);
                index
            }
        };
        i64::try_from(index).unwrap_or(-1)
    }

    fn place(&self, place: &IssueLocation) -> PlaceData {
        let finite = |number: f64| number.is_finite().then_some(number);
        let road = place.road.as_ref();
        PlaceData {
            file: place.path.as_deref().map(|path| shown(self.result, path)),
            row: place.row,
            column: place.column,
            xpath: place.xpath.as_deref().map(one_line),
            text: printable(&place.description),
            line: self.line(place),
            road: road.and_then(|(id, s, t)| Some((one_line(id), finite(*s)?, finite(*t)?))),
            time: place.time.and_then(finite),
            ..PlaceData::default()
        }
    }

    fn line(&self, place: &IssueLocation) -> Option<LineData> {
        let row = place.row?;
        let path = place.path.as_deref().unwrap_or(&self.result.input);
        let line = self.sources.line(path, row, place.column.unwrap_or(1))?;
        Some(LineData::of(&line, place.column))
    }
}

impl LineData {
    /// Returns the part of a line around a column.
    fn of(line: &Line, column: Option<u64>) -> LineData {
        let chars: Vec<char> = printable(&line.text).chars().collect();
        let at = column.map(|column| {
            let before = column.saturating_sub(line.skipped).saturating_sub(1);
            usize::try_from(before)
                .unwrap_or(usize::MAX)
                .min(chars.len())
        });
        let from = at.map_or(0, |at| at.saturating_sub(BEFORE));
        let to = at.unwrap_or(0).saturating_add(AFTER).min(chars.len());
        let shown = chars.get(from..to).unwrap_or_default();
        let mark = at.map(|at| {
            let length = underlined(&chars, at).min((to - at).max(1));
            (at - from, length)
        });
        LineData {
            text: shown.iter().collect(),
            skipped: line.skipped + from as u64,
            more: line.goes_on || to < chars.len(),
            mark,
        }
    }
}

impl PlaceData {
    /// Stores the position of the place on the plan.
    pub(crate) fn put(&mut self, spot: Spot) {
        self.at = spot.at;
        self.how = spot.how.map(|how| match how {
            How::Position => "position",
            How::Road => "road",
            How::Element => "element",
        });
        self.on = spot.on.into_iter().map(TargetData::of).collect();
    }
}

impl TargetData {
    fn of(target: Target) -> TargetData {
        let mut data = TargetData::default();
        match target {
            Target::Road { road } => data.road = Some(road),
            Target::Section { road, section } => {
                (data.road, data.section) = (Some(road), Some(section));
            }
            Target::Lane {
                road,
                section,
                lane,
            } => {
                (data.road, data.section) = (Some(road), Some(section));
                data.lane = Some(lane);
            }
            Target::Junction { junction } => data.junction = Some(junction),
            Target::Signal { signal } => data.signal = Some(signal),
            Target::Object { object } => data.object = Some(object),
        }
        data
    }
}

fn file(result: &ResultMessage) -> FileData<'_> {
    let last = |path: &'_ str| path.rfind('/').map_or(0, |at| at + 1);
    let known = |digest: Digest| match digest == Digest::default() {
        true => String::new(),
        false => digest.to_string(),
    };
    FileData {
        path: &result.display_path,
        name: &result.display_path[last(&result.display_path)..],
        sha256: known(result.digest),
        verdict: result.verdict.as_str(),
        result: &result.xqar[last(&result.xqar)..],
        config: known(result.config),
    }
}

fn checkers_of(result: &ResultMessage) -> Vec<CheckerData<'_>> {
    let data = checkers(result).map(|(bundle, checker)| CheckerData {
        id: &checker.id,
        bundle: &bundle.name,
        status: checker.status.map(|status| status.as_str()),
        blocked: is_blocked(checker),
        summary: &checker.summary,
        about: &checker.description,
        findings: checker.issues.len(),
    });
    data.collect()
}

/// Returns further facts about an issue that are not in its places.
fn facts(issue: &Issue) -> Vec<(String, String)> {
    let infos = issue.domain_info.iter();
    let others = infos.filter(|info| info.name != qcbus_formats::location::NAME);
    let fact = |info: &qcbus_formats::xqar::DomainInfo| {
        let elements = info.content.iter();
        let said = elements.flat_map(|element| {
            let values = element.attributes.iter().map(|(_, value)| value.as_str());
            values.chain([element.text.as_str()])
        });
        let words: Vec<&str> = said.filter(|word| !word.trim().is_empty()).collect();
        (one_line(&info.name), one_line(&words.join(" ")))
    };
    others.map(fact).collect()
}

/// Returns the display path of another file.
fn shown(result: &ResultMessage, path: &str) -> String {
    one_line(path_for_people(result, path))
}
