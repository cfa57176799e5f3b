//! The list of edits; its form is described at its top.

use std::path::{Path, PathBuf};

use qcbus_sdk::mutate::{Edit, Target};

/// A rule and what should make it fire.
#[derive(Debug)]
pub struct Entry {
    pub family: String,
    /// The checker's id without its prefix.
    pub rule: String,
    pub edits: Vec<Mutation>,
    /// Why there is none.
    pub without: Option<String>,
}

/// A violation: edits that belong together.
#[derive(Debug)]
pub struct Mutation {
    /// As it stands in the list.
    pub text: String,
    /// The scenario that is edited.
    pub base: String,
    pub edits: Vec<Edit>,
    /// Where it must be found; where the edits are, when there is none.
    pub at: Vec<Target>,
    /// Another name for the scenario.
    pub name: Option<PathBuf>,
    /// How many findings the rule has.
    pub times: usize,
    /// Other rules that fire, and why.
    pub also: Vec<(String, String)>,
}

impl Mutation {
    /// The file that is looked at.
    pub fn file(&self) -> PathBuf {
        let base = || Path::new(&self.base).with_added_extension("xosc");
        self.name.clone().unwrap_or_else(base)
    }
}

/// Reads the list; the text of an error begins with the line's number.
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

/// The entries by family, in the list's order.
pub fn families(entries: &[Entry]) -> impl Iterator<Item = (&str, &[Entry])> {
    let same = entries.chunk_by(|one, other| one.family == other.family);
    same.filter_map(|entries| Some((entries.first()?.family.as_str(), entries)))
}

/// One for every scenario that the line names.
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
