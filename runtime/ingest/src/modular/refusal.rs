//! Explains why a reference has no target, or has a target without usable groups.

use qcbus_document::{Document, FaultCode, Node};
use qcbus_messages::path_text::split_archive;

use super::SEARCH_PATH_VARIABLE;
use super::problem::What;
use crate::archive::{has_only_backslashes, stays_inside};

/// Returns the reason why a reference has no target.
pub(super) fn not_found(node: Node<'_>) -> (What, String) {
    let Some(name) = node.attr("scenarioFileName") else {
        let text = "`ScenarioReference` needs the attribute `scenarioFileName`".to_owned();
        return (What::FileNotFound, text);
    };
    if name.trim().is_empty() {
        let text = "`scenarioFileName` is empty; it must name the file from which groups are taken"
            .to_owned();
        return (What::FileNotFound, text);
    }
    if !name.ends_with(".xosc") && !name.ends_with(".mosc") {
        let text = format!(
            "`{name}` is not searched for: the name of a scenario must end in `.xosc`, the name of an archive in \
             `.mosc`, in lower case"
        );
        return (What::Extension, text);
    }
    if let Some((archive, member)) = split_archive(name) {
        let text = format!(
            "`{name}` points into an archive; refer to `{archive}`, or put `{member}` beside it"
        );
        return (What::Escapes, text);
    }
    let in_archive = split_archive(node.document().path()).is_some();
    if in_archive && has_only_backslashes(name) {
        let text = format!(
            "`{name}` is not searched for: names in archives use `/` as separator; write `{}`",
            name.replace('\\', "/")
        );
        return (What::Escapes, text);
    }
    if in_archive && !stays_inside(name) {
        let text = format!(
            "`{name}` points outside the archive; files that an archive refers to must be in it or in a \
             directory of the search path; use a relative name with `/` and without `..`"
        );
        return (What::Escapes, text);
    }
    let around = match in_archive {
        true => "in the archive, in the archives around it",
        false => "beside the scenario",
    };
    let text = format!(
        "`{name}` not found {around} or in a directory of the search path ({SEARCH_PATH_VARIABLE})"
    );
    (What::FileNotFound, text)
}

/// Returns the catalog if a document is a catalog instead of a scenario.
pub(super) fn catalog_of(document: Document<'_>) -> Option<Node<'_>> {
    let root = document.root()?;
    let catalog = root.child("Catalog")?;
    root.child("Storyboard").is_none().then_some(catalog)
}

/// Returns the reason why a scenario cannot be used, or `None`.
pub(super) fn trouble(document: Document<'_>) -> Option<String> {
    // Other faults of an archive leave the scenario itself intact.
    let whole = |code: FaultCode| {
        !code.makes_partial()
            || matches!(
                code,
                FaultCode::ArchiveEscapes
                    | FaultCode::ArchiveBackslash
                    | FaultCode::ArchiveDuplicate
            )
    };
    if let Some(fault) = document.faults().find(|fault| !whole(fault.code)) {
        let position = document.position(fault.offset);
        return Some(format!("{position} cannot be read: {}", fault.text));
    }
    let root = document.root()?;
    let found = root.name();
    (found != "OpenSCENARIO").then(|| {
        format!(
            "{} is not a scenario: its root is `{found}`",
            document.path()
        )
    })
}
