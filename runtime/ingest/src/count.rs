//! Computes an upper bound of an image in one quick pass over the bytes, before they are parsed.

use qcbus_document::Capacities;

/// Heap reserved for each `&` of a text: the value around it and its record.
const HEAP_PER_REFERENCE: usize = 64;
/// Heap for all other values that must be resolved. Values with line ends are rare.
const SPARE_HEAP: usize = 4096;
/// Runs of character data that end in white space. The quick pass does not detect them.
const SPARE_RUNS: usize = 256;

/// Returns the maximum content of a text. If unusually many or long values must be resolved, the
/// builder runs out of room. The exact count is then taken.
pub(crate) fn quick(text: &str) -> Capacities {
    let marks = Marks::of(text.as_bytes());
    let elements = marks.openings.saturating_sub(marks.others);
    let nodes = elements + marks.runs + SPARE_RUNS;
    Capacities {
        text: text.len(),
        nodes,
        attributes: marks.equals,
        names: (elements + marks.equals).min(Capacities::MAX_NAMES),
        heap: marks.ampersands.saturating_mul(HEAP_PER_REFERENCE) + text.len() / 64 + SPARE_HEAP,
        sources: 0,
        faults: 0,
    }
}

/// Counts of bytes and of pairs of bytes.
#[derive(Default, Debug, PartialEq, Eq)]
struct Marks {
    /// `<`
    openings: usize,
    /// `</`, `<!`, `<?`
    others: usize,
    /// `<` directly after a byte that is neither white space nor `>`, and `<!`.
    runs: usize,
    equals: usize,
    ampersands: usize,
}

impl Marks {
    fn of(bytes: &[u8]) -> Marks {
        // Lanes of single bytes, summed before they overflow, compile to vector code.
        const LANES: usize = 32;
        let mut marks = Marks::default();
        let Some(&first) = bytes.first() else {
            return marks;
        };
        marks.add(b'>', first);
        let (before, here) = (&bytes[..bytes.len() - 1], &bytes[1..]);
        for (before, here) in before.chunks(LANES * 255).zip(here.chunks(LANES * 255)) {
            let mut lanes = [[0u8; LANES]; 5];
            let (before, here) = (before.chunks_exact(LANES), here.chunks_exact(LANES));
            let rest = before.remainder().iter().zip(here.remainder());
            for (before, here) in before.zip(here) {
                for lane in 0..LANES {
                    let counted = count(before[lane], here[lane]);
                    for (kind, &one) in counted.iter().enumerate() {
                        lanes[kind][lane] += one;
                    }
                }
            }
            let sums =
                lanes.map(|lanes| lanes.iter().map(|&lane| usize::from(lane)).sum::<usize>());
            marks.add_all(sums);
            rest.for_each(|(&before, &here)| marks.add(before, here));
        }
        marks
    }

    fn add(&mut self, before: u8, here: u8) {
        self.add_all(count(before, here).map(usize::from));
    }

    fn add_all(&mut self, [openings, others, runs, equals, ampersands]: [usize; 5]) {
        self.openings += openings;
        self.others += others;
        self.runs += runs;
        self.equals += equals;
        self.ampersands += ampersands;
    }
}

/// Returns the counts for the byte `here` after the byte `before`.
#[inline]
fn count(before: u8, here: u8) -> [u8; 5] {
    let opening = here == b'<';
    let bang = (before == b'<') & (here == b'!');
    let other = (before == b'<') & ((here == b'/') | (here == b'!') | (here == b'?'));
    let run = opening & (before > b' ') & (before != b'>');
    [
        u8::from(opening),
        u8::from(other),
        u8::from(run | bang),
        u8::from(here == b'='),
        u8::from(here == b'&'),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_bound_covers_the_actual_content() {
        let text = "<?xml version='1.0'?><a b='1' c='2'>x<d/> y &amp;\n<!-- --><![CDATA[z]]></a>";
        let marks = Marks::of(text.as_bytes());
        assert_eq!(
            marks,
            Marks {
                openings: 6,
                others: 4,
                runs: 3,
                equals: 3,
                ampersands: 1
            }
        );
        let long = text.repeat(1000);
        assert_eq!(Marks::of(long.as_bytes()).openings, 6000);
        assert_eq!(Marks::of(long.as_bytes()).equals, 3000);
        assert_eq!(quick("").nodes, SPARE_RUNS);
    }
}
