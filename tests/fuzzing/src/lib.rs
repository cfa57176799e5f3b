//! Random and damaged document images for tests: bodies of fuzz targets, and a small writer that
//! makes images without a parser.

mod tree;

pub use tree::{Child, Tree};

use qcbus_document::{BuildError, Capacities, Document, FaultCode, ImageBuilder, Node, XPaths};

/// A small random generator (SplitMix64) with the same numbers on every machine.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Returns the next number.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// Returns a number below `bound` (0 if that is 0).
    pub fn below(&mut self, bound: usize) -> usize {
        (self.number() % bound.max(1) as u64) as usize
    }
}

/// Corrupts an image in one to eight places: bits, bytes, words, ranges, its length.
pub fn corrupt(image: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(8) {
        if image.is_empty() {
            return;
        }
        // Half of the changes affect the header and the columns directly after it.
        let at = if random.below(2) == 0 {
            random.below(image.len().min(512))
        } else {
            random.below(image.len())
        };
        match random.below(6) {
            0 => image[at] ^= 1 << random.below(8),
            1 => image[at] = random.number() as u8,
            2 => overwrite(image, at, &(random.number() as u32).to_le_bytes()),
            3 => overwrite(image, at, &(random.below(300) as u32).to_le_bytes()),
            4 => overwrite(image, at, &[0xFF; 8][..1 + random.below(8)]),
            _ if random.below(8) == 0 => image.truncate(at),
            _ => {
                let from = random.below(image.len());
                let len = random
                    .below(64)
                    .min(image.len() - at)
                    .min(image.len() - from);
                image.copy_within(from..from + len, at);
            }
        }
    }
}

fn overwrite(image: &mut [u8], at: usize, bytes: &[u8]) {
    for (byte, new) in image.iter_mut().skip(at).zip(bytes) {
        *byte = *new;
    }
}

/// Result of reading bytes that may be an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// `open` rejected them.
    Refused,
    /// They could be opened and walked, but `validate` found a contradiction.
    Contradictory,
    /// They are a valid image, and all guarantees for valid images hold.
    Sound,
}

/// Reads any bytes as a fuzz body. They are rejected or can be walked, and valid images keep their
/// guarantees.
pub fn read_image(bytes: &[u8]) -> Outcome {
    let Ok(document) = Document::open(bytes) else {
        return Outcome::Refused;
    };
    walk(document);
    if document.validate().is_err() {
        return Outcome::Contradictory;
    }
    check_promises(document);
    Outcome::Sound
}

/// Calls every accessor. Returns a number that depends on all answers, so that no call is optimised
/// away.
pub fn walk(document: Document<'_>) -> u64 {
    let mut sum = u64::from(document.len()) + document.path().len() as u64 + document.size() as u64;
    sum += document
        .sources()
        .take(SOME)
        .map(|source| document.source_text(&source).len() as u64)
        .sum::<u64>();
    sum += document
        .faults()
        .take(SOME)
        .map(|fault| u64::from(document.position(fault.offset).row))
        .sum::<u64>();
    sum += u64::from(document.is_well_formed());
    let mut paths = XPaths::new(document);
    // Indices that do not exist are included.
    for index in (0..document.len().min(200)).chain([document.len(), u32::MAX - 1, u32::MAX]) {
        let Some(node) = document.node(index) else {
            continue;
        };
        sum += walk_node(node);
        if index < 20 {
            sum += (node.xpath().len()
                + paths.xpath(node).len()
                + paths.positional_xpath(node).len()) as u64;
            sum += document
                .evaluate(&node.positional_xpath())
                .map_or(0, |found| found.len() as u64);
        }
    }
    for xpath in ["/", "//*", "/*/*[last()]", "//road[@id='1']", "//*[2]/@id"] {
        sum += document
            .evaluate(xpath)
            .map_or(0, |found| found.len() as u64);
    }
    sum
}

fn walk_node(node: Node<'_>) -> u64 {
    let mut sum =
        u64::from(node.offset()) + u64::from(node.end_offset()) + u64::from(node.position().column);
    sum += (node.name().len() + node.prefix().len() + node.text().len()) as u64;
    for attribute in node.attributes().take(SOME) {
        sum += (attribute.name().len() + attribute.value().len()) as u64;
        sum += u64::from(attribute.value_offset()) + u64::from(attribute.position().offset);
    }
    sum += u64::from(node.f64("s").is_ok()) + u64::from(node.i64("id").is_ok_and(|id| id > 0));
    sum += (node.children().count() + node.ancestors().count()) as u64;
    sum += node.descendants().take(SOME).count() as u64;
    sum += (node.descendants_named("lane").count() + node.children_named("lane").count()) as u64;
    sum += u64::from(node.next_sibling().is_some())
        + node.document().elements(node.name()).count() as u64;
    sum
}

/// Maximum number of items that a walk takes from a long sequence.
const SOME: usize = 100;

/// Checks the guarantees of every valid image.
///
/// # Panics
/// If a guarantee does not hold.
pub fn check_promises(document: Document<'_>) {
    let elements: Vec<Node<'_>> = document.root().map_or(Vec::new(), |root| {
        std::iter::once(root).chain(root.descendants()).collect()
    });
    let mut paths = XPaths::new(document);
    for &node in elements.iter().take(SOME) {
        assert!(!node.name().is_empty(), "every element must have a name");
        assert_eq!(paths.xpath(node), node.xpath());
        assert_eq!(paths.positional_xpath(node), node.positional_xpath());
        assert!(
            document.elements(node.name()).any(|posted| posted == node),
            "{node:?} must be in the postings"
        );
        assert!(
            node.children().all(|child| child.parent() == Some(node)),
            "every child of {node:?} must have it as its parent"
        );
        let siblings = node.parent().map_or(1, |parent| {
            parent
                .children()
                .filter(|other| other.is(node.name()))
                .count()
        });
        assert!(siblings >= 1, "{node:?} must be a child of its parent");
    }
    for name in elements
        .iter()
        .map(Node::name)
        .chain(["nothing"])
        .take(SOME)
    {
        let walked = elements.iter().copied().filter(|node| node.is(name));
        assert!(
            document.elements(name).eq(walked),
            "the postings of {name} must match a walk of the tree"
        );
    }
    for source in document.sources() {
        let end = document.position(source.start + source.len);
        assert_eq!(
            end.row as usize,
            document.source_text(&source).matches('\n').count() + 1
        );
    }
}

/// Builds an image from any order of events, as a fuzz body. The events are rejected, or the image
/// can be opened. It is valid if no range cuts a character.
pub fn build_image(data: &[u8]) -> Result<Vec<u8>, BuildError> {
    let mut script = data.iter().copied();
    let mut next = || script.next().map_or(0, usize::from);
    let capacities = Capacities {
        text: next(),
        nodes: next() % 32,
        attributes: next() % 32,
        names: next() % 16,
        heap: next() * 2,
        sources: next() % 4,
        faults: next() % 4,
    };
    let mut out = vec![0xA5; capacities.image_len() + next() % 3];
    let mut builder = ImageBuilder::new(&mut out, &capacities)?;
    for _ in 0..64 {
        // An invalid event is rejected and must not change the rest.
        let _ = one_event(&mut builder, &mut next);
    }
    let used = builder.finish([7; 32])?;
    assert!(
        used <= capacities.image_len(),
        "the image must not exceed its computed bound"
    );
    out.truncate(used);
    let judged = Document::open(&out).and_then(|document| document.validate());
    assert_eq!(judged, Ok(()), "the built image must be valid");
    assert_eq!(read_image(&out), Outcome::Sound);
    Ok(out)
}

fn one_event(
    builder: &mut ImageBuilder<'_>,
    next: &mut impl FnMut() -> usize,
) -> Result<(), BuildError> {
    const NAMES: [&str; 6] = ["road", "od:lane", "id", "s", "xsi:type", "straße"];
    let name = NAMES[next() % NAMES.len()];
    let (start, len) = (next() as u32, next() as u32 % 32);
    let value = Some("a&b").filter(|_| next().is_multiple_of(2));
    match next() % 8 {
        0 => builder
            .source("maps/a.xodr", &"<road id='1'/>\n".repeat(next() % 4))
            .map(drop),
        1 | 2 => builder.open_element(name, start),
        3 | 4 => builder.attribute(name, start, start + 4, len, value),
        5 => builder.text(start, start + len, value),
        6 => builder.close_element(start),
        _ if next().is_multiple_of(2) => builder.cdata(start, start + len, value),
        _ => builder.fault(FaultCode::Unclosed, start, "the road ends too early"),
    }
}
