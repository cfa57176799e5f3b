//! Maps of any size, about as dense as exported city maps, without faults.

use std::fmt::Write;

/// Creates an OpenDRIVE map of about `bytes` bytes, with at least one road. `number` makes it
/// different from others.
pub fn map(bytes: usize, number: u64) -> String {
    let mut text = String::with_capacity(bytes + 8192);
    let _ = writeln!(
        text,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n    <header revMajor=\"1\" \
         revMinor=\"7\" name=\"generated {number}\" version=\"1\" date=\"2026-03-02T08:00:00\" \
         north=\"2800\" south=\"-2800\" east=\"6800\" west=\"-6800\" vendor=\"qcbus\"/>"
    );
    let mut id = 0;
    loop {
        id += 1;
        road(&mut text, id);
        if text.len() + 20 >= bytes {
            break;
        }
    }
    text.push_str("</OpenDRIVE>\n");
    text
}

/// Number of parts of the reference line, and the length of each in metres.
const PARTS: u32 = 8;
const PART: f64 = 12.345_678_9;
/// Angle in radians by which each part turns left of the previous one. The parts form a bend,
/// because a straight line could be written as one part.
const BEND: f64 = 0.01;
/// Number of roads in a row of the grid around the origin, and the size of a cell in metres.
const COLUMNS: u32 = 100;
const CELL: [f64; 2] = [131.415_926_535, 53.141_592_653];

fn road(text: &mut String, id: u32) {
    let column = f64::from(id % COLUMNS) - f64::from(COLUMNS) / 2.0;
    let row = f64::from(id / COLUMNS % COLUMNS) - f64::from(COLUMNS) / 2.0;
    let (mut x, mut y) = (column * CELL[0], row * CELL[1]);
    let length = f64::from(PARTS) * PART;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "    <road name=\"Road {id}\" length=\"{length:.16e}\" id=\"{id}\" junction=\"-1\">\n        <planView>"
    );
    for part in 0..PARTS {
        let (s, heading) = (f64::from(part) * PART, f64::from(part) * BEND);
        let _ = writeln!(
            text,
            "            <geometry s=\"{s:.16e}\" x=\"{x:.16e}\" y=\"{y:.16e}\" hdg=\"{heading:.16e}\" length=\"{PART:.16e}\">\n                <line/>\n            </geometry>"
        );
        x += PART * heading.cos();
        y += PART * heading.sin();
    }
    text.push_str(
        "        </planView>\n        <lanes>\n            <laneSection s=\"0\">\n                \
         <center>\n                    <lane id=\"0\" type=\"none\" level=\"false\"/>\n                \
         </center>\n                <right>\n",
    );
    for lane in 1..6 {
        let _ = writeln!(
            text,
            "                    <lane id=\"-{lane}\" type=\"driving\" level=\"false\">\n                        <width sOffset=\"0\" a=\"{:.16e}\" b=\"0\" c=\"0\" d=\"0\"/>\n                    </lane>",
            3.0 + x.fract().abs() / f64::from(lane)
        );
    }
    text.push_str(
        "                </right>\n            </laneSection>\n        </lanes>\n    </road>\n",
    );
}
