//! The HTML reporter: decides the path of each page.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_messages::path_text::{from_text, to_text};
use qcbus_messages::{ResultMessage, Withdrawn};
use qcbus_reporter_sdk::{
    Output, Pages, ReportError, Reporter, Setting, Sources, Subject, clear_place, earlier,
    one_line, remove_file, replace_file, write_named, write_stream,
};

use crate::page::{Page, stored};
use crate::result_data::ResultData;
use crate::run_data::{RunData, Section};

/// Reporter that writes HTML pages.
pub struct HtmlReporter {
    keep: bool,
    is_run: bool,
    pages: Pages,
    /// The pages of runs, by their paths.
    runs: BTreeMap<PathBuf, Run>,
}

/// The page of a run with its sections.
struct Run {
    path: PathBuf,
    sections: BTreeMap<String, Section>,
}

impl HtmlReporter {
    /// Creates a reporter that has not written any page.
    pub fn new(setting: &Setting) -> HtmlReporter {
        HtmlReporter {
            keep: setting.keep,
            is_run: setting.is_run,
            pages: setting.pages,
            runs: BTreeMap::new(),
        }
    }

    fn run(&mut self, path: &Path) -> Result<&mut Run, ReportError> {
        let (keep, is_run) = (self.keep, self.is_run);
        match self.runs.entry(path.to_owned()) {
            std::collections::btree_map::Entry::Occupied(there) => Ok(there.into_mut()),
            std::collections::btree_map::Entry::Vacant(free) => {
                let run = Run::open(path, keep, is_run)?;
                Ok(free.insert(run))
            }
        }
    }
}

impl Reporter for HtmlReporter {
    fn report(&mut self, result: &ResultMessage, sources: &dyn Sources) -> Result<(), ReportError> {
        let subject = Subject::from(result);
        let output = Output::of(subject.params);
        let (data, plan) = ResultData::of(result, sources, self.pages);
        let title = one_line(&format!("{}: {}", result.display_path, result.verdict));
        let page = render(&title, &data, plan.as_deref(), false)?;
        let Output::File(path) = &output else {
            return match output.own_file(subject, SUFFIX) {
                Some(path) => replace_file(&path, page.as_bytes()),
                None => write_stream(&output, &page),
            };
        };
        let is_run = self.is_run;
        let run = self.run(path)?;
        let key = one_line(subject.display_path);
        let below = run.below(subject.display_path);
        replace_file(&run.directory().join(&below), page.as_bytes())?;
        let link = format!("{}/{}", run.directory_name(), to_text(&below));
        let section = Section::of(result, &data, link);
        run.sections.insert(key, section);
        // The page of a run is needed only at the end, so it is not written after each result.
        if is_run { Ok(()) } else { run.write() }
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
        let subject = Subject::from(gone);
        let output = Output::of(subject.params);
        let Output::File(path) = &output else {
            return match output.own_file(subject, SUFFIX) {
                Some(path) => remove_file(&path),
                None => Ok(()),
            };
        };
        let run = self.run(path)?;
        remove_file(&run.directory().join(run.below(subject.display_path)))?;
        match run.sections.remove(&one_line(subject.display_path)) {
            Some(_) => run.write(),
            None => Ok(()),
        }
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        self.runs.values().try_for_each(|run| match self.is_run {
            true => run.finish(),
            false => run.write(),
        })
    }
}

/// Suffix of the page names.
const SUFFIX: &str = "html";

impl Run {
    fn open(path: &Path, keep: bool, is_run: bool) -> Result<Run, ReportError> {
        let earlier = if keep { earlier(path)? } else { None };
        let data = earlier.and_then(|page| stored(&page));
        let data = data.and_then(|data| serde_json::from_slice::<RunData>(&data).ok());
        let run = Run {
            path: path.to_owned(),
            sections: data.map(RunData::into_sections).unwrap_or_default(),
        };
        if is_run {
            clear_place(path)?;
        } else {
            run.write()?;
        }
        Ok(run)
    }

    /// Returns the directory of the result pages.
    fn directory(&self) -> PathBuf {
        self.path.with_file_name(self.directory_name())
    }

    fn directory_name(&self) -> String {
        let stem = self.path.file_stem().unwrap_or_default();
        format!("{}-files", stem.to_string_lossy())
    }

    /// Returns the path of a result page below that directory.
    fn below(&self, display_path: &str) -> PathBuf {
        qcbus_reporter_sdk::inside(&from_text(&format!("{display_path}.{SUFFIX}")))
    }

    fn write(&self) -> Result<(), ReportError> {
        let title = match self.sections.len() {
            1 => "1 file".to_owned(),
            files => format!("{files} files"),
        };
        let data = RunData::of(&title, &self.sections);
        let page = render(&format!("qcbus: {title}"), &data, None, true)?;
        write_named(&self.path, page.as_bytes())
    }

    /// Writes the page of the run. If there is only one result, its page is used instead.
    fn finish(&self) -> Result<(), ReportError> {
        let Some(only) = self
            .sections
            .keys()
            .next()
            .filter(|_| self.sections.len() == 1)
        else {
            return self.write();
        };
        let page = self.directory().join(self.below(only));
        let bytes = std::fs::read(&page).map_err(|source| ReportError::Write {
            path: page.clone(),
            source,
        })?;
        write_named(&self.path, &bytes)?;
        remove_file(&page)?;
        // Only empty parent directories are removed, because others may use the rest.
        let mut above = page.parent();
        while let Some(directory) = above.filter(|it| it.starts_with(self.directory())) {
            if std::fs::remove_dir(directory).is_err() {
                break;
            }
            above = directory.parent();
        }
        Ok(())
    }
}

fn render(
    title: &str,
    data: &impl serde::Serialize,
    plan: Option<&[u8]>,
    is_run: bool,
) -> Result<String, ReportError> {
    let data = serde_json::to_vec(data).map_err(|error| ReportError::Form(error.to_string()))?;
    let page = Page {
        title,
        data: &data,
        plan,
        is_run,
    };
    page.render()
}
