//! JSON objects whose keys keep their order.

use serde::{Serialize, Serializer};

/// JSON object with its keys in insertion order.
#[derive(Debug, Default)]
pub(crate) struct Ordered<T>(Vec<(String, T)>);

impl<T> Ordered<T> {
    /// Inserts a value. A key that already exists gets the suffix `#2`, `#3` and so on.
    pub(crate) fn put(&mut self, key: &str, value: T) {
        let taken = |key: &str| self.0.iter().any(|(other, _)| other == key);
        let mut free = key.to_owned();
        let mut number = 2;
        while taken(&free) {
            free = format!("{key}#{number}");
            number += 1;
        }
        self.0.push((free, value));
    }
}

impl<T> FromIterator<(String, T)> for Ordered<T> {
    fn from_iter<I: IntoIterator<Item = (String, T)>>(pairs: I) -> Ordered<T> {
        let mut ordered = Ordered(Vec::new());
        for (key, value) in pairs {
            ordered.put(&key, value);
        }
        ordered
    }
}

impl<T: Serialize> Serialize for Ordered<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duplicate_keys_are_kept_in_original_order() {
        let ordered: Ordered<u8> = ["b", "a", "b"]
            .map(|k| (k.to_owned(), 1))
            .into_iter()
            .collect();
        let text = serde_json::to_string(&ordered).unwrap();
        assert_eq!(text, r##"{"b":1,"a":1,"b#2":1}"##);
    }
}
