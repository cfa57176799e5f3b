//! The model of the rules about modular scenarios: `Rule<Modular>` gets an `&Assembly<'_>`.

use qcbus_document::{Document, FileKind, Node};
use qcbus_messages::DocumentRole;
use qcbus_sdk::modular::{Expansion, OFFERS, Piece, Problem, Spot, What};
use qcbus_sdk::{Finding, Model, Place, Sink, Subject, Unbuilt};

/// A modular scenario with its documents, expanded once for all rules.
pub enum Modular {}

/// A modular scenario, or a library file for one.
pub struct Assembly<'d> {
    /// The file with its linked documents.
    pub subject: &'d Subject<'d>,
    /// The result of its expansion.
    pub expansion: Expansion<'d>,
}

impl Model for Modular {
    type Of<'d> = Assembly<'d>;
    type Part = ();

    fn build<'d>(subject: &'d Subject<'d>) -> Result<Assembly<'d>, Unbuilt> {
        let root = subject.written();
        let refers = root.elements("ScenarioReference").next().is_some();
        let offers = root.names().any(|name| name == OFFERS);
        if subject.kind() != FileKind::Mosc && !refers && !offers {
            let why = "the file is a plain scenario: it refers to no other scenario and offers no attributes";
            return Err(Unbuilt::NotApplicable(why.to_owned()));
        }
        Ok(Assembly {
            subject,
            expansion: subject.expansion(),
        })
    }

    fn parts(_: &Assembly<'_>) -> Vec<()> {
        vec![()]
    }
}

/// An archive of a scenario's documents.
#[derive(Clone, Copy)]
pub struct Archive<'d> {
    /// Path of the archive; `archive!member` for an archive within another one.
    pub path: &'d str,
    listing: Document<'d>,
}

/// A file in an archive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Member<'d> {
    /// Name of the file in the archive.
    pub name: &'d str,
    /// Checksum of the content, as recorded in the archive.
    pub crc32: &'d str,
    /// Unpacked size in bytes.
    pub size: u64,
}

impl<'d> Archive<'d> {
    /// Returns the files in the archive.
    pub fn members(&self) -> impl Iterator<Item = Member<'d>> + use<'d> {
        self.listing.elements("Member").map(|node| Member {
            name: node.attr("name").unwrap_or(""),
            crc32: node.attr("crc32").unwrap_or(""),
            size: node
                .attr("size")
                .and_then(|size| size.parse().ok())
                .unwrap_or(0),
        })
    }
}

impl<'d> Assembly<'d> {
    /// Returns the file as it is written.
    pub fn root(&self) -> Document<'d> {
        self.subject.written()
    }

    /// Returns the archives of the documents. The checked archive comes first.
    pub fn archives(&self) -> impl Iterator<Item = Archive<'d>> {
        let listings = self.subject.with_role(DocumentRole::Listing);
        listings.map(|linked| Archive {
            path: linked.document.path(),
            listing: linked.document,
        })
    }

    /// Returns the scenarios that make up this one. The checked file comes first.
    pub fn scenarios(&self) -> impl Iterator<Item = Document<'d>> {
        let linked = self.subject.with_role(DocumentRole::Scenario);
        std::iter::once(self.root()).chain(linked.map(|linked| linked.document))
    }

    /// Returns the document that a reference leads to, even if it is unusable, or `None` if not
    /// found.
    pub fn target(&self, reference: Node<'_>) -> Option<Document<'d>> {
        let pieces = &self.expansion.pieces;
        let path = reference.document().path();
        let from = pieces.iter().find(|piece| piece.document.path() == path)?;
        let mut links = from.links.iter();
        let link = links.find(|link| link.at == reference.offset())?;
        pieces.get(link.to as usize).map(|piece| piece.document)
    }

    /// Returns the first reference that leads to a document, or `None` for the checked file.
    pub fn reference_to(&self, document: Document<'_>) -> Option<Node<'d>> {
        let pieces = &self.expansion.pieces;
        let of = |piece: &Piece<'_>| piece.document.path() == document.path();
        let to = pieces.iter().position(of).filter(|&to| to > 0)?;
        pieces.iter().find_map(|piece| {
            let link = piece.links.iter().find(|link| link.to as usize == to)?;
            let mut references = piece.document.elements("ScenarioReference");
            references.find(|node| node.offset() == link.at)
        })
    }

    /// Reports a finding about a document. For the checked file, the finding is at the place
    /// itself. For another file, it is at the reference that leads there, with `at` as the second
    /// place.
    pub fn say_of<'s, 'f>(
        &self,
        found: &'s mut Sink<'f>,
        at: (Document<'_>, u32),
        text: String,
        here: &str,
    ) -> Finding<'s, 'f> {
        match self.reference_to(at.0) {
            None => found.issue(at, text).here(here),
            Some(reference) => {
                let place = Place::attribute_or_node(reference, "scenarioFileName");
                found.issue(place, text).at(at, here)
            }
        }
    }

    /// Returns the problems of the given kinds, in the order in which the expansion found them.
    pub fn problems(&self, sorts: &'static [What]) -> impl Iterator<Item = &Problem<'d>> {
        let all = self.expansion.problems.iter();
        all.filter(move |problem| sorts.contains(&problem.what))
    }
}

/// Returns the place of a spot.
pub fn place(spot: Spot<'_>) -> Place<'_> {
    match spot {
        Spot::Node(node) => Place::Node(node),
        Spot::Attribute(attribute) => Place::Attribute(attribute),
    }
}

/// Reports a problem of the expansion, with its place in the other file.
pub fn say<'s, 'd, 'p>(
    found: &'s mut Sink<'d>,
    problem: &Problem<'p>,
    there: &str,
) -> Finding<'s, 'd> {
    let finding = found.issue(place(problem.at), problem.text.clone());
    match problem.target {
        Some(target) => finding.at(place(target), there),
        None => finding,
    }
}

/// Reports all problems of the given kinds.
pub fn say_all(assembly: &Assembly<'_>, found: &mut Sink<'_>, sorts: &'static [What], there: &str) {
    for problem in assembly.problems(sorts) {
        say(found, problem, there);
    }
}
