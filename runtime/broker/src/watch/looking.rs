//! Where somebody looks at this moment. A look at a file system that does not answer takes as long
//! as it likes, and nobody can end it; but others can say where it hangs.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use qcbus_messages::control::Unseen;

/// Longer than a look at anything takes that answers.
const LONG: Duration = Duration::from_secs(3);

/// Where a thread looks now, and since when.
#[derive(Debug, Default)]
pub struct Looking(Mutex<Option<(PathBuf, Instant)>>);

impl Looking {
    /// Looks at a path.
    pub fn at<T>(&self, path: &Path, look: impl FnOnce() -> T) -> T {
        self.set(Some((path.to_path_buf(), Instant::now())));
        let seen = look();
        self.set(None);
        seen
    }

    fn set(&self, now: Option<(PathBuf, Instant)>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = now;
    }

    /// Where a look has been taking long, and what is to be said of it.
    pub fn takes_long(&self) -> Option<Unseen> {
        self.longer_than(LONG)
    }

    fn longer_than(&self, limit: Duration) -> Option<Unseen> {
        let now = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (path, since) = now.as_ref()?;
        let took = since.elapsed();
        (took >= limit).then(|| Unseen {
            path: path.clone(),
            why: format!(
                "looking at it takes long, {} s so far, as on a mount whose server does not \
                 answer; what else changes is not noticed until it answers or is unmounted",
                took.as_secs()
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_is_named_while_it_lasts() {
        let looking = Looking::default();
        let path = Path::new("/mnt/gone");
        let during = looking.at(path, || looking.longer_than(Duration::ZERO));
        assert_eq!(during.unwrap().path, path);
        assert_eq!(looking.longer_than(Duration::ZERO), None);
        assert_eq!(looking.at(path, || looking.takes_long()), None);
    }
}
