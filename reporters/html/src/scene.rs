//! The scenario of a result: its map and its story.

use std::sync::Arc;

use qcbus_document::{Document, FileKind};
use qcbus_messages::path_text::from_text;
use qcbus_messages::{DocumentRole, ResultMessage};
use qcbus_openscenario::{Inputs, Linked, RoadNetwork, Scenario, version_of};
use qcbus_reporter_sdk::{Gathered, GatheredFile, Sources};

use crate::story_data::StoryData;

/// A scenario and the files that it refers to.
pub(crate) struct Scene {
    files: Gathered,
    kind: FileKind,
    /// The road network, and its index in the files.
    roads: Option<(usize, Arc<RoadNetwork>)>,
}

impl Scene {
    /// Returns the scenario of a result. Returns `None` if the result is about a map, or if the
    /// checked bytes are no longer available.
    pub(crate) fn of(result: &ResultMessage, sources: &dyn Sources) -> Option<Scene> {
        let kind = FileKind::of_path(&from_text(&result.input))?;
        if !matches!(kind, FileKind::Xosc | FileKind::Mosc) {
            return None;
        }
        let files = Gathered::of(result, sources)?;
        let mut linked = files.linked.iter().enumerate();
        let map = linked.find(|(_, file)| file.role == DocumentRole::Map);
        let roads = map.and_then(|(at, file)| {
            let roads = RoadNetwork::of(file.image.clone()).ok()?;
            Some((at, Arc::new(roads)))
        });
        Some(Scene { files, kind, roads })
    }

    /// Returns the path of the map and its roads, if the map can be read.
    pub(crate) fn map(&self) -> Option<(&str, &RoadNetwork)> {
        let (at, roads) = self.roads.as_ref()?;
        let file = self.files.linked.get(*at)?;
        Some((&file.path, roads))
    }

    /// Returns the story. Returns `None` for a file that is no plain scenario and cannot be
    /// expanded to one.
    pub(crate) fn story(&self, input: &str, shown: &dyn Fn(&str) -> String) -> Option<StoryData> {
        let mut missing = self.files.missing.iter();
        if missing.any(|it| it.role == DocumentRole::Expanded) {
            return None;
        }
        let expanded = self.files.linked.iter();
        let mut expanded = expanded.filter(|file| file.role == DocumentRole::Expanded);
        let root = expanded.next().map_or(&self.files.root, |file| &file.image);
        let document = root.document().ok()?;
        document.root()?.child("Storyboard")?;
        let version = version_of(&document);
        if version.is_some_and(|(major, _)| major != 1) {
            return None;
        }
        let linked: Vec<Linked<'_>> = self.files.linked.iter().filter_map(opened).collect();
        let inputs = Inputs::of(
            document,
            self.kind,
            version,
            &linked,
            &self.files.missing,
            |_| self.roads.as_ref().map(|(_, roads)| roads.clone()),
        );
        Some(StoryData::of(&Scenario::new(&inputs)?, input, shown))
    }
}

fn opened(file: &GatheredFile) -> Option<Linked<'_>> {
    Some(Linked {
        document: Document::open(&file.image).ok()?,
        role: file.role,
        referred_at: file.referred_at,
    })
}
