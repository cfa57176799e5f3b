use crate::families::written_numbers::{Measure, Written, is_suspicious, shown};
use crate::prelude::*;
use foldhash::HashSet;
use qcbus_document::Attribute;

const MOST: Param = Param::number(
    "most",
    1e9,
    "m",
    "largest position, size or angle that can be used in computations",
);
const EARTH: Param = Param::number(
    "earth",
    1e8,
    "m",
    "positions and sizes beyond this exceed the circumference of the Earth",
);
const COEFFICIENT: Param = Param::number(
    "coefficient",
    1e30,
    "",
    "largest coefficient of first or higher degree that can be used in computations",
);

pub const RULE: Rule<Roads> = Rule {
    params: &[MOST, EARTH, COEFFICIENT],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(root) = map.root() else {
        return;
    };
    let attributes = std::iter::once(root)
        .chain(root.descendants())
        .flat_map(|node| node.attributes());
    let mut measured = Measured::default();
    let mut odd: Vec<Odd<'_>> = attributes
        .filter(|attribute| measured.has(*attribute) && is_suspicious(attribute.value_bytes()))
        .filter_map(|attribute| Odd::of(attribute, attribute.value(), found))
        .collect();
    odd.extend(of_grids(map, found));
    if found.version() == Some(Version::new(1, 6)) {
        odd.extend(of_texts(root));
    }
    if odd.is_empty() {
        return;
    }
    // The schema reports the values that it rejects. Its evaluation is slow, so it runs on demand.
    let document = found.subject().root();
    let refused: HashSet<u32> = qcbus_schema_rule::breaches(found.subject(), &document)
        .iter()
        .filter_map(|breach| Some(breach.attribute?.offset()))
        .collect();
    for one in odd {
        if !refused.contains(&one.attribute.offset()) {
            found.issue(one.attribute, one.text).level(one.level);
        }
    }
}

/// Cache by name number: whether an attribute name stands for numbers. Each is looked up once.
#[derive(Default)]
struct Measured(Vec<Option<bool>>);

impl Measured {
    fn has(&mut self, attribute: Attribute<'_>) -> bool {
        let place = usize::from(attribute.name_number());
        if self.0.len() <= place {
            self.0.resize(place + 1, None);
        }
        let known = self.0.get_mut(place);
        known.is_some_and(|known| {
            *known.get_or_insert_with(|| Measure::is_of_some(attribute.name()))
        })
    }
}

/// A number that cannot be used in computations.
struct Odd<'a> {
    attribute: Attribute<'a>,
    level: Level,
    text: String,
}

impl<'a> Odd<'a> {
    /// Checks a text that stands for a number, or for one of several numbers, in an attribute.
    fn of(attribute: Attribute<'a>, text: &str, found: &Sink<'_>) -> Option<Odd<'a>> {
        let written = Written::read(text)?;
        // Long ids reach this place as well, and the lookup of the quantity is slow.
        let least = found.number(&MOST).min(found.number(&EARTH));
        if matches!(written, Written::Finite(value) if value.abs() <= least.min(found.number(&COEFFICIENT)))
        {
            return None;
        }
        let node = attribute.node();
        // `header_offset_plausible` checks the size of the map offset.
        if node.is("offset") && matches!(written, Written::Finite(_)) {
            return None;
        }
        let measure = Measure::of(node.name(), attribute.name())?;
        let (level, why) = judge(written, measure, found)?;
        if is_user_data(node) {
            return None;
        }
        let text = format!(
            "`{}` of `<{}>` is `{}`, {why}",
            attribute.name(),
            node.name(),
            shown(text)
        );
        Some(Odd {
            attribute,
            level,
            text,
        })
    }
}

/// Lengths and widths that are texts in the schema of 1.6.
const TEXTS: [(&str, &[&str]); 4] = [
    ("road", &["length"]),
    ("geometry", &["length"]),
    ("line", &["length", "width"]),
    ("marking", &["width", "lineLength"]),
];

/// Returns the values of these attributes that are not numbers. All other schemas reject them.
fn of_texts<'a>(root: Node<'a>) -> impl Iterator<Item = Odd<'a>> {
    let elements = TEXTS.into_iter().flat_map(move |(element, names)| {
        let nodes = root.descendants_named(element);
        nodes.flat_map(move |node| names.iter().filter_map(move |name| node.attribute(name)))
    });
    elements.filter_map(|attribute| {
        let text = attribute.value().trim();
        let is_number = text.parse::<f64>().is_ok() || Written::read(text).is_some();
        if is_number || is_user_data(attribute.node()) {
            return None;
        }
        Some(Odd {
            attribute,
            level: Level::Error,
            text: format!(
                "`{}` of `<{}>` is `{}`, which is not a number; it must be a number in metres, with a point as \
                 the decimal separator",
                attribute.name(),
                attribute.node().name(),
                shown(text)
            ),
        })
    })
}

/// Checks the heights of elevation grids. One attribute contains many heights.
fn of_grids<'a>(map: &RoadMap<'a>, found: &Sink<'_>) -> Vec<Odd<'a>> {
    let mut odd = Vec::new();
    let Some(root) = map.root() else {
        return odd;
    };
    let rows = root
        .descendants_named("elevationGrid")
        .flat_map(|grid| grid.children().filter(|child| child.is("elevation")));
    for attribute in rows.flat_map(|row| row.attributes()) {
        let mut heights = attribute.value().split_ascii_whitespace();
        let is_list = ["center", "left", "right"].contains(&attribute.name());
        // A single height is checked with all other attributes, if its name is in their list.
        let known = Measure::of("elevation", attribute.name()).is_some();
        if !is_list || (known && heights.clone().nth(1).is_none()) {
            continue;
        }
        odd.extend(heights.find_map(|text| {
            let (level, why) = judge(Written::read(text)?, Measure::Extent, found)?;
            let text = format!(
                "a height in `{}` is `{}`, {why}",
                attribute.name(),
                shown(text)
            );
            Some(Odd {
                attribute,
                level,
                text,
            })
        }));
    }
    odd
}

/// Returns the severity and the reason, or `None` if the number can be used in computations.
fn judge(written: Written, measure: Measure, found: &Sink<'_>) -> Option<(Level, String)> {
    let value = match written {
        Written::Nan => {
            let why = "which is not a number; it must be a finite number";
            return Some((Level::Error, why.to_owned()));
        }
        // Infinity is as good as the words for "no limit" if a reader understands it.
        Written::Infinite if measure == Measure::Speed => {
            let why = "which is infinite; if there is no limit, use `no limit`";
            return Some((Level::Warning, why.to_owned()));
        }
        Written::Infinite => {
            let why = "which is infinite; it must be a finite number";
            return Some((Level::Error, why.to_owned()));
        }
        Written::Overflow => {
            let why = "which exceeds the range of double precision (about 1.8e308) and is read as infinite; it \
                       must be a finite number";
            return Some((Level::Error, why.to_owned()));
        }
        Written::Finite(value) => value.abs(),
    };
    let (most, level) = match measure {
        Measure::Extent => match (found.number(&MOST), found.number(&EARTH)) {
            (most, _) if value > most => (most, Level::Error),
            (_, earth) if value > earth => (earth, Level::Warning),
            _ => return None,
        },
        Measure::Turn => (found.number(&MOST), Level::Error),
        Measure::Coefficient => (found.number(&COEFFICIENT), Level::Error),
        Measure::Speed | Measure::Other => return None,
    };
    let why = match level {
        Level::Error => "which cannot be used in geometric computations",
        _ => "which exceeds the circumference of the Earth",
    };
    (value > most).then(|| (level, format!("{why}; at most {most:e} is accepted here")))
}
