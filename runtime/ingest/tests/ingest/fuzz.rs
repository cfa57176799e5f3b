//! The bodies of the fuzz targets on seeded input: real syntax, then damaged.

use proptest::prelude::*;

use crate::fuzzing;

const SEEDS: [&str; 4] = [
    "<?xml version='1.0' encoding='UTF-8'?><OpenDRIVE><header revMajor='1'/><road id='1'>\
     <include file='x.xml'/><planView/></road></OpenDRIVE>",
    "<a xmlns:p='u' p:q='&lt;&#65;'>text &amp; <![CDATA[<x>]]><!-- c --><?pi x?></a>",
    "<?xml version=\"1.0\" encoding=\"ISO-8859-15\"?><a b=\"\u{e4}\r\n\"/>",
    "<OpenSCENARIO><ParameterDeclarations><ParameterDeclaration name='m' value='x.xodr'/>\
     </ParameterDeclarations><RoadNetwork><LogicFile filepath='$m'/></RoadNetwork></OpenSCENARIO>",
];
const PIECES: [&str; 18] = [
    "<",
    ">",
    "/>",
    "</a>",
    "<a>",
    "<a ",
    "b='",
    "\"",
    "&",
    "&amp;",
    "<![CDATA[",
    "]]>",
    "<!--",
    "-->",
    "<?xml ",
    "?>",
    "<!DOCTYPE a [",
    "\u{0}",
];

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 1500,
        rng_seed: prop::test_runner::RngSeed::Fixed(20_240),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_documents(
        seed in 0..SEEDS.len(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 0..12),
    ) {
        let mut bytes = SEEDS[seed].as_bytes().to_vec();
        for (at, byte, kind) in edits {
            if bytes.is_empty() { break; }
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, byte),
                _ => bytes.truncate(at.max(1)),
            }
        }
        fuzzing::ingest(&bytes);
    }

    #[test]
    fn shuffled_markup(pieces in prop::collection::vec(0..PIECES.len(), 0..40)) {
        let text: String = pieces.into_iter().map(|piece| PIECES[piece]).collect();
        fuzzing::ingest(text.as_bytes());
        fuzzing::ingest(format!("<a>{text}</a>").as_bytes());
    }

    #[test]
    fn bytes_of_every_sort(head in 0..6usize, bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let heads: [&[u8]; 6] = [b"", b"\x1f\x8b\x08\x00", b"PK\x03\x04", b"\xff\xfe<\0", b"\xfe\xff\0<", b"\xef\xbb\xbf<"];
        fuzzing::ingest(&[heads[head], &bytes].concat());
    }
}
