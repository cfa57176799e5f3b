//! Results as pages to look at: what was found, and where on the road it is.
//!
//! A page is one file that opens from anywhere, also from a mail: nothing is loaded, and its content
//! security policy lets nothing be. `docs/html-report.md` says what is in it. The road network is drawn
//! from [`qcbus_plan`]; nothing is parsed again in the browser.
//!
//! Parameters: `OutputFile` (see [`Output`]). A file of one name is, for one result, its page; for
//! several, the page of the run, with the pages of the results in the directory `NAME-files` beside it.

mod page;
mod placing;
mod reporter;
mod result_data;
mod run_data;

pub use page::Page;
pub use reporter::HtmlReporter;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::Registration;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-html";

/// What this crate offers.
pub static REPORTER: Registration = Registration {
    alias: "html",
    name: NAME,
    about: "NAME.html beside every result: a page with the findings on the road",
    is_page: true,
    make: |setting| Box::new(HtmlReporter::new(setting)),
};
