//! Templates for the short examples of the pages: minimal valid maps with a gap.
//!
//! | `in=` | the example is |
//! |---|---|
//! | (nothing) | everything after the header: `<road>`, `<junction>`, `<controller>`, … |
//! | `header` | the content of the header |
//! | `road` | everything after `<lanes>` in a straight road of 100 m: `<objects>`, `<signals>`, … |
//! | `roadHead` | everything before `<lanes>`: `<link>`, `<type>`, `<elevationProfile>`, … |
//! | `planView` | the content of `<planView>` in a road of 100 m with one lane to the right |
//! | `lanes` | the content of `<lanes>` in a straight road of 100 m |
//! | `laneSection` | the content of its only `<laneSection>` |
//! | `lane` | the content of its only driving lane, -1 |
//! | `object` | the content of an `<object>` in that road |
//! | `signal` | the content of a `<signal>` in that road |
//! | `junction` | the content of `<junction id="100">`, with the roads 1 (into it), 2 (within) and 3 (out of it) |

use qcbus_rule_tests::pages::Template;

macro_rules! map {
    ($($text:expr),*) => {
        concat!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n",
            "<header revMajor=\"{major}\" revMinor=\"{minor}\"/>\n",
            $($text,)*
            "</OpenDRIVE>\n"
        )
    };
}

macro_rules! road {
    ($($text:expr),*) => {
        map!("<road id=\"1\" length=\"100\" junction=\"-1\">\n", $($text,)* "</road>\n")
    };
}

macro_rules! lane_section {
    ($($text:expr),*) => {
        concat!("<lanes>\n<laneSection s=\"0\">\n", $($text,)* "</laneSection>\n</lanes>\n")
    };
}

macro_rules! right_lane {
    ($($text:expr),*) => {
        concat!(
            "<center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\n",
            "<right><lane id=\"-1\" type=\"driving\" level=\"false\">\n",
            $($text,)*
            "</lane></right>\n"
        )
    };
}

macro_rules! straight {
    () => {
        "<planView><geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"100\"><line/></geometry></planView>\n"
    };
}

macro_rules! width {
    () => {
        "<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>\n"
    };
}

macro_rules! short_road {
    ($head:expr, $x:expr) => {
        concat!(
            "<road ",
            $head,
            " length=\"50\">\n<planView><geometry s=\"0\" x=\"",
            $x,
            "\" y=\"0\" hdg=\"0\" length=\"50\"><line/></geometry></planView>\n",
            lane_section!(right_lane!(width!())),
            "</road>\n"
        )
    };
}

/// The templates. The first one is the default for examples that name no template.
pub const TEMPLATES: &[Template] = &[
    Template {
        name: "map",
        text: map!("{example}\n"),
    },
    Template {
        name: "header",
        text: concat!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n",
            "<header revMajor=\"{major}\" revMinor=\"{minor}\">\n{example}\n</header>\n</OpenDRIVE>\n"
        ),
    },
    Template {
        name: "road",
        text: road!(
            straight!(),
            lane_section!(right_lane!(width!())),
            "{example}\n"
        ),
    },
    Template {
        name: "roadHead",
        text: road!(
            "{example}\n",
            straight!(),
            lane_section!(right_lane!(width!()))
        ),
    },
    Template {
        name: "planView",
        text: road!(
            "<planView>\n{example}\n</planView>\n",
            lane_section!(right_lane!(width!()))
        ),
    },
    Template {
        name: "lanes",
        text: road!(straight!(), "<lanes>\n{example}\n</lanes>\n"),
    },
    Template {
        name: "laneSection",
        text: road!(straight!(), lane_section!("{example}\n")),
    },
    Template {
        name: "lane",
        text: road!(straight!(), lane_section!(right_lane!("{example}\n"))),
    },
    Template {
        name: "object",
        text: road!(
            straight!(),
            lane_section!(right_lane!(width!())),
            "<objects><object id=\"1\" s=\"50\" t=\"5\" zOffset=\"0\" orientation=\"none\">\n",
            "{example}\n</object></objects>\n"
        ),
    },
    Template {
        name: "signal",
        text: road!(
            straight!(),
            lane_section!(right_lane!(width!())),
            "<signals><signal id=\"1\" s=\"50\" t=\"-5\" zOffset=\"2\" orientation=\"+\" dynamic=\"no\" ",
            "country=\"OpenDRIVE\" type=\"274\" subtype=\"-1\">\n{example}\n</signal></signals>\n"
        ),
    },
    Template {
        name: "junction",
        text: map!(
            short_road!("id=\"1\" junction=\"-1\"", "0"),
            short_road!("id=\"2\" junction=\"100\"", "50"),
            short_road!("id=\"3\" junction=\"-1\"", "100"),
            "<junction id=\"100\">\n{example}\n</junction>\n"
        ),
    },
];
