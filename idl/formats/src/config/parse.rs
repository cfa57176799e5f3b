//! Parsing of configuration files, with a list of their oddities.

use super::lookup::canonical_bundle;
use super::{
    BundleConfig, CheckerConfig, Config, ConfigError, ConfigParam, LEVEL_PARAM, LEVELS_OF_ASAM,
    LEVELS_OF_READERS, LEVELS_PARAM, Levels, Oddity, Parsed, ReportConfig, TextPosition,
};
use crate::distance::did_you_mean;
use crate::xml::{self, Document, Element, Node};
use crate::xqar::Level;

impl Config {
    /// Reads a configuration file: children in any order, levels in either order or missing.
    ///
    /// # Errors
    /// The file is not well-formed XML, or its root is not `Config`. A bundle, checker, report or
    /// parameter has no name. Everything else that is odd becomes an oddity.
    pub fn parse(bytes: &[u8]) -> Result<Parsed, ConfigError> {
        let document = xml::parse(bytes).map_err(|error| ConfigError {
            row: error.row,
            column: error.column,
            text: error.text,
            hint: error.hint.to_owned(),
        })?;
        let mut parser = Parser {
            document: &document,
            oddities: Vec::new(),
        };
        let config = parser.config(&document.root)?;
        let mut oddities = parser.oddities;
        oddities.sort_by_key(|oddity| (oddity.row, oddity.column));
        Ok(Parsed { config, oddities })
    }
}

struct Parser<'d> {
    document: &'d Document,
    oddities: Vec<Oddity>,
}

impl Parser<'_> {
    fn config(&mut self, root: &Element) -> Result<Config, ConfigError> {
        if root.local_name() != "Config" {
            let text = format!("the root element must be `Config`, found `{}`", root.name);
            return Err(self.error(root.offset, text, "is this a configuration file?"));
        }
        self.attributes(root, &[]);
        self.stray_text(root);
        let mut config = Config::default();
        for child in root.children() {
            match child.local_name() {
                "Param" => self.param(child, &mut config.params)?,
                "CheckerBundle" => {
                    let bundle = self.bundle(child)?;
                    self.add_bundle(&mut config, bundle);
                }
                "ReportModule" => config.reports.push(self.report(child)?),
                _ => self.unknown(child, root, &["Param", "CheckerBundle", "ReportModule"]),
            }
        }
        if root.children().next().is_none() {
            self.warn(root.offset, "the configuration is empty".to_owned());
        }
        Ok(config)
    }

    fn bundle(&mut self, element: &Element) -> Result<BundleConfig, ConfigError> {
        self.attributes(element, &["application"]);
        self.stray_text(element);
        let application = self.required(element, "application")?;
        let position = self.position(element.offset);
        let mut bundle = BundleConfig {
            application,
            position,
            ..BundleConfig::default()
        };
        for child in element.children() {
            match child.local_name() {
                "Param" => self.param(child, &mut bundle.params)?,
                "Checker" => {
                    let checker = self.checker(child)?;
                    self.add_checker(&mut bundle, checker);
                }
                _ => self.unknown(child, element, &["Param", "Checker"]),
            }
        }
        self.misplaced_level(&bundle.params, "bundle");
        Ok(bundle)
    }

    fn checker(&mut self, element: &Element) -> Result<CheckerConfig, ConfigError> {
        self.attributes(element, &["checkerId", "minLevel", "maxLevel"]);
        self.stray_text(element);
        let id = self.required(element, "checkerId")?;
        let mildest = self
            .level(element, "minLevel")
            .unwrap_or(Level::Information);
        let worst = self.level(element, "maxLevel").unwrap_or(Level::Error);
        let mut params = Vec::new();
        for child in element.children() {
            match child.local_name() {
                "Param" => self.param(child, &mut params)?,
                _ => self.unknown(child, element, &["Param"]),
            }
        }
        let checker = CheckerConfig {
            id,
            levels: Levels::between(worst, mildest),
            old_order: mildest < worst,
            relevel: self.relevel(&params),
            params,
            position: self.position(element.offset),
        };
        if checker.old_order {
            self.oddities.push(checker.old_order_oddity());
        }
        Ok(checker)
    }

    fn report(&mut self, element: &Element) -> Result<ReportConfig, ConfigError> {
        self.attributes(element, &["application"]);
        self.stray_text(element);
        let application = self.required(element, "application")?;
        let mut params = Vec::new();
        for child in element.children() {
            match child.local_name() {
                "Param" => self.param(child, &mut params)?,
                _ => self.unknown(child, element, &["Param"]),
            }
        }
        self.misplaced_level(&params, "report");
        let position = self.position(element.offset);
        Ok(ReportConfig {
            application,
            params,
            position,
        })
    }

    fn param(
        &mut self,
        element: &Element,
        params: &mut Vec<ConfigParam>,
    ) -> Result<(), ConfigError> {
        self.attributes(element, &["name", "value"]);
        self.stray_text(element);
        for child in element.children() {
            self.unknown(child, element, &[]);
        }
        let name = self.required(element, "name")?;
        if params.iter().any(|earlier| earlier.name == name) {
            let text =
                format!("the parameter `{name}` is defined twice here; the first one is used");
            self.warn(element.offset, text);
            return Ok(());
        }
        let value = element.value("value").unwrap_or_default().to_owned();
        let param = ConfigParam {
            name,
            value,
            position: self.position(element.offset),
        };
        self.oddities.extend(invalid_levels(&param));
        params.push(param);
        Ok(())
    }

    /// Reads a level by number. An invalid level causes a warning and is treated as missing.
    fn level(&mut self, element: &Element, name: &str) -> Option<Level> {
        let attribute = element.attribute(name)?;
        let text = attribute.value.trim();
        let level = text.parse::<i64>().ok().and_then(|n| u8::try_from(n).ok());
        let level = level.and_then(Level::from_number);
        if level.is_none() {
            let value = if name == "minLevel" { 3 } else { 1 };
            let text = format!(
                "{name}=\"{text}\" is not a level (1 error, 2 warning, 3 information); {value} is used"
            );
            self.warn(attribute.offset, text);
        }
        level
    }

    fn relevel(&mut self, params: &[ConfigParam]) -> Option<Level> {
        let param = params.iter().find(|param| param.name == LEVEL_PARAM)?;
        let level = Level::from_word(&param.value);
        if level.is_none() {
            let value = &param.value;
            let hint = did_you_mean(value, ["error", "warning", "information"]);
            let text = format!(
                "`{LEVEL_PARAM}` is `{value}`, which is not a level (error, warning, information) and has no \
                 effect{hint}"
            );
            self.oddities.push(Oddity::warning(param.position, text));
        }
        level
    }

    /// Warns about `qcbus.level` outside of a checker, where it has no effect.
    fn misplaced_level(&mut self, params: &[ConfigParam], what: &str) {
        for param in params.iter().filter(|param| param.name == LEVEL_PARAM) {
            let text =
                format!("`{LEVEL_PARAM}` has no effect on a {what}: it belongs to a checker");
            self.oddities.push(Oddity::warning(param.position, text));
        }
    }

    fn add_checker(&mut self, bundle: &mut BundleConfig, checker: CheckerConfig) {
        if let Some(first) = bundle.checker(&checker.id) {
            let text = format!(
                "checker `{}` is configured twice in this bundle; the first one, in row {}, is used",
                checker.id, first.position.row
            );
            self.oddities.push(Oddity::warning(checker.position, text));
            return;
        }
        bundle.checkers.push(checker);
    }

    /// Adds a bundle. A second entry of a bundle adds its checkers to the first entry. If they were
    /// dropped, files could be accepted without the requested checks.
    fn add_bundle(&mut self, config: &mut Config, bundle: BundleConfig) {
        let names = |application: &str| canonical_bundle(application).map(|(name, _)| name);
        let meant = names(&bundle.application);
        let Some(first) = config.bundles.iter_mut().find(|first| {
            first.application == bundle.application
                || (meant.is_some() && names(&first.application) == meant)
        }) else {
            config.bundles.push(bundle);
            return;
        };
        let text = format!(
            "bundle `{}` is configured twice; new entries here are added to the first one, in row {}",
            bundle.application, first.position.row
        );
        self.oddities.push(Oddity::warning(bundle.position, text));
        merge(first, bundle, self);
    }

    fn attributes(&mut self, element: &Element, known: &[&str]) {
        for attribute in &element.attributes {
            let name = attribute.name.as_str();
            let namespace = name == "xmlns" || name.contains(':');
            if !namespace && !known.contains(&name) {
                let hint = did_you_mean(name, known.iter().copied());
                let text = format!("unknown attribute of `{}`: `{name}`{hint}", element.name);
                self.warn(attribute.offset, text);
            }
        }
    }

    fn unknown(&mut self, element: &Element, parent: &Element, known: &[&str]) {
        let hint = did_you_mean(element.local_name(), known.iter().copied());
        let text = format!(
            "unknown element `{}` in `{}`{hint}",
            element.name, parent.name
        );
        self.warn(element.offset, text);
    }

    fn stray_text(&mut self, element: &Element) {
        let text = element.content.iter().find_map(|node| match node {
            Node::Text(text) if !text.trim().is_empty() => Some(text.trim()),
            _ => None,
        });
        if let Some(text) = text {
            let shown: String = text.chars().take(30).collect();
            self.warn(
                element.offset,
                format!("text in `{}` has no effect: `{shown}`", element.name),
            );
        }
    }

    fn required(&self, element: &Element, name: &str) -> Result<String, ConfigError> {
        match element.value(name).map(str::trim) {
            Some(value) if !value.is_empty() => Ok(value.to_owned()),
            found => {
                let state = if found.is_some() {
                    "is empty"
                } else {
                    "is missing"
                };
                let text = format!("the attribute `{name}` of `{}` {state}", element.name);
                let written = element.attributes.iter().map(|a| a.name.as_str());
                let hint = match crate::distance::closest(name, written) {
                    Some(near) if near != name => format!("`{near}` should be `{name}`"),
                    _ => String::new(),
                };
                Err(self.error(element.offset, text, &hint))
            }
        }
    }

    fn position(&self, offset: usize) -> TextPosition {
        let (row, column) = self.document.place(offset);
        TextPosition { row, column }
    }

    fn warn(&mut self, offset: usize, text: String) {
        self.oddities
            .push(Oddity::warning(self.position(offset), text));
    }

    fn error(&self, offset: usize, text: String, hint: &str) -> ConfigError {
        let TextPosition { row, column } = self.position(offset);
        ConfigError {
            row,
            column,
            text,
            hint: hint.to_owned(),
        }
    }
}

/// Returns a warning if a parameter selects levels that do not exist.
fn invalid_levels(param: &ConfigParam) -> Option<Oddity> {
    if param.name != LEVELS_PARAM {
        return None;
    }
    let value = param.value.trim();
    let text = match value {
        LEVELS_OF_ASAM | LEVELS_OF_READERS => return None,
        "" => format!("`{LEVELS_PARAM}` is empty, which means `{LEVELS_OF_READERS}`"),
        _ => format!(
            "the parameter `{LEVELS_PARAM}` is `{value}`, but must be `{LEVELS_OF_READERS}` or \
             `{LEVELS_OF_ASAM}`: checkers that read it check nothing"
        ),
    };
    Some(Oddity::warning(param.position, text))
}

/// Adds a bundle's second entry to its first. An entry without checkers requests all default
/// checkers, so the merged entry requests them all.
fn merge(first: &mut BundleConfig, second: BundleConfig, parser: &mut Parser<'_>) {
    if first.checkers.is_empty() || second.checkers.is_empty() {
        // One of the two entries leaves the choice to the bundle; a list would restrict it.
        first.checkers.clear();
    }
    let all = first.checkers.is_empty();
    for mut checker in second.checkers {
        if all {
            break;
        }
        // The second entry's own parameters apply only to its own checkers.
        for param in &second.params {
            if !checker.params.iter().any(|own| own.name == param.name) {
                checker.params.push(param.clone());
            }
        }
        parser.add_checker(first, checker);
    }
    if all {
        for param in second.params {
            if !first.params.iter().any(|own| own.name == param.name) {
                first.params.push(param);
            }
        }
    }
}
