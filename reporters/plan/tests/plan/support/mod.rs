//! Maps made from text, and a decoder of their plans that is based only on `docs/html-report.md`.

#![expect(clippy::expect_used, clippy::panic, reason = "test helpers may panic")]

use std::path::Path;

use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_opendrive::RoadMap;
use qcbus_plan::Plan;

/// Runs `test` on the map that these elements form within a complete file.
pub fn with_map<T>(elements: &str, test: impl FnOnce(&RoadMap<'_>) -> T) -> T {
    let xml = format!("<OpenDRIVE><header revMajor=\"1\" revMinor=\"8\"/>{elements}</OpenDRIVE>");
    with_bytes(xml.into_bytes(), test)
}

/// Runs `test` on the map of a file.
pub fn with_bytes<T>(bytes: Vec<u8>, test: impl FnOnce(&RoadMap<'_>) -> T) -> T {
    let prepared = prepare_bytes(Path::new("map.xodr"), bytes, &Limits::default());
    let image = prepared.build();
    let document = Document::open(&image).expect("the image is valid");
    test(&RoadMap::new(document))
}

/// Returns the decoded plan of the map that these elements form.
pub fn plan(elements: &str) -> Decoded {
    with_map(elements, |map| {
        let plan = Plan::of(map);
        let decoded = decode(&plan.bytes());
        assert_eq!(decoded.cuts, plan.cuts());
        decoded
    })
}

/// Returns a road with these geometries and sections.
pub fn road(id: &str, more: &str, length: f64, geometries: &str, lanes: &str) -> String {
    format!(
        "<road id='{id}' length='{length}' {more}><planView>{geometries}</planView>\
         <lanes>{lanes}</lanes></road>"
    )
}

/// Returns a straight geometry.
pub fn line(s: f64, x: f64, y: f64, hdg: f64, length: f64) -> String {
    format!("<geometry s='{s}' x='{x}' y='{y}' hdg='{hdg}' length='{length}'><line/></geometry>")
}

/// A section with one lane on each side, 3.5 and 3 m wide.
pub const TWO_LANES: &str = "<laneSection s='0'>\
    <left><lane id='1' type='driving'><width sOffset='0' a='3.5' b='0' c='0' d='0'/></lane></left>\
    <center><lane id='0' type='none'/></center>\
    <right><lane id='-1' type='driving'><width sOffset='0' a='3' b='0' c='0' d='0'/></lane></right>\
    </laneSection>";

#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    pub x: i64,
    pub y: i64,
    pub level: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    pub first: usize,
    pub points: usize,
    pub kind: String,
    pub color: String,
    pub width: u64,
}

#[derive(Debug, Clone)]
pub struct Border {
    pub points: Vec<Point>,
    pub marks: Vec<Mark>,
}

impl Border {
    /// Returns the points without their levels.
    pub fn places(&self) -> Vec<[i64; 2]> {
        self.points.iter().map(|point| [point.x, point.y]).collect()
    }
}

#[derive(Debug, Clone)]
pub struct DrawnLane {
    pub id: i64,
    pub kind: String,
    pub border: Border,
    pub widths: Vec<[u64; 2]>,
}

#[derive(Debug, Clone)]
pub struct Section {
    pub s: [u64; 2],
    pub center: Border,
    pub left: Vec<DrawnLane>,
    pub right: Vec<DrawnLane>,
}

#[derive(Debug, Clone)]
pub struct Road {
    pub id: String,
    pub name: String,
    pub junction: u64,
    pub flags: u64,
    pub length: u64,
    pub line: Vec<(Point, u64)>,
    pub elevation: Vec<(u64, i64)>,
    pub links: [(u64, String); 2],
    pub sections: Vec<Section>,
}

#[derive(Debug)]
pub struct Junction {
    pub id: String,
    pub name: String,
    pub kind: String,
    pub outline: Vec<[i64; 2]>,
    pub connections: Vec<(u64, u64)>,
}

#[derive(Debug)]
pub struct Signal {
    pub names: [String; 4],
    #[expect(dead_code, reason = "the decoder reads whole records")]
    pub road: usize,
    pub s: u64,
    pub t: i64,
    pub at: [i64; 2],
    pub heading: i64,
    pub flags: u64,
}

#[derive(Debug)]
pub struct Object {
    pub names: [String; 3],
    pub road: usize,
    pub s: u64,
    pub t: i64,
    pub outline: Vec<[i64; 2]>,
}

#[derive(Debug)]
pub struct Decoded {
    pub origin: [f64; 2],
    pub roads: Vec<Road>,
    pub junctions: Vec<Junction>,
    pub signals: Vec<Signal>,
    pub objects: Vec<Object>,
    pub cuts: Vec<String>,
}

struct Reader<'b> {
    rest: &'b [u8],
    strings: Vec<String>,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self
            .rest
            .split_first_chunk()
            .expect("enough bytes are left");
        self.rest = rest;
        *head
    }

    fn u(&mut self) -> u64 {
        let mut value = 0;
        for shift in (0..56).step_by(7) {
            let [byte] = self.take();
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                assert!(value < 1 << 53, "{value} exceeds 53 bits");
                return value;
            }
        }
        panic!("a number is too long");
    }

    fn z(&mut self) -> i64 {
        let value = self.u();
        (value >> 1) as i64 ^ -((value & 1) as i64)
    }

    fn f(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    fn s(&mut self) -> String {
        let number = self.u() as usize;
        self.strings[number].clone()
    }

    fn list<T>(&mut self, mut each: impl FnMut(&mut Self) -> T) -> Vec<T> {
        (0..self.u()).map(|_| each(self)).collect()
    }

    fn string(&mut self) -> String {
        let len = self.u() as usize;
        let (text, rest) = self.rest.split_at(len);
        self.rest = rest;
        String::from_utf8(text.to_vec()).expect("the string is valid UTF-8")
    }

    fn outline(&mut self) -> Vec<[i64; 2]> {
        let mut at = [0; 2];
        self.list(|bytes| {
            at = [at[0] + bytes.z(), at[1] + bytes.z()];
            at
        })
    }

    fn points<T>(&mut self, mut more: impl FnMut(&mut Self, [i64; 2]) -> T) -> Vec<T> {
        let mut at = [0; 2];
        self.list(|bytes| {
            at = [at[0] + bytes.z(), at[1] + bytes.z()];
            more(bytes, at)
        })
    }

    fn border(&mut self) -> Border {
        let points = self.points(|bytes, [x, y]| Point {
            x,
            y,
            level: bytes.u(),
        });
        let marks = self.list(|bytes| Mark {
            first: bytes.u() as usize,
            points: bytes.u() as usize,
            kind: bytes.s(),
            color: bytes.s(),
            width: bytes.u(),
        });
        Border { points, marks }
    }

    fn lane(&mut self) -> DrawnLane {
        let (id, kind, border) = (self.z(), self.s(), self.border());
        let mut ds = 0;
        let widths = self.list(|bytes| {
            ds += bytes.u();
            [ds, bytes.u()]
        });
        DrawnLane {
            id,
            kind,
            border,
            widths,
        }
    }

    fn road(&mut self) -> Road {
        let (id, name, junction) = (self.s(), self.s(), self.u());
        let (flags, length) = (self.u(), self.u());
        let mut s = 0;
        let line = self.points(|bytes, [x, y]| {
            s += bytes.u();
            let level = bytes.u();
            (Point { x, y, level }, s)
        });
        let mut at = (0, 0);
        let elevation = self.list(|bytes| {
            at = (at.0 + bytes.u(), at.1 + bytes.z());
            at
        });
        let links = [(self.u(), self.s()), (self.u(), self.s())];
        let sections = self.list(|bytes| Section {
            s: [bytes.u(), bytes.u()],
            center: bytes.border(),
            left: bytes.list(Reader::lane),
            right: bytes.list(Reader::lane),
        });
        Road {
            id,
            name,
            junction,
            flags,
            length,
            line,
            elevation,
            links,
            sections,
        }
    }
}

/// Decodes a plan to its last byte.
pub fn decode(bytes: &[u8]) -> Decoded {
    let mut reader = Reader {
        rest: bytes,
        strings: Vec::new(),
    };
    assert_eq!(&reader.take::<4>(), b"QCPL");
    assert_eq!(reader.u(), 1);
    let origin = [reader.f(), reader.f()];
    reader.strings = reader.list(Reader::string);
    let decoded = Decoded {
        origin,
        roads: reader.list(Reader::road),
        junctions: reader.list(|bytes| Junction {
            id: bytes.s(),
            name: bytes.s(),
            kind: bytes.s(),
            outline: bytes.outline(),
            connections: bytes.list(|bytes| (bytes.u(), bytes.u())),
        }),
        signals: reader.list(|bytes| Signal {
            names: [bytes.s(), bytes.s(), bytes.s(), bytes.s()],
            road: bytes.u() as usize,
            s: bytes.u(),
            t: bytes.z(),
            at: [bytes.z(), bytes.z()],
            heading: bytes.z(),
            flags: bytes.u(),
        }),
        objects: reader.list(|bytes| Object {
            names: [bytes.s(), bytes.s(), bytes.s()],
            road: bytes.u() as usize,
            s: bytes.u(),
            t: bytes.z(),
            outline: bytes.outline(),
        }),
        cuts: reader.list(Reader::s),
    };
    assert!(
        reader.rest.is_empty(),
        "no byte may be left, found {}",
        reader.rest.len()
    );
    decoded
}
