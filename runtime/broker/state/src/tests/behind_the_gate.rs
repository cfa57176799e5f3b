//! The gate of a random world, with the files that the writers have published.

use std::collections::BTreeMap;

use qcbus_messages::Verdict;

use super::super::*;
use super::things::file_of;
use super::world::World;

/// Published files with the inputs of their acceptance.
pub type Published = BTreeMap<u8, Vec<Input>>;

impl World {
    /// Applies an action to the gate.
    pub fn gate_follows(&mut self, action: &Action) {
        match action {
            Action::CloseGate { path } | Action::Withdraw { path, .. } => {
                self.gate.remove(&file_of(path));
            }
            Action::OpenGate { path, judged } | Action::Restamp { path, judged } => {
                self.publish(file_of(path), judged);
            }
            _ => {}
        }
    }

    /// Publishes an accepted file after its verdict was written. Any other verdict withdraws the file.
    pub fn publish(&mut self, file: u8, judged: &Judged) {
        if judged.verdict == Verdict::Accepted {
            self.gate.insert(file, judged.inputs.clone());
        } else {
            self.gate.remove(&file);
        }
    }

    /// Asserts that published files are the accepted ones, unless a message about a change is on its way.
    pub fn gate_must_be_true(&self) {
        for (file, inputs) in &self.gate {
            let on_the_way = self.told.iter().any(|(it, _)| it.0 == *file);
            if !on_the_way {
                let now = self.inputs(*file);
                assert_eq!(
                    bytes(inputs),
                    bytes(&now),
                    "the published bytes of {file} must be current"
                );
            }
        }
    }

    /// Withdraws, at the start of a broker, files that differ from those that were read. Returns
    /// accepted files that are not published.
    pub fn gate_is_taken_over(&mut self) -> Vec<u8> {
        let journal = self.journal.iter();
        let accepted = journal.filter(|(_, it)| it.verdict == Verdict::Accepted);
        let stand = accepted.filter(|(file, it)| bytes(&it.inputs) == bytes(&self.inputs(**file)));
        let stand: Published = stand.map(|(file, it)| (*file, it.inputs.clone())).collect();
        let as_accepted = |file: &u8, inputs: &[Input]| {
            let accepted = stand.get(file).map(|it| bytes(it));
            accepted == Some(bytes(inputs))
        };
        self.gate.retain(|file, inputs| as_accepted(file, inputs));
        let there = |file: &u8| self.gate.contains_key(file);
        stand.into_keys().filter(|file| !there(file)).collect()
    }
}

fn bytes(inputs: &[Input]) -> Vec<Option<Digest>> {
    inputs.iter().map(Input::digest).collect()
}
