//! `qcbus config check`: validates a configuration.

use std::path::Path;

use qcbus_configuration::{Loaded, Sources};
use qcbus_formats::config::Oddity;
use qcbus_formats::xqar::Level;
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Exit, shown};

use super::settings::manifest_directory;
use crate::{standard, talk};

/// Runs the command.
pub fn check(file: &Path, bundles_d: Option<&Path>) -> Exit {
    match load(file, bundles_d) {
        Ok(loaded) => tell(file, &loaded),
        Err(why) => {
            talk::fail(&why);
            Exit::Usage
        }
    }
}

/// Loads the configuration as a broker started with it does.
fn load(file: &Path, bundles_d: Option<&Path>) -> Result<Loaded, String> {
    let sources = Sources {
        config: Some(file.to_path_buf()),
        lasting: false,
        bundles_d: bundles_d.map(manifest_directory).transpose()?,
        own_verdicts: false,
        choice: Default::default(),
        strict: false,
        all: false,
        standard: Vec::new(),
        reporters: Vec::new(),
        known: standard::known(),
        adapter: standard::adapter(Path::new("qcbus"), true),
    };
    sources.load().map_err(|error| error.to_string())
}

/// Prints notices and warnings. A configuration with warnings is an error: the broker does not do
/// what the named settings say, and a script that checks it in advance must notice.
fn tell(file: &Path, loaded: &Loaded) -> Exit {
    for line in &loaded.notices {
        talk::print(&format!("{}\n", shown::line(line)));
    }
    let shown = to_text(file);
    let is_warning = |oddity: &&Oddity| oddity.level <= Level::Warning;
    let warnings = loaded.oddities.iter().filter(is_warning).count();
    if warnings == 0 {
        talk::say(&format!("{shown}: valid"));
        return Exit::Accepted;
    }
    let warnings = match warnings {
        1 => "1 warning".to_owned(),
        several => format!("{several} warnings"),
    };
    talk::fail(&format!(
        "{shown}: not valid, {warnings}: these settings do not work as written"
    ));
    Exit::Usage
}
