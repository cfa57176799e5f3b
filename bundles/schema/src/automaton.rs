//! Deterministic automata of regular languages, built by `regex-automata`.

use regex_automata::dfa::{Automaton as _, StartKind, dense};
use regex_automata::nfa::thompson::{self, Compiler, WhichCaptures};
use regex_automata::util::primitives::StateID;
use regex_automata::{Anchored, MatchKind};
use regex_syntax::hir::Hir;

/// Maximum size of an automaton in MiB, and of the memory for its construction.
pub(crate) const MAX_MIB: usize = 4;

/// An automaton that reads a whole text byte by byte.
#[derive(Clone, Debug)]
pub(crate) struct Automaton {
    table: dense::DFA<Vec<u32>>,
    start: StateID,
}

impl Automaton {
    /// Builds the automaton of a language, or returns `None` if it exceeds [`MAX_MIB`].
    pub(crate) fn new(language: &Hir) -> Option<Self> {
        let limit = Some(MAX_MIB << 20);
        let compiling = thompson::Config::new()
            .nfa_size_limit(limit)
            .which_captures(WhichCaptures::None);
        let positions = Compiler::new()
            .configure(compiling)
            .build_from_hir(language)
            .ok()?;
        let config = dense::Config::new()
            .match_kind(MatchKind::All)
            .start_kind(StartKind::Anchored)
            .accelerate(false)
            .dfa_size_limit(limit)
            .determinize_size_limit(limit);
        let table = dense::Builder::new()
            .configure(config)
            .build_from_nfa(&positions)
            .ok()?;
        let start = table.universal_start_state(Anchored::Yes)?;
        Some(Self { table, start })
    }

    /// Returns the first state.
    pub(crate) fn start(&self) -> StateID {
        self.start
    }

    /// Returns the state after these bytes, or `None` if no text of the language goes on like this.
    pub(crate) fn after(&self, mut state: StateID, bytes: &[u8]) -> Option<StateID> {
        for &byte in bytes {
            state = self.table.next_state(state, byte);
            if self.table.is_dead_state(state) {
                return None;
            }
        }
        Some(state)
    }

    /// Checks whether the text may end in this state.
    pub(crate) fn accepts(&self, state: StateID) -> bool {
        let end = self.table.next_eoi_state(state);
        self.table.is_match_state(end)
    }
}
