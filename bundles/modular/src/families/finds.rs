//! What comes with groups that are taken often is said once.

use std::collections::HashMap;

use qcbus_sdk::Sink;
use qcbus_sdk::modular::Spot;

use crate::assembly::place;

/// Most further places that a finding lists.
const MOST: usize = 5;

/// Findings about groups that are taken, each said once: one that is to be mended in a library file
/// however often the group is taken, one about a value however many attributes get it.
#[derive(Default)]
pub struct Finds<'d> {
    all: Vec<Find<'d>>,
    known: HashMap<(usize, u32, String), usize>,
}

struct Find<'d> {
    at: Spot<'d>,
    target: Spot<'d>,
    there: &'static str,
    text: String,
    more: Vec<(Spot<'d>, &'static str)>,
}

impl<'d> Finds<'d> {
    /// Something that `target` in a library file brings along; `at` takes its group. Of what was noted
    /// with the same text before only the place that takes it is new.
    pub fn brought(&mut self, at: Spot<'d>, target: Spot<'d>, there: &'static str, text: String) {
        let find = Find {
            at,
            target,
            there,
            text,
            more: Vec::new(),
        };
        self.note(target, (at, "it is taken here, too"), find);
    }

    /// Something about a value that is written at `at` and put to `target` in a library file. Of what
    /// was noted with the same text before only the place that gets it is new.
    pub fn given(&mut self, at: Spot<'d>, target: Spot<'d>, there: &'static str, text: String) {
        let find = Find {
            at,
            target,
            there,
            text,
            more: Vec::new(),
        };
        self.note(at, (target, "it is put here, too"), find);
    }

    fn note(&mut self, anchor: Spot<'d>, other: (Spot<'d>, &'static str), find: Find<'d>) {
        let key = (
            anchor.node().document().path().as_ptr() as usize,
            anchor.offset(),
            find.text.clone(),
        );
        let Some(&known) = self.known.get(&key) else {
            self.known.insert(key, self.all.len());
            self.all.push(find);
            return;
        };
        if let Some(known) = self.all.get_mut(known) {
            let mut spots = known.more.iter().map(|(spot, _)| *spot);
            let is_same =
                |spot: Spot<'_>| spot.offset() == other.0.offset() && spot.node() == other.0.node();
            let is_known = is_same(known.at) || is_same(known.target) || spots.any(is_same);
            if !is_known && known.more.len() < MOST {
                known.more.push(other);
            }
        }
    }

    /// Says them.
    pub fn say(self, found: &mut Sink<'_>) {
        for find in self.all {
            let mut finding = found
                .issue(place(find.at), find.text)
                .at(place(find.target), find.there);
            for (spot, what) in find.more {
                finding = finding.at(place(spot), what);
            }
        }
    }
}
