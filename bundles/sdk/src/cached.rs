//! Cache of models of linked documents between jobs. A hundred scenarios on one map read its roads
//! once.

use std::any::{Any, TypeId};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use qcbus_document::Image;

/// A model of a document that others refer to, such as the road network of a scenario's map. Rules
/// get it from [`crate::Linked::cached`].
///
/// The model outlives the check that built it, so it owns its image. A model that borrows from a
/// document needs a self-referential type, such as `self_cell` provides.
///
/// The findings of a rule must not depend on whether a model was built or cached. The model is the
/// same for the same image. It may only store facts about that image.
pub trait LinkedModel: Send + Sync + Sized + 'static {
    /// Builds the model. Does no I/O; returns `None` if the image cannot be used.
    fn build(image: Image) -> Option<Self>;
}

/// Maximum number of models cached between two jobs. Each holds its image and thus a slot of the
/// bus's large class, which running jobs need, too.
const MOST: usize = 2;
/// Maximum size of their images in bytes.
const MOST_BYTES: usize = 256 << 20;
/// Minimum size in bytes of an image with a cached model. A smaller model is rebuilt faster than a
/// result is sent.
const WORTH_KEEPING: usize = 512 << 10;

/// Identifier of an image. Two different images in the same [`CachedModels`] never have the same
/// one, at any time.
pub(crate) type ImageId = (u64, u64);

/// The models of one process, or of a single check.
#[derive(Clone, Default)]
pub(crate) struct CachedModels(Arc<Mutex<Vec<Arc<Cached>>>>);

/// The models that one job has requested. They live as long as the job, independent of other jobs.
#[derive(Clone, Default)]
pub(crate) struct JobModels {
    cached: CachedModels,
    own: Arc<Mutex<Vec<Arc<Cached>>>>,
}

/// One model. Concurrent requests share it.
struct Cached {
    of: ImageId,
    kind: TypeId,
    bytes: usize,
    /// Built by the first request; `None` inside if the image cannot be used.
    model: OnceLock<Option<Arc<dyn Any + Send + Sync>>>,
}

impl JobModels {
    /// Returns the model of an image, and builds it if it is missing.
    pub(crate) fn get<M: LinkedModel>(&self, of: ImageId, image: &Image) -> Option<Arc<M>> {
        let place = {
            let mut own = lock(&self.own);
            match find::<M>(&own, of) {
                Some(at) => own[at].clone(),
                None => {
                    let place = self.cached.place::<M>(of, image);
                    own.push(place.clone());
                    place
                }
            }
        };
        // The lock is released: building a model may request another one, and may panic. After a
        // panic the next request builds it.
        let build = || Some(Arc::new(M::build(image.clone())?) as Arc<dyn Any + Send + Sync>);
        place.model.get_or_init(build).clone()?.downcast().ok()
    }

    /// Ends the job. Only models that are worth their memory stay cached.
    pub(crate) fn keep(&self) {
        self.cached.tidy();
    }
}

impl CachedModels {
    /// Returns the models for one job.
    pub(crate) fn for_job(&self) -> JobModels {
        JobModels {
            cached: self.clone(),
            own: Arc::default(),
        }
    }

    /// Returns the entry of a model and moves it to the end. The first entries are the least
    /// recently used.
    fn place<M: LinkedModel>(&self, of: ImageId, image: &Image) -> Arc<Cached> {
        let mut models = lock(&self.0);
        let place = match find::<M>(&models, of) {
            Some(at) => models.remove(at),
            None => Arc::new(Cached {
                of,
                kind: TypeId::of::<M>(),
                bytes: image.len(),
                model: OnceLock::new(),
            }),
        };
        models.push(place.clone());
        place
    }

    /// Removes models that are not worth their memory until the next job.
    fn tidy(&self) {
        let mut models = lock(&self.0);
        models.retain(|cached| {
            cached.bytes >= WORTH_KEEPING && !matches!(cached.model.get(), Some(None))
        });
        let surplus = models.len().saturating_sub(MOST);
        models.drain(..surplus);
        while models.iter().map(|cached| cached.bytes).sum::<usize>() > MOST_BYTES {
            models.remove(0);
        }
    }

    /// Drops all models, and with them their images. Running jobs keep theirs.
    pub(crate) fn clear(&self) {
        lock(&self.0).clear();
    }

    /// Returns the number of cached models.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        lock(&self.0).len()
    }
}

fn find<M: LinkedModel>(models: &[Arc<Cached>], of: ImageId) -> Option<usize> {
    let kind = TypeId::of::<M>();
    models.iter().position(|it| it.of == of && it.kind == kind)
}

fn lock(models: &Mutex<Vec<Arc<Cached>>>) -> MutexGuard<'_, Vec<Arc<Cached>>> {
    models.lock().unwrap_or_else(PoisonError::into_inner)
}

impl fmt::Debug for CachedModels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CachedModels").finish_non_exhaustive()
    }
}

impl fmt::Debug for JobModels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("JobModels").finish_non_exhaustive()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The first byte of an image; also one of several model types of an image.
    #[derive(Debug, PartialEq)]
    pub(crate) struct First(u8);

    impl LinkedModel for First {
        fn build(image: Image) -> Option<First> {
            image.first().copied().map(First)
        }
    }

    struct Len(usize);

    impl LinkedModel for Len {
        fn build(image: Image) -> Option<Len> {
            Some(Len(image.len()))
        }
    }

    struct Slow;

    impl LinkedModel for Slow {
        fn build(_: Image) -> Option<Slow> {
            // The loop gives the other threads time to request the model.
            for _ in 0..1000 {
                std::thread::yield_now();
            }
            Some(Slow)
        }
    }

    struct Panics;

    impl LinkedModel for Panics {
        fn build(_: Image) -> Option<Panics> {
            panic!("on purpose")
        }
    }

    /// Returns an image. Zeroed memory that is not written to costs nothing.
    pub(crate) fn image(first: u8, bytes: usize) -> Image {
        let mut all = vec![0; bytes];
        all.iter_mut().take(1).for_each(|byte| *byte = first);
        Image::new(all)
    }

    fn large(first: u8) -> Image {
        image(first, WORTH_KEEPING)
    }

    #[test]
    fn model_is_built_once_for_each_image() {
        let models = CachedModels::default();
        let one = models.for_job().get::<First>((1, 1), &large(1)).unwrap();
        models.tidy();
        // In another generation the same number belongs to another document.
        let two = models.for_job().get::<First>((2, 1), &large(2)).unwrap();
        models.tidy();
        assert_eq!((&*one, &*two), (&First(1), &First(2)));
        let job = models.for_job();
        let again = job.get::<First>((1, 1), &large(1)).unwrap();
        assert!(Arc::ptr_eq(&one, &again));
        assert_eq!(job.get::<Len>((1, 1), &large(1)).unwrap().0, large(1).len());
    }

    #[test]
    fn most_recently_used_images_are_kept() {
        let models = CachedModels::default();
        let id = |number: u8| (1, u64::from(number));
        let of =
            |job: &JobModels, number: u8| job.get::<First>(id(number), &large(number)).unwrap();
        let get = |number: u8| of(&models.for_job(), number);
        let one = get(1);
        get(2);
        get(1);
        get(3);
        assert_eq!(models.len(), 3, "while the job lasts");
        models.tidy();
        assert_eq!(models.len(), MOST);
        assert!(Arc::ptr_eq(&get(1), &one), "used after the second");
        assert_eq!(models.len(), MOST);
        get(2);
        assert_eq!(models.len(), MOST + 1, "built anew");
        models.clear();
        assert!(!Arc::ptr_eq(&get(1), &one));
    }

    #[test]
    fn model_of_small_or_huge_image_is_not_cached() {
        for bytes in [1, WORTH_KEEPING - 1, MOST_BYTES + 1] {
            let models = CachedModels::default();
            let image = image(1, bytes);
            let job = models.for_job();
            let one = job.get::<First>((1, 1), &image).unwrap();
            // Another job ends while this one runs.
            models.for_job().keep();
            assert_eq!(models.len(), 0, "{bytes}");
            let again = job.get::<First>((1, 1), &image).unwrap();
            assert!(Arc::ptr_eq(&one, &again));
        }
    }

    #[test]
    fn concurrent_jobs_build_single_model() {
        let models = CachedModels::default();
        let image = large(1);
        let got: Vec<Arc<Slow>> = std::thread::scope(|scope| {
            let ask = || models.for_job().get::<Slow>((1, 1), &image).unwrap();
            let threads: Vec<_> = (0..4).map(|_| scope.spawn(ask)).collect();
            threads.into_iter().map(|it| it.join().unwrap()).collect()
        });
        assert!(got.iter().all(|it| Arc::ptr_eq(it, &got[0])));
    }

    #[test]
    fn model_that_cannot_be_built_is_not_kept() {
        let models = CachedModels::default();
        let job = models.for_job();
        assert!(job.get::<First>((1, 1), &image(1, 0)).is_none());
        let asked = std::panic::AssertUnwindSafe(|| job.get::<Panics>((1, 1), &large(1)));
        assert!(std::panic::catch_unwind(asked).is_err());
        models.clear();
        assert!(models.for_job().get::<First>((1, 1), &large(1)).is_some());
    }
}
