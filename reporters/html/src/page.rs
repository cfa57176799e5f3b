//! The HTML file around the data.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use qcbus_reporter_sdk::ReportError;
use sha2::{Digest as _, Sha256};

/// Scripts of both kinds of pages, in loading order.
const SHARED: &[&str] = &[
    include_str!("../assets/shared.js"),
    include_str!("../assets/markdown.js"),
    include_str!("../assets/list.js"),
];

/// Scripts of the page of a result, loaded after the shared ones.
const OF_RESULT: &[&str] = &[
    include_str!("../assets/plan-data.js"),
    include_str!("../assets/plan-grid.js"),
    include_str!("../assets/plan-pick.js"),
    include_str!("../assets/plan-theme.js"),
    include_str!("../assets/plan-paint.js"),
    include_str!("../assets/plan-detail.js"),
    include_str!("../assets/plan-tile.js"),
    include_str!("../assets/plan-camera.js"),
    include_str!("../assets/plan-markers.js"),
    include_str!("../assets/plan-actors.js"),
    include_str!("../assets/plan-view.js"),
    include_str!("../assets/model.js"),
    include_str!("../assets/story-model.js"),
    include_str!("../assets/story-bars.js"),
    include_str!("../assets/timeline-rows.js"),
    include_str!("../assets/timeline.js"),
    include_str!("../assets/scene.js"),
    include_str!("../assets/filters.js"),
    include_str!("../assets/detail.js"),
    include_str!("../assets/table.js"),
    include_str!("../assets/profile.js"),
    include_str!("../assets/road-panel.js"),
    include_str!("../assets/help.js"),
    include_str!("../assets/report.js"),
];

/// Scripts of the page of a run, loaded after the shared ones.
const OF_RUN: &[&str] = &[
    include_str!("../assets/filters.js"),
    include_str!("../assets/run-files.js"),
    include_str!("../assets/run.js"),
];

const STYLE: &str = include_str!("../assets/style.css");

/// The `id` of the data block that [`stored`] searches for.
const DATA: &str = "data";

/// Content of a page to be written.
pub struct Page<'d> {
    /// Title that a browser shows.
    pub title: &'d str,
    /// The data, as JSON.
    pub data: &'d [u8],
    /// The plan of the road network, for the page of a result.
    pub plan: Option<&'d [u8]>,
    /// Whether it is the page of a run.
    pub is_run: bool,
}

impl Page<'_> {
    /// Returns the whole file.
    ///
    /// # Errors
    /// [`ReportError::Form`] when the data cannot be packed.
    pub fn render(&self) -> Result<String, ReportError> {
        let own = if self.is_run { OF_RUN } else { OF_RESULT };
        let script = [SHARED, own].concat().concat();
        let title = escaped(self.title);
        let mut blocks = block(DATA, self.data)?;
        if let Some(plan) = self.plan {
            blocks.push_str(&block("plan", plan)?);
        }
        let policy = format!(
            "default-src 'none'; script-src '{}'; style-src '{}'; base-uri 'none'; form-action 'none'",
            digest(&script),
            digest(STYLE)
        );
        Ok(format!(
            "<!doctype html>\n\
             <html lang=\"en\">\n\
             <head>\n\
             <meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{title}</title>\n\
             <style>{STYLE}</style>\n\
             </head>\n\
             <body>\n\
             <main id=\"app\"></main>\n\
             <noscript>This page is drawn by the script that it contains; allow it, or read the .xqar \
             beside it.</noscript>\n\
             {blocks}\
             <script>{script}</script>\n\
             </body>\n\
             </html>\n"
        ))
    }
}

/// Returns the data of a page that was written earlier, or `None` if qcbus did not write the page.
pub(crate) fn stored(page: &str) -> Option<Vec<u8>> {
    use std::io::Read as _;
    let (_, rest) = page.split_once(&opening(DATA))?;
    let (packed, _) = rest.split_once('<')?;
    let packed = STANDARD.decode(packed.trim()).ok()?;
    let mut data = Vec::new();
    flate2::read::GzDecoder::new(packed.as_slice())
        .read_to_end(&mut data)
        .ok()?;
    Some(data)
}

fn opening(id: &str) -> String {
    format!("<script type=\"application/octet-stream\" id=\"{id}\">")
}

fn block(id: &str, bytes: &[u8]) -> Result<String, ReportError> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::new(6));
    let packed = packed.write_all(bytes).and_then(|()| packed.finish());
    let packed = packed.map_err(|error| ReportError::Form(error.to_string()))?;
    let mut block = opening(id);
    STANDARD.encode_string(packed, &mut block);
    block.push_str("</script>\n");
    Ok(block)
}

/// Returns the hash of a script or style as a content security policy writes it.
fn digest(text: &str) -> String {
    let digest = Sha256::digest(text.as_bytes());
    format!("sha256-{}", STANDARD.encode(digest))
}

/// Escapes text between tags.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' | '>' | '&' | '"' | '\'' => {
                // Writing to a string cannot fail.
                let _ = write!(safe, "&#{};", u32::from(c));
            }
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_of_page_is_extracted_again() {
        let data = "{\"hostile\": \"</script><script>alert(1)</script>\"}";
        let page = Page {
            title: "</title><b>&",
            data: data.as_bytes(),
            plan: None,
            is_run: true,
        };
        let text = page.render().unwrap();
        assert!(!text.contains("alert(1)") && !text.contains("<b>"));
        assert_eq!(stored(&text).as_deref(), Some(data.as_bytes()));
        assert_eq!(stored("<html>"), None);
        let (torn, _) = text.split_once("id=\"data\">").unwrap();
        assert_eq!(stored(torn), None);
    }

    #[test]
    fn embedded_scripts_and_style_contain_no_end_tags() {
        for text in [SHARED, OF_RESULT, OF_RUN].concat() {
            assert!(!text.to_lowercase().contains("</script"));
            assert!(!text.contains("<!--"));
        }
        assert!(!STYLE.to_lowercase().contains("</style"));
    }
}
