//! Builds complete documents from the short examples of a page.

use std::path::Path;
use std::str::FromStr;

use qcbus_messages::path_text::split_archive;
use qcbus_sdk::{AnyRule, Bundle, LoadError, Loaded, Version, VersionRange};

use super::{Example, ExampleFile};

/// A minimal document with a placeholder, so that an example shows only its subject.
///
/// `{major}` and `{minor}` stand for the version. `{example}`, alone on its line, stands for the
/// example.
#[derive(Debug, Clone, Copy)]
pub struct Template {
    /// Name for `in=NAME`. An example without a name uses the first template.
    pub name: &'static str,
    /// The document.
    pub text: &'static str,
}

/// Expected result of a rule for an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The rule runs and finds nothing.
    Good,
    /// The rule finds the issues of the `issues` block.
    Bad,
    /// The rule does not apply.
    Skipped,
}

impl FromStr for Verdict {
    type Err = String;

    fn from_str(word: &str) -> Result<Verdict, String> {
        match word {
            "good" => Ok(Verdict::Good),
            "bad" => Ok(Verdict::Bad),
            "skipped" => Ok(Verdict::Skipped),
            _ => Err(format!(
                "expected `good`, `bad`, `skipped` or `also`, found `{word}`"
            )),
        }
    }
}

/// An example as a set of files.
pub(super) struct Staged {
    /// Names and texts; the root comes first.
    pub files: Vec<(String, String)>,
    /// Number of lines of the template before the example.
    pub hidden_rows: u64,
    /// Number of lines of the example.
    pub shown_rows: u64,
    /// Directory of the files, if there are several.
    folder: Option<tempfile::TempDir>,
}

/// Returns the version for an example's template: that of the example, else the newest one that the
/// rule applies to.
pub(super) fn version_of(
    bundle: &Bundle,
    rule: &dyn AnyRule,
    example: &Example,
) -> Result<Version, String> {
    if let Some(version) = &example.version {
        return version
            .parse()
            .map_err(|_| format!("`{version}` is not a version"));
    }
    let range: VersionRange = rule.facts().versions.parse().unwrap_or_default();
    let newest = bundle
        .versions
        .iter()
        .rev()
        .find(|version| range.contains(**version));
    newest
        .copied()
        .ok_or_else(|| "no known version of the standard has this rule".to_owned())
}

impl Staged {
    /// Puts an example into its template. A text that begins with `<?xml` or the first template's
    /// root element is a complete document and stays unchanged. A further file stays unchanged
    /// unless it names a template.
    pub fn new(
        bundle: &Bundle,
        templates: &[Template],
        example: &Example,
        version: Version,
    ) -> Result<Staged, String> {
        let Some((ExampleFile { name, text, .. }, others)) = example.files.split_first() else {
            return Err("an example needs a document".to_owned());
        };
        let extension = bundle.kinds.first().map_or("xml", |kind| kind.as_str());
        let name = name
            .clone()
            .unwrap_or_else(|| format!("example.{extension}"));
        let shown_rows = text.lines().count() as u64;
        let (text, hidden_rows) = if example.template.is_none() && is_whole(templates, text) {
            (text.clone(), 0)
        } else {
            fill(templates, example.template.as_deref(), version, text)?
        };
        let mut files = vec![(name, text)];
        for file in others {
            let name = file.name.clone().unwrap_or_default();
            let text = match &file.template {
                Some(template) => fill(templates, Some(template), version, &file.text)?.0,
                None => file.text.clone(),
            };
            files.push((name, text));
        }
        let folder = match files.len() {
            1 if split_archive(&files[0].0).is_none() => None,
            _ => Some(written(&files).map_err(|error| format!("cannot write the files: {error}"))?),
        };
        Ok(Staged {
            files,
            hidden_rows,
            shown_rows,
            folder,
        })
    }

    /// Builds the documents.
    pub fn load(&self) -> Result<Loaded, LoadError> {
        let (name, text) = self
            .files
            .first()
            .map_or(("", ""), |(name, text)| (name, text));
        match &self.folder {
            None => Loaded::from_bytes(Path::new(name), text.as_bytes().to_vec()),
            Some(folder) => {
                let file = split_archive(name).map_or(name, |(archive, _)| archive);
                Loaded::from_path(&folder.path().join(file), folder.path())
            }
        }
    }

    /// Returns the text with paths in the temporary directory shortened to file names. That
    /// directory differs in each run.
    pub fn without_folder(&self, text: &str) -> String {
        match &self.folder {
            None => text.to_owned(),
            Some(folder) => text.replace(&format!("{}/", folder.path().display()), ""),
        }
    }
}

/// Writes the files to a temporary directory.
fn written(files: &[(String, String)]) -> std::io::Result<tempfile::TempDir> {
    let folder = tempfile::tempdir()?;
    let files: Vec<NamedBytes> = files
        .iter()
        .flat_map(|(name, text)| many(name).map(|name| (name, text.clone().into_bytes())))
        .collect();
    for (name, bytes) in packed(&files)? {
        let path = folder.path().join(name);
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        std::fs::write(path, bytes)?;
    }
    Ok(folder)
}

/// Expands `part{1..1200}.xosc` to that many names, for examples that exceed a limit.
fn many(name: &str) -> impl Iterator<Item = String> {
    let range = name.split_once('{').and_then(|(before, rest)| {
        let (range, after) = rest.split_once('}')?;
        let (first, last) = range.split_once("..")?;
        let numbers = first.parse::<u32>().ok()?..=last.parse::<u32>().ok()?;
        Some((before, numbers, after))
    });
    let names: Vec<String> = match range {
        Some((before, numbers, after)) => numbers
            .map(|number| format!("{before}{number}{after}"))
            .collect(),
        None => vec![name.to_owned()],
    };
    names.into_iter()
}

/// A file: its name and its content.
type NamedBytes = (String, Vec<u8>);

/// Returns the files of a directory. Files named `archive.mosc!member` are packed into the archive.
/// An archive may contain another one.
fn packed(files: &[NamedBytes]) -> std::io::Result<Vec<NamedBytes>> {
    let mut whole: Vec<NamedBytes> = Vec::new();
    let mut archives: Vec<(String, Vec<NamedBytes>)> = Vec::new();
    for (name, bytes) in files {
        let Some((archive, member)) = split_archive(name) else {
            whole.push((name.clone(), bytes.clone()));
            continue;
        };
        let member = (member.to_owned(), bytes.clone());
        match archives.iter_mut().find(|(other, _)| *other == archive) {
            Some((_, members)) => members.push(member),
            None => archives.push((archive.to_owned(), vec![member])),
        }
    }
    for (archive, members) in archives {
        let bytes = qcbus_ingest::modular::pack(&packed(&members)?);
        whole.push((archive, bytes.map_err(std::io::Error::other)?));
    }
    Ok(whole)
}

fn is_whole(templates: &[Template], text: &str) -> bool {
    let root = templates
        .first()
        .map_or("", |template| root_tag(template.text));
    text.starts_with("<?xml") || text.trim_start().starts_with(root)
}

/// Returns the start of the root tag of a template, such as `<OpenDRIVE`, whatever precedes it.
fn root_tag(text: &str) -> &str {
    let after = text
        .find("?>")
        .map_or(text, |end| &text[end + 2..])
        .trim_start();
    after.split([' ', '>', '\n']).next().unwrap_or("")
}

const HOLE: &str = "{example}\n";

fn fill(
    templates: &[Template],
    name: Option<&str>,
    version: Version,
    text: &str,
) -> Result<(String, u64), String> {
    let template = match name {
        None => templates.first(),
        Some(name) => templates.iter().find(|template| template.name == name),
    };
    let names = || {
        templates
            .iter()
            .map(|template| template.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let template = template.ok_or_else(|| {
        format!(
            "template not found; the available templates are: {}",
            names()
        )
    })?;
    let whole = template.text.replace("{major}", &version.major.to_string());
    let whole = whole.replace("{minor}", &version.minor.to_string());
    let (before, after) = whole
        .split_once(HOLE)
        .filter(|(before, _)| before.is_empty() || before.ends_with('\n'))
        .ok_or_else(|| format!("the template `{}` has no line `{{example}}`", template.name))?;
    Ok((
        format!("{before}{text}{after}"),
        before.lines().count() as u64,
    ))
}
