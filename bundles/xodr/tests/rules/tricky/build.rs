//! Builders of map fragments.

/// Returns a file of version 1.`minor`.
pub(crate) fn file(minor: &str, map: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n\
         <header revMajor=\"1\" revMinor=\"{minor}\"/>\n{map}</OpenDRIVE>\n"
    )
}

/// Constant width from the start of the section.
pub(crate) const WIDTH: &str = r#"<width sOffset="0" a="3.5" b="0" c="0" d="0"/>"#;

/// Returns a driving lane with predecessors and successors in `links`: `p-1 s-1 s-2`.
pub(crate) fn lane(id: &str, links: &str) -> String {
    lane_with(id, links, WIDTH)
}

/// Returns the same lane with other records.
pub(crate) fn lane_with(id: &str, links: &str, records: &str) -> String {
    let link = |word: &str| match word.split_at(1) {
        ("p", to) => format!(r#"<predecessor id="{to}"/>"#),
        (_, to) => format!(r#"<successor id="{to}"/>"#),
    };
    let links: String = links.split_whitespace().map(link).collect();
    let links = match links.as_str() {
        "" => links,
        _ => format!("<link>{links}</link>"),
    };
    format!(r#"<lane id="{id}" type="driving" level="false">{links}{records}</lane>"#)
}

pub(crate) const CENTER: &str = r#"<lane id="0" type="none" level="false"/>"#;

/// Returns a lane section with left and right lanes. `s` may contain further attributes.
pub(crate) fn section(s: &str, left: &str, right: &str) -> String {
    let group = |name: &str, lanes: &str| match lanes {
        "" => String::new(),
        _ => format!("<{name}>{lanes}</{name}>"),
    };
    format!(
        "<laneSection s={s}>{}<center>{CENTER}</center>{}</laneSection>\n",
        group("left", left),
        group("right", right)
    )
}

/// Returns a geometry. `shape` is a whole element.
pub(crate) fn geometry(s: &str, x: &str, y: &str, hdg: &str, length: &str, shape: &str) -> String {
    format!(
        "<geometry s=\"{s}\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\">{shape}</geometry>\n"
    )
}

pub(crate) const LINE: &str = "<line/>";
pub(crate) const PI: &str = "3.141592653589793";

/// A road of 100 m from `pose` = x, y, hdg.
pub(crate) struct Road<'a> {
    pub id: &'a str,
    pub pose: [&'a str; 3],
    pub length: &'a str,
    pub junction: &'a str,
    pub rule: &'a str,
    pub link: &'a str,
    /// Elements between the plan view and the lanes.
    pub profiles: &'a str,
    pub lanes: &'a str,
    pub tail: &'a str,
}

impl Default for Road<'_> {
    fn default() -> Self {
        Road {
            id: "1",
            pose: ["0", "0", "0"],
            length: "100",
            junction: "-1",
            rule: "RHT",
            link: "",
            profiles: "",
            lanes: "",
            tail: "",
        }
    }
}

impl Road<'_> {
    pub(crate) fn text(&self) -> String {
        let [x, y, hdg] = self.pose;
        self.with_plan_view(&geometry("0", x, y, hdg, self.length, LINE))
    }

    pub(crate) fn with_plan_view(&self, geometries: &str) -> String {
        let own;
        let lanes = if self.lanes.is_empty() {
            own = section("\"0\"", "", &lane("-1", ""));
            &own
        } else {
            self.lanes
        };
        format!(
            "<road name=\"\" id=\"{}\" length=\"{}\" junction=\"{}\" rule=\"{}\">\n{}\n<planView>\n{geometries}</planView>\n{}\n\
             <lanes>\n{lanes}</lanes>\n{}</road>\n",
            self.id, self.length, self.junction, self.rule, self.link, self.profiles, self.tail
        )
    }
}

/// Returns a `<link>`: `p2 end` for the end of road 2 as predecessor, `sJ 7` for junction 7 as
/// successor.
pub(crate) fn link(parts: &[&str]) -> String {
    let one = |part: &&str| {
        let (name, rest) = match part.split_at(1) {
            ("p", rest) => ("predecessor", rest),
            (_, rest) => ("successor", rest),
        };
        let (id, contact) = rest.split_once(' ').unwrap();
        match id {
            "J" => format!(r#"<{name} elementType="junction" elementId="{contact}"/>"#),
            _ => {
                format!(r#"<{name} elementType="road" elementId="{id}" contactPoint="{contact}"/>"#)
            }
        }
    };
    format!("<link>{}</link>", parts.iter().map(one).collect::<String>())
}
