//! The list of edits. The beginning of the list describes its format.

use std::path::{Path, PathBuf};

use qcbus_rule_tests::mutate::{Edit, Target};

/// A rule and the edits that should make it fire.
#[derive(Debug)]
pub struct Entry {
    pub family: String,
    /// The checker's id without its prefix.
    pub rule: String,
    pub edits: Vec<Mutation>,
    /// Reason if there are no edits.
    pub without: Option<String>,
}

/// A violation: a set of edits that belong together.
#[derive(Debug)]
pub struct Mutation {
    /// Text in the list.
    pub text: String,
    /// The scenario that is edited.
    pub base: String,
    pub edits: Vec<Edit>,
    /// Places of the expected finding. If empty, the places of the edits.
    pub at: Vec<Target>,
    /// Another file name for the scenario.
    pub name: Option<PathBuf>,
    /// Expected number of findings of the rule.
    pub times: usize,
    /// Other rules that fire, with the reasons.
    pub also: Vec<(String, String)>,
}

impl Mutation {
    /// Returns the file that is checked.
    pub fn file(&self) -> PathBuf {
        let base = || Path::new(&self.base).with_added_extension("xosc");
        self.name.clone().unwrap_or_else(base)
    }
}

/// Parses the list. An error text begins with the line number.
pub fn read(text: &str) -> Result<Vec<Entry>, String> {
    let (mut family, mut all) = (String::new(), Vec::<Entry>::new());
    for (number, line) in text.lines().enumerate() {
        let trimmed = line.trim();
        if trimmed.is_empty() || trimmed.starts_with('#') {
            continue;
        }
        if let Some(name) = trimmed.strip_prefix('[') {
            name.trim_end_matches(']').clone_into(&mut family);
            continue;
        }
        if !line.starts_with(' ') {
            all.push(Entry {
                family: family.clone(),
                rule: trimmed.to_owned(),
                edits: Vec::new(),
                without: None,
            });
            continue;
        }
        let in_line = |error: String| format!("{}: {error}", number + 1);
        let entry = all
            .last_mut()
            .ok_or_else(|| in_line("no rule".to_owned()))?;
        match trimmed.strip_prefix("none: ") {
            Some(why) => entry.without = Some(why.to_owned()),
            None => entry.edits.extend(mutations(trimmed).map_err(in_line)?),
        }
    }
    Ok(all)
}

/// Returns the entries by family, in the list's order.
pub fn families(entries: &[Entry]) -> impl Iterator<Item = (&str, &[Entry])> {
    let same = entries.chunk_by(|one, other| one.family == other.family);
    same.filter_map(|entries| Some((entries.first()?.family.as_str(), entries)))
}

/// Returns one mutation for every scenario that the line names.
fn mutations(line: &str) -> Result<Vec<Mutation>, String> {
    let (bases, rest) = line.split_once(" | ").ok_or("no edit")?;
    let bases = bases.split(' ');
    bases.map(|base| mutation(base, rest)).collect()
}

fn mutation(base: &str, text: &str) -> Result<Mutation, String> {
    let scenario = format!("{base}.xosc");
    let mut mutation = Mutation {
        text: text.to_owned(),
        base: base.to_owned(),
        edits: Vec::new(),
        at: Vec::new(),
        name: None,
        times: 1,
        also: Vec::new(),
    };
    for step in text.split(" && ") {
        let fields: Vec<&str> = step.split(" | ").map(str::trim).collect();
        let (edit, options) = fields.split_at_checked(2).ok_or("no edit")?;
        let mut file = scenario.as_str();
        for option in options {
            let (key, value) = option.split_once(": ").ok_or("no option")?;
            match key {
                "in" => file = value,
                "at" => {
                    let (selector, file) = value.split_once(" @ ").unwrap_or((value, &scenario));
                    mutation.at.push(Target::parse(selector, file.into())?);
                }
                "as" => mutation.name = Some(value.into()),
                "times" => mutation.times = value.parse().map_err(|_| "no number")?,
                "also" => {
                    let (rule, why) = value.split_once(": ").ok_or("no reason")?;
                    mutation.also.push((rule.to_owned(), why.to_owned()));
                }
                _ => return Err(format!("no option: {option}")),
            }
        }
        mutation
            .edits
            .push(Edit::parse(&edit.join(" | "), file.into())?);
    }
    Ok(mutation)
}
