//! Conversion of draft content models to their final form.

use qcbus_document::Node;

use super::dfa;
use super::error::{CompileError, Problem};
use super::particle::Draft;
use crate::model::{AllModel, Content};

/// Returns the content of a type with the children of `draft`.
pub(super) fn finish(node: Node<'_>, draft: Draft) -> Result<Content, CompileError> {
    let Draft {
        children,
        particle,
        all,
        ..
    } = draft;
    if let Some(all) = all {
        let bits = all
            .members
            .iter()
            .filter(|member| member.1)
            .map(|member| 1u64 << member.0);
        let required = bits.fold(0, |mask, bit| mask | bit);
        return Ok(Content::All(AllModel {
            members: children,
            required,
            optional: all.optional,
        }));
    }
    let Some(particle) = particle else {
        return Ok(Content::Empty);
    };
    let model = dfa::build(&particle, children)
        .map_err(|(what, limit)| CompileError::at(node, Problem::TooLarge(what, limit)))?;
    if model.edges.is_empty() && model.states.iter().all(|state| state.wildcard.is_none()) {
        return Ok(Content::Empty);
    }
    Ok(Content::Children(model))
}
