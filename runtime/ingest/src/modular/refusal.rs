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
        let text =
            "`scenarioFileName` is empty; it names the file from which groups are taken".to_owned();
        return (What::FileNotFound, text);
    }
    if !name.ends_with(".xosc") && !name.ends_with(".mosc") {
        let text = format!(
            "`{name}` is not looked for: the name of a scenario ends in `.xosc`, that of an archive in `.mosc`, in \
             small letters"
        );
        return (What::Extension, text);
    }
    if let Some((archive, member)) = split_archive(name) {
        let text = format!(
            "`{name}` leads into an archive; refer to `{archive}`, or put `{member}` beside it"
        );
        return (What::Escapes, text);
    }
    let in_archive = split_archive(node.document().path()).is_some();
    if in_archive && has_only_backslashes(name) {
        let text = format!(
            "`{name}` is not looked for: names in archives are parted by `/`; write `{}`",
            name.replace('\\', "/")
        );
        return (What::Escapes, text);
    }
    if in_archive && !stays_inside(name) {
        let text = format!(
            "`{name}` leads out of the archive; what an archive refers to lies in it or in a directory of the search \
             path, by a relative name with `/` and without `..`"
        );
        return (What::Escapes, text);
    }
    let around = match in_archive {
        true => "in the archive nor in those around it",
        false => "beside the scenario",
    };
    let text = format!(
        "`{name}` is neither {around} nor in a directory of the search path ({SEARCH_PATH_VARIABLE})"
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
                FaultCode::ArchiveEscapes | FaultCode::ArchiveDuplicate
            )
    };
    if let Some(fault) = document.faults().find(|fault| !whole(fault.code)) {
        let position = document.position(fault.offset);
        return Some(format!("{position} cannot be read: {}", fault.text));
    }
    let root = document.root()?;
    let found = root.name();
    (found != "OpenSCENARIO")
        .then(|| format!("{} is no scenario: its root is `{found}`", document.path()))
}
