//! The interval between `minLevel` and `maxLevel`.

use serde::{Deserialize, Serialize};

use crate::xqar::Level;

/// The levels to keep: from the mildest to the worst, both included.
///
/// In files `minLevel` is the mildest and `maxLevel` the worst level. 3 and 1 keep everything, as a
/// smaller number is worse. In 2023 the order was reversed. Both mean the same interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Levels {
    worst: Level,
    mildest: Level,
}

impl Levels {
    /// All levels.
    pub const ALL: Levels = Levels {
        worst: Level::Error,
        mildest: Level::Information,
    };

    /// Returns the interval between two levels, in either order.
    pub fn between(one: Level, other: Level) -> Levels {
        Levels {
            worst: one.min(other),
            mildest: one.max(other),
        }
    }

    /// Checks whether issues of this level are kept.
    pub fn contains(self, level: Level) -> bool {
        (self.worst..=self.mildest).contains(&level)
    }

    /// Returns the worst level kept.
    pub fn worst(self) -> Level {
        self.worst
    }

    /// Returns the mildest level kept.
    pub fn mildest(self) -> Level {
        self.mildest
    }
}

impl Default for Levels {
    fn default() -> Self {
        Levels::ALL
    }
}
