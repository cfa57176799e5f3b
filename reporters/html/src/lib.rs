//! Results as HTML pages: shows the findings and their places on the road.
//!
//! A page is one file that opens from anywhere, also from a mail. It loads nothing, and its content
//! security policy forbids loading. `docs/html-report.md` describes its contents. The road network
//! is drawn from [`qcbus_plan`]; the browser parses no map.
//!
//! Parameters: `OutputFile` (see [`Output`]). For one result, a file with a fixed name is the page
//! of the result. For several results it is the page of the run. The result pages are then in the
//! directory `NAME-files` beside it.

mod page;
mod placing;
mod reporter;
mod result_data;
mod run_data;
mod scene;
#[cfg(test)]
mod scene_tests;
mod story_data;

pub use page::Page;
pub use reporter::HtmlReporter;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::Registration;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-html";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "html",
    name: NAME,
    about: "NAME.html beside every result: a page with the findings on the road",
    is_page: true,
    make: |setting| Box::new(HtmlReporter::new(setting)),
};
