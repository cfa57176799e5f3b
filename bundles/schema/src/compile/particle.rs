//! Content models as trees of particles with resolved groups and references.

use qcbus_document::Node;

use super::Compiler;
use super::components::Kind;
use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};
use crate::model::ElementDecl;

/// A content model before it becomes an automaton.
#[derive(Clone, Debug)]
pub(super) enum Particle {
    Child(u16),
    Any,
    Sequence(Vec<Particle>),
    Choice(Vec<Particle>),
    Repeat {
        what: Box<Particle>,
        min: u32,
        max: Option<u32>,
    },
}

/// A content model with the declarations of its children.
#[derive(Debug, Default)]
pub(super) struct Draft {
    pub(super) children: Vec<ElementDecl>,
    pub(super) particle: Option<Particle>,
    pub(super) all: Option<AllDraft>,
    /// Number of particles so far. It limits exponential growth by group references.
    met: usize,
}

/// An `all` group: indexes of its members in the children, each with whether it is required.
#[derive(Clone, Debug, Default)]
pub(super) struct AllDraft {
    pub(super) members: Vec<(u16, bool)>,
    pub(super) optional: bool,
}

/// Maximum number of particles of one content model after groups are resolved. Published schemas
/// stay below 500.
const MAX_PARTICLES: usize = 10_000;

/// Maximum value of `maxOccurs`. Larger values would only make a large automaton.
const MAX_OCCURS: u32 = 2_000;

impl<'d> Compiler<'d, '_> {
    /// Adds the top-level particle of a type after the content of its base type.
    pub(super) fn add_content(
        &mut self,
        node: Node<'d>,
        draft: &mut Draft,
    ) -> Result<(), CompileError> {
        if let Some(all) = self.top_level_all(node, draft)? {
            if draft.particle.is_some() || draft.all.is_some() {
                return refuse(node, Problem::Unsupported);
            }
            draft.all = Some(all);
            return Ok(());
        }
        let Some(own) = self.particle(node, draft)? else {
            return Ok(());
        };
        if draft.all.is_some() {
            return refuse(node, Problem::Unsupported);
        }
        draft.particle = Some(match draft.particle.take() {
            Some(before) => Particle::Sequence(vec![before, own]),
            None => own,
        });
        Ok(())
    }

    /// Reads `all`, or a reference to a group that consists of `all`.
    fn top_level_all(
        &mut self,
        node: Node<'d>,
        draft: &mut Draft,
    ) -> Result<Option<AllDraft>, CompileError> {
        let mut all = node;
        if node.is("group") {
            let group = self
                .components
                .get(node, Kind::Group, "group", required(node, "ref")?)?;
            match parts(group).next() {
                Some(inner) if inner.is("all") => all = inner,
                _ => return Ok(None),
            }
            if occurs(node)? != (1, Some(1)) {
                return refuse(node, Problem::Unsupported);
            }
        }
        if !all.is("all") {
            return Ok(None);
        }
        only_attributes(all, &["minOccurs", "maxOccurs"])?;
        let optional = match occurs(all)? {
            (1, Some(1)) => false,
            (0, Some(1)) => true,
            _ => return refuse(all, Problem::Unsupported),
        };
        let mut members = Vec::new();
        for part in parts(all) {
            members.push(self.all_member(part, draft)?);
        }
        if members.len() > 64 {
            return refuse(all, Problem::TooLarge("members", 64));
        }
        Ok(Some(AllDraft { members, optional }))
    }

    fn all_member(
        &mut self,
        node: Node<'d>,
        draft: &mut Draft,
    ) -> Result<(u16, bool), CompileError> {
        if !node.is("element") {
            return refuse(node, Problem::Unsupported);
        }
        let required = match occurs(node)? {
            (min, Some(1)) => min > 0,
            _ => return refuse(node, Problem::Unsupported),
        };
        let known = draft.children.len();
        let child = self.child(node, draft)?;
        if usize::from(child) < known {
            return refuse(node, Problem::Invalid("an all group names a child twice"));
        }
        Ok((child, required))
    }

    fn particle(
        &mut self,
        node: Node<'d>,
        draft: &mut Draft,
    ) -> Result<Option<Particle>, CompileError> {
        draft.met += 1;
        if draft.met > MAX_PARTICLES {
            return refuse(node, Problem::TooLarge("particles", MAX_PARTICLES));
        }
        let (min, max) = occurs(node)?;
        let what = self.deeper(node, |this| this.once(node, draft))?;
        Ok(match (min, max) {
            (_, Some(0)) => None,
            (1, Some(1)) => Some(what),
            _ => Some(Particle::Repeat {
                what: Box::new(what),
                min,
                max,
            }),
        })
    }

    fn once(&mut self, node: Node<'d>, draft: &mut Draft) -> Result<Particle, CompileError> {
        match node.name() {
            "element" => self.child(node, draft).map(Particle::Child),
            "any" => any(node),
            "sequence" | "choice" => {
                only_attributes(node, &["minOccurs", "maxOccurs"])?;
                self.members(node, draft)
            }
            "group" => {
                only_attributes(node, &["ref", "minOccurs", "maxOccurs"])?;
                let group =
                    self.components
                        .get(node, Kind::Group, "group", required(node, "ref")?)?;
                only_attributes(group, &["name"])?;
                let mut bodies = parts(group);
                match (bodies.next(), bodies.next()) {
                    (Some(body), None) if !body.is("all") => self
                        .particle(body, draft)
                        .map(|inner| inner.unwrap_or(Particle::Sequence(Vec::new()))),
                    _ => refuse(group, Problem::Unsupported),
                }
            }
            _ => refuse(node, Problem::Unsupported),
        }
    }

    fn members(&mut self, node: Node<'d>, draft: &mut Draft) -> Result<Particle, CompileError> {
        let mut members = Vec::new();
        for part in parts(node) {
            members.extend(self.particle(part, draft)?);
        }
        Ok(if node.is("choice") {
            Particle::Choice(members)
        } else {
            Particle::Sequence(members)
        })
    }

    /// Returns the index of a child's declaration. Equal names in one model need equal types.
    fn child(&mut self, node: Node<'d>, draft: &mut Draft) -> Result<u16, CompileError> {
        let declared = self.local_element(node)?;
        if let Some(index) = draft
            .children
            .iter()
            .position(|child| child.name == declared.name)
        {
            let known = &draft.children[index];
            if known.ty != declared.ty || known.alternatives.len() != declared.alternatives.len() {
                let name = self.schema.names.text(declared.name).to_owned();
                return refuse(node, Problem::Inconsistent(name));
            }
            return Ok(u16::try_from(index).unwrap_or(u16::MAX));
        }
        draft.children.push(declared);
        // `MAX_PARTICLES` limits the number to 16 bits.
        Ok(u16::try_from(draft.children.len() - 1).unwrap_or(u16::MAX))
    }
}

fn any(node: Node<'_>) -> Result<Particle, CompileError> {
    only_attributes(
        node,
        &["minOccurs", "maxOccurs", "processContents", "namespace"],
    )?;
    if node.attr("processContents") != Some("skip") {
        let value = node.attr("processContents").unwrap_or("strict").to_owned();
        return refuse(node, Problem::Only("processContents", value, "skip"));
    }
    match node.attr("namespace") {
        None | Some("##any") => Ok(Particle::Any),
        Some(other) => refuse(node, Problem::Value("namespace", other.to_owned())),
    }
}

/// Reads `minOccurs` and `maxOccurs`. `None` means unbounded.
pub(super) fn occurs(node: Node<'_>) -> Result<(u32, Option<u32>), CompileError> {
    let number = |name: &'static str, text: &str| {
        let parsed = text
            .trim()
            .parse()
            .ok()
            .filter(|&count: &u32| count <= MAX_OCCURS);
        parsed.ok_or_else(|| CompileError::at(node, Problem::Value(name, text.to_owned())))
    };
    let min = node
        .attr("minOccurs")
        .map_or(Ok(1), |text| number("minOccurs", text))?;
    let max = match node.attr("maxOccurs").map(str::trim) {
        Some("unbounded") => None,
        Some(text) => Some(number("maxOccurs", text)?),
        None => Some(1),
    };
    if max.is_some_and(|max| max < min) {
        return refuse(node, Problem::Invalid("maxOccurs is less than minOccurs"));
    }
    Ok((min, max))
}
