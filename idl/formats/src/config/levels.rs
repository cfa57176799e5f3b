//! The interval between `minLevel` and `maxLevel`.

use serde::{Deserialize, Serialize};

use crate::xqar::Level;

/// Which levels are kept: from the mildest to the worst, both included.
///
/// In files `minLevel` is the mildest and `maxLevel` the worst (3 and 1 keep everything, because
/// a smaller number is worse); in 2023 it was the other way round. Both mean the interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Levels {
    worst: Level,
    mildest: Level,
}

impl Levels {
    /// Every level.
    pub const ALL: Levels = Levels {
        worst: Level::Error,
        mildest: Level::Information,
    };

    /// The interval between two levels, in either order.
    pub fn between(one: Level, other: Level) -> Levels {
        Levels {
            worst: one.min(other),
            mildest: one.max(other),
        }
    }

    /// Whether issues of this level are kept.
    pub fn contains(self, level: Level) -> bool {
        (self.worst..=self.mildest).contains(&level)
    }

    /// The worst level kept.
    pub fn worst(self) -> Level {
        self.worst
    }

    /// The mildest level kept.
    pub fn mildest(self) -> Level {
        self.mildest
    }
}

impl Default for Levels {
    fn default() -> Self {
        Levels::ALL
    }
}
