//! Configuration file for a module: the configuration in force with the file names of the run.

use std::path::Path;

use qcbus_formats::config::{BundleConfig, Config, ConfigParam, INPUT_PARAMS};
use qcbus_formats::markup::Markup;

/// Parameters of a bundle that name its result file. The framework's name comes first.
const RESULT_PARAMS: [&str; 2] = ["resultFile", "strResultFile"];

/// Parameters of a report module that name the result file.
const RESULT_INPUTS: [&str; 2] = ["InputFile", "strInputFile"];
/// Parameters of a report module that name its output file.
const OUTPUT_PARAMS: [&str; 2] = ["OutputFile", "strReportFile"];

/// Input for the configuration text.
pub(crate) struct Configuration<'c> {
    /// Name under which the module is hosted.
    pub name: &'c str,
    /// File to check.
    pub input: &'c str,
    /// Configuration in force.
    pub config: Option<&'c Config>,
    /// Names under which the module may look for its section, each with its result file.
    pub sections: &'c [(String, String)],
}

impl Configuration<'_> {
    /// Returns the configuration text.
    pub fn text(&self) -> String {
        let mut out = Markup::new(String::new());
        out.open("Config", &[]);
        param(&mut out, INPUT_PARAMS[0], self.input);
        params(&mut out, self.config.map_or(&[][..], |it| &it.params));
        let own = self.config.and_then(|it| it.bundle(self.name, self.name));
        for (application, result) in self.sections {
            out.open("CheckerBundle", &[("application", application)]);
            param(&mut out, RESULT_PARAMS[0], result);
            if let Some(own) = own {
                section(&mut out, own);
            }
            out.close("CheckerBundle");
        }
        out.close("Config");
        out.finish()
    }
}

/// Returns the configuration of a report module: the result file, the output file and its own
/// parameters. ASAM's modules name the two files differently from others.
pub(crate) fn of_report(applications: &[String], result: &str, own: &[(String, String)]) -> String {
    let named = own
        .iter()
        .rev()
        .find(|(name, _)| OUTPUT_PARAMS.contains(&name.as_str()));
    // A module writes to its own directory, so only the file name of the path is used.
    let named = named.and_then(|(_, value)| Path::new(value).file_name()?.to_str());
    let report = named
        .filter(|it| !it.starts_with("__"))
        .unwrap_or("Report.txt");
    let mut out = Markup::new(String::new());
    out.open("Config", &[]);
    param(&mut out, INPUT_PARAMS[0], result);
    for application in applications {
        out.open("ReportModule", &[("application", application)]);
        for name in RESULT_INPUTS {
            param(&mut out, name, result);
        }
        for name in OUTPUT_PARAMS {
            param(&mut out, name, report);
        }
        let is_ours = |name: &str| RESULT_INPUTS.contains(&name) || OUTPUT_PARAMS.contains(&name);
        for (name, value) in own.iter().filter(|(name, _)| !is_ours(name)) {
            param(&mut out, name, value);
        }
        out.close("ReportModule");
    }
    out.close("Config");
    out.finish()
}

fn section(out: &mut Markup, own: &BundleConfig) {
    params(out, &own.params);
    for checker in &own.checkers {
        // ASAM writes the larger number for the milder level.
        let mildest = (checker.levels.mildest() as u8).to_string();
        let worst = (checker.levels.worst() as u8).to_string();
        let attributes = [
            ("checkerId", checker.id.as_str()),
            ("maxLevel", &worst),
            ("minLevel", &mildest),
        ];
        out.open("Checker", &attributes);
        params(out, &checker.params);
        out.close("Checker");
    }
}

/// Writes parameters, except those that name files of the run. The adapter sets these itself.
fn params(out: &mut Markup, all: &[ConfigParam]) {
    let is_ours = |name: &str| INPUT_PARAMS.contains(&name) || RESULT_PARAMS.contains(&name);
    for it in all.iter().filter(|it| !is_ours(&it.name)) {
        param(out, &it.name, &it.value);
    }
}

fn param(out: &mut Markup, name: &str, value: &str) {
    out.empty("Param", &[("name", name), ("value", value)]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn report_module_gets_result_path_and_own_output_path() {
        let own = [
            ("strReportFile".to_owned(), "/somewhere/mine.txt".to_owned()),
            ("strInputFile".to_owned(), "other.xqar".to_owned()),
            ("p".to_owned(), "1".to_owned()),
        ];
        let names = ["mine".to_owned(), "TextReport".to_owned()];
        let text = of_report(&names, "/in/r.xqar", &own);
        let read = Config::parse(text.as_bytes()).unwrap().config;
        assert_eq!(read.reports.len(), 2);
        let params: Vec<(&str, &str)> = read.reports[1]
            .params
            .iter()
            .map(|it| (&*it.name, &*it.value))
            .collect();
        let expected = [
            ("InputFile", "/in/r.xqar"),
            ("strInputFile", "/in/r.xqar"),
            ("OutputFile", "mine.txt"),
            ("strReportFile", "mine.txt"),
            ("p", "1"),
        ];
        assert_eq!(params, expected);
        let stream = [("OutputFile".to_owned(), "__stdout__".to_owned())];
        assert!(of_report(&names, "/r", &stream).contains("\"Report.txt\""));
    }

    #[test]
    fn module_configuration_keeps_settings_and_replaces_paths() {
        let given = br#"<Config><Param name="InputFile" value="other"/><Param name="g" value="1"/>
            <CheckerBundle application="mine"><Param name="resultFile" value="there"/>
              <Param name="p" value="a &quot;b&quot; &lt;c&gt;&#10;"/>
              <Checker checkerId="one" maxLevel="1" minLevel="2"><Param name="q" value="3"/></Checker>
            </CheckerBundle>
            <CheckerBundle application="other"><Param name="z" value="0"/></CheckerBundle></Config>"#;
        let given = Config::parse(given).unwrap().config;
        let text = Configuration {
            name: "mine",
            input: "/in/a & b.xodr",
            config: Some(&given),
            sections: &[("xodrBundle".to_owned(), "r.xqar".to_owned())],
        }
        .text();
        let read = Config::parse(text.as_bytes()).unwrap().config;
        assert_eq!(read.input_file(), Some("/in/a & b.xodr"));
        let names = |params: &[ConfigParam]| -> Vec<(String, String)> {
            let all = params.iter();
            all.map(|it| (it.name.clone(), it.value.clone())).collect()
        };
        let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        assert_eq!(
            names(&read.params),
            [pair("InputFile", "/in/a & b.xodr"), pair("g", "1")]
        );
        assert_eq!(read.bundles.len(), 1);
        let bundle = &read.bundles[0];
        assert_eq!(bundle.application, "xodrBundle");
        assert_eq!(
            names(&bundle.params),
            [pair("resultFile", "r.xqar"), pair("p", "a \"b\" <c>\n")]
        );
        let checker = &bundle.checkers[0];
        assert_eq!(checker.levels, given.bundles[0].checkers[0].levels);
        assert_eq!(names(&checker.params), [pair("q", "3")]);
    }
}
