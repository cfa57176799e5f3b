//! A prepared document: all files are read, but not yet parsed.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::thread;

use qcbus_document::{BuildError, Capacities, FaultCode, ImageBuilder};
use qcbus_messages::path_text::to_text;

use crate::count;
use crate::limits::{Exceeded, Limits};
use crate::read::{FileStamp, sha256};
use crate::text_fault::TextFault;
use crate::xml::{Counter, Halt, Input, SourceText, Splice, SpliceKey, parse};

/// Heap reserved for the text of each fault. Longer texts are truncated.
const FAULT_TEXT: usize = 512;

/// A file with everything that belongs to its image: its text, the texts of its includes, and the
/// faults of their bytes.
#[derive(Debug)]
pub struct Prepared {
    limits: Limits,
    /// Digest of the root. It may be missing until it is requested.
    digest: OnceLock<[u8; 32]>,
    /// The files as they were read. The digest of the root may be missing.
    read: Vec<FileStamp>,
    files: OnceLock<Vec<FileStamp>>,
    texts: Vec<NamedText>,
    splices: HashMap<SpliceKey, Splice>,
    /// Faults with offsets of the image.
    faults: Vec<TextFault>,
    capacities: Capacities,
    /// The image would be too large, so it contains only this fault.
    refused: bool,
}

/// A text and the path that positions in it refer to.
#[derive(Debug)]
pub(crate) struct NamedText {
    pub path: PathBuf,
    pub text: String,
    pub faults: Vec<TextFault>,
    /// The bytes on disk, if they differ from the bytes of the text and are still needed.
    pub source: Option<Vec<u8>>,
}

impl Prepared {
    /// Combines the parts and computes the maximum size of the image. If `digest` is `None`, the
    /// bytes of the first text are identical to those on disk.
    pub(crate) fn new(
        limits: &Limits,
        digest: Option<[u8; 32]>,
        read: Vec<FileStamp>,
        mut texts: Vec<NamedText>,
        splices: HashMap<SpliceKey, Splice>,
    ) -> Prepared {
        let mut faults = Vec::new();
        let mut start = 0;
        for text in &mut texts {
            for fault in text.faults.drain(..) {
                faults.push(TextFault {
                    offset: start + fault.offset,
                    ..fault
                });
            }
            start += text.text.len() + 1;
        }
        let capacities = Capacities::default();
        let mut prepared = Prepared {
            limits: *limits,
            digest: digest.map_or_else(OnceLock::new, OnceLock::from),
            read,
            files: OnceLock::new(),
            texts,
            splices,
            faults,
            capacities,
            refused: false,
        };
        prepared.measure();
        prepared
    }

    /// Returns the SHA-256 of the root file's bytes on disk. For a packed file these are the packed
    /// bytes; for a member of an archive, those of the archive.
    pub fn digest(&self) -> [u8; 32] {
        *self.digest.get_or_init(|| sha256(self.text().as_bytes()))
    }

    /// Returns every file that was read or looked for, the root file first. Watching these files
    /// shows when this document is out of date. The files and their digests identify the document.
    pub fn files(&self) -> &[FileStamp] {
        self.files.get_or_init(|| {
            let mut files = self.read.clone();
            if let Some(root) = files.first_mut().and_then(|root| root.content.as_mut()) {
                root.digest = self.digest();
            }
            files
        })
    }

    /// Returns the path of the root file in the document: `archive!member` for a member.
    pub fn path(&self) -> &Path {
        self.texts.first().map_or(Path::new(""), |text| &text.path)
    }

    /// Returns the decoded text of the root file. For a member of an archive it is the text of the
    /// member.
    pub fn text(&self) -> &str {
        self.texts.first().map_or("", |root| &root.text)
    }

    /// Returns the number of bytes that [`Prepared::build_into`] needs. The image itself is
    /// shorter.
    pub fn upper_bound(&self) -> usize {
        self.capacities.image_len()
    }

    /// Builds the image into the first bytes of `out` and returns its length. A faulty file also
    /// gives an image, and its faults describe the missing parts.
    ///
    /// # Errors
    /// [`BuildError::SmallBuffer`] when `out` is too short. The error's `needed` is then exact and
    /// sufficient for the next attempt. It may be less than [`Prepared::upper_bound`]. It may be
    /// more if a text has unusually many values that must be resolved.
    pub fn build_into(&self, out: &mut [u8]) -> Result<usize, BuildError> {
        if self.digest.get().is_some() || !has_cores() {
            return self.build_here(out);
        }
        thread::scope(|scope| {
            // If no thread can be started, the digest is computed when the image needs it.
            let digest = thread::Builder::new().name("qcbus-digest".to_owned());
            let _beside = digest.spawn_scoped(scope, || self.digest());
            self.build_here(out)
        })
    }

    fn build_here(&self, out: &mut [u8]) -> Result<usize, BuildError> {
        match self.attempt(out, &self.capacities) {
            Err(BuildError::NoRoom { .. } | BuildError::SmallBuffer { .. }) => match self.exact() {
                Ok(exact) => self.attempt(out, &exact),
                Err(_) => self.attempt_refused(out),
            },
            outcome => outcome,
        }
    }

    /// Builds the image into a new buffer.
    ///
    /// # Panics
    /// Never. If the image cannot be built, the result is empty and [`qcbus_document::Document`]
    /// refuses to open it.
    pub fn build(&self) -> Vec<u8> {
        let mut image = vec![0; self.upper_bound()];
        let len = match self.build_into(&mut image) {
            Err(BuildError::SmallBuffer { needed, .. }) => {
                image = vec![0; needed];
                self.build_into(&mut image)
            }
            outcome => outcome,
        };
        image.truncate(len.unwrap_or(0));
        image
    }

    /// Chooses the capacities. The quick bound is used if it is plausible. Otherwise the exact one
    /// is used: for a flood of tags, or when files are included (a file included twice is parsed
    /// twice).
    fn measure(&mut self) {
        let known = self.known();
        let cap = self.max_image();
        if known.image_len() > cap {
            return self.refuse(known.image_len());
        }
        let quick = self
            .texts
            .iter()
            .map(|text| count::quick(&text.text))
            .fold(known, add);
        let plausible = quick.image_len() <= known.text.saturating_mul(4).saturating_add(1 << 20);
        if plausible && self.splices.is_empty() && quick.image_len() <= cap {
            self.capacities = quick;
            return;
        }
        match self.exact() {
            Ok(exact) if exact.image_len() <= cap => self.capacities = exact,
            Ok(exact) => self.refuse(exact.image_len()),
            Err(Halt::TooLarge(found)) => self.refuse(found),
            Err(Halt::Build(_)) => self.refuse(cap),
        }
    }

    /// Returns the capacities that are known without reading the texts.
    fn known(&self) -> Capacities {
        // Faults come from the parser, from its caps and from the bytes.
        let faults = self.limits.max_faults as usize + 2 + self.faults.len();
        let paths: usize = self
            .texts
            .iter()
            .map(|text| to_text(&text.path).len())
            .sum();
        Capacities {
            text: self.texts.iter().map(|text| text.text.len()).sum(),
            sources: self.texts.len(),
            faults,
            heap: paths + faults * FAULT_TEXT,
            ..Capacities::default()
        }
    }

    fn exact(&self) -> Result<Capacities, Halt> {
        let mut counter = Counter::new(self.known(), self.max_image());
        let paths = self.paths();
        parse(&self.input(&paths), &mut counter)?;
        Ok(counter.counted)
    }

    /// Returns the maximum image size. Offsets have 32 bits, so a higher limit has no effect.
    fn max_image(&self) -> usize {
        usize::try_from(self.limits.max_image)
            .unwrap_or(usize::MAX)
            .min(u32::MAX as usize)
    }

    /// Discards the document and keeps a single fault.
    fn refuse(&mut self, found: usize) {
        // The digest must be computed before the text is dropped.
        self.digest();
        let exceeded = Exceeded {
            limit: "max_image",
            what: "bytes or more",
            found: found as u64,
            allowed: self.max_image() as u64,
        };
        let text = format!("the document image would have {exceeded}");
        self.faults = vec![TextFault::new(FaultCode::ImageLimit, 0, text)];
        self.texts.truncate(1);
        self.texts
            .iter_mut()
            .for_each(|text| text.text = String::new());
        self.splices.clear();
        self.refused = true;
        self.capacities = self.known();
    }

    fn attempt(&self, out: &mut [u8], capacities: &Capacities) -> Result<usize, BuildError> {
        let mut builder = ImageBuilder::new(out, capacities)?;
        let paths = self.paths();
        let input = self.input(&paths);
        for source in &input.texts {
            builder.source(source.path, source.text)?;
        }
        let mut faults = self.faults.clone();
        if !self.refused {
            match parse(&input, &mut builder) {
                Ok(found) => {
                    // If the bytes could not be read, the fault `Empty` would be wrong.
                    let said = faults.iter().any(|fault| fault.code.makes_partial());
                    let found = found.into_iter();
                    faults.extend(found.filter(|it| !said || it.code != FaultCode::Empty));
                }
                Err(Halt::Build(error)) => return Err(error),
                Err(Halt::TooLarge(_)) => {}
            }
        }
        faults.sort_by_key(|fault| fault.offset);
        for fault in &faults {
            let text = cut(&fault.text, FAULT_TEXT);
            builder.fault(
                fault.code,
                u32::try_from(fault.offset).unwrap_or(u32::MAX),
                text,
            )?;
        }
        builder.finish(self.digest())
    }

    /// Builds the image of a document that became too large only when its values were resolved.
    fn attempt_refused(&self, out: &mut [u8]) -> Result<usize, BuildError> {
        let mut refused = Prepared {
            limits: self.limits,
            digest: OnceLock::from(self.digest()),
            read: Vec::new(),
            files: OnceLock::new(),
            texts: vec![NamedText {
                path: self.path().to_path_buf(),
                text: String::new(),
                faults: Vec::new(),
                source: None,
            }],
            splices: HashMap::new(),
            faults: Vec::new(),
            capacities: Capacities::default(),
            refused: true,
        };
        refused.refuse(self.max_image());
        refused.attempt(out, &refused.capacities)
    }

    fn paths(&self) -> Vec<String> {
        self.texts.iter().map(|text| to_text(&text.path)).collect()
    }

    fn input<'t>(&'t self, paths: &'t [String]) -> Input<'t> {
        let mut start = 0u32;
        let place = |(text, path): (&'t NamedText, &'t String)| {
            let source = SourceText {
                path,
                text: &text.text,
                start,
            };
            let len = u32::try_from(text.text.len()).unwrap_or(u32::MAX);
            start = start.saturating_add(len).saturating_add(1);
            source
        };
        let texts = self.texts.iter().zip(paths).map(place).collect();
        Input {
            texts,
            splices: &self.splices,
            limits: &self.limits,
        }
    }
}

/// Checks whether the machine can run several threads in parallel.
fn has_cores() -> bool {
    static SEVERAL: OnceLock<bool> = OnceLock::new();
    *SEVERAL.get_or_init(|| thread::available_parallelism().is_ok_and(|cores| cores.get() > 1))
}

fn add(sum: Capacities, other: Capacities) -> Capacities {
    Capacities {
        nodes: sum.nodes.saturating_add(other.nodes),
        attributes: sum.attributes.saturating_add(other.attributes),
        names: sum
            .names
            .saturating_add(other.names)
            .min(Capacities::MAX_NAMES),
        heap: sum.heap.saturating_add(other.heap),
        ..sum
    }
}

fn cut(text: &str, max: usize) -> &str {
    &text[..text.floor_char_boundary(max)]
}
