//! Findings about one fault are one issue, unless `--all` or `--strict` asks for each of them.

use qcbus_formats::xqar::{Level, Results};

use crate::support::cli::{Cli, issues};
use crate::timeline;

/// Returns a road of 50 m along x with one driving lane on each side.
fn road(id: u32, (x, y): (f64, f64), link: &str) -> String {
    let lane = |id: i32, name: &str, back: bool| {
        let ends = match back {
            true => format!("<link><predecessor id=\"{id}\"/></link>"),
            false => format!("<link><successor id=\"{id}\"/></link>"),
        };
        format!(
            "<{name}><lane id=\"{id}\" type=\"driving\" level=\"false\">{ends}\n\
             <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></{name}>\n"
        )
    };
    let back = link.starts_with("<predecessor");
    format!(
        "<road name=\"quay {id}\" id=\"{id}\" length=\"50\" junction=\"-1\" rule=\"RHT\">\n\
         <link>{link}</link>\n\
         <planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"0\" length=\"50\"><line/></geometry></planView>\n\
         <lanes><laneSection s=\"0\">\n{}<center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\n{}\
         </laneSection></lanes>\n</road>\n",
        lane(1, "left", back),
        lane(-1, "right", back)
    )
}

/// Returns a map of two linked roads, of which the second starts `aside` metres to the side.
fn map(aside: f64) -> String {
    let to = "<successor elementType=\"road\" elementId=\"2\" contactPoint=\"start\"/>";
    let from = "<predecessor elementType=\"road\" elementId=\"1\" contactPoint=\"end\"/>";
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n\
         <header revMajor=\"1\" revMinor=\"7\" name=\"two quays\" date=\"2026-03-02T08:00:00\" north=\"60\" south=\"-60\" \
         east=\"110\" west=\"0\" vendor=\"qcbus\"/>\n{}{}</OpenDRIVE>\n",
        road(1, (0.0, 0.0), to),
        road(2, (50.0, aside), from)
    )
}

fn levels(results: &Results) -> Vec<Level> {
    issues(results).map(|(_, issue)| issue.level).collect()
}

#[test]
fn roads_that_do_not_meet_are_one_error_with_the_lanes_below() {
    let cli = Cli::new();
    cli.write("map.xodr", map(20.0));
    let said = cli.qcbus(&["check", "map.xodr"]);
    assert_eq!(said.code, Some(1));
    let joined = cli.result("qcbus-out/map.xodr.xqar");
    assert_eq!(levels(&joined), [Level::Error], "{}", said.stdout);
    assert!(
        said.stdout
            .contains("= also: the start of road `2` lies 20.000 m away"),
        "{}",
        said.stdout
    );
    assert!(said.stdout.contains("1 error, 0 warnings"));

    for separately in ["--all", "--strict"] {
        let said = cli.qcbus(&["check", "map.xodr", separately]);
        assert_eq!(said.code, Some(1), "{separately}");
        let apart = cli.result("qcbus-out/map.xodr.xqar");
        assert!(levels(&apart).len() > 1, "{separately}: {}", said.stdout);
        let place = |text: &str| text.starts_with("also");
        let mut places = issues(&apart).flat_map(|(_, issue)| &issue.locations);
        assert!(places.all(|it| !place(&it.description)), "{separately}");
    }
}

#[test]
fn map_without_the_fault_has_no_finding() {
    let cli = Cli::new();
    cli.write("map.xodr", map(0.0));
    let said = cli.qcbus(&["check", "map.xodr"]);
    assert_eq!(said.code, Some(0), "{}", said.stdout);
    assert_eq!(levels(&cli.result("qcbus-out/map.xodr.xqar")), []);
}

#[test]
fn verbose_output_tells_every_joined_finding_in_full() {
    let cli = Cli::new();
    cli.write("map.xodr", map(20.0));
    let said = cli.qcbus(&["check", "map.xodr", "-v"]);
    let also = said.stdout.matches("= also: ").count();
    let places = issues(&cli.result("qcbus-out/map.xodr.xqar"))
        .flat_map(|(_, issue)| &issue.locations)
        .filter(|it| it.description.starts_with("also: "))
        .count();
    assert_eq!(also, places, "{}", said.stdout);
    assert!(places > 0);
}

/// The event waits for a time that is over when its act begins, and the stop trigger waits for the
/// event.
#[test]
fn run_without_end_is_told_with_the_event_that_never_starts() {
    let over = timeline::time("lessThan", 0.0);
    let events = timeline::event("brake", &over, &timeline::brake());
    let stop = format!(
        "<ConditionGroup><Condition name=\"braked\" delay=\"0\" conditionEdge=\"none\">{}</Condition></ConditionGroup>",
        timeline::complete("event", "brake")
    );
    let cli = timeline::cli(&timeline::scenario(&timeline::story(&events), &stop));
    let said = cli.qcbus(&["check", "a.xosc"]);
    assert_eq!(said.code, Some(1), "{}", said.stdout);
    let joined = cli.result("qcbus-out/a.xosc.xqar");
    let serious = issues(&joined).filter(|(_, it)| it.level < Level::Information);
    let texts: Vec<&str> = serious.map(|(_, it)| it.description.as_str()).collect();
    assert_eq!(texts.len(), 1, "{texts:?}");
    assert!(texts[0].contains("the run never ends"), "{texts:?}");
    let mut places = issues(&joined).flat_map(|(_, it)| &it.locations);
    let never = |text: &str| text.starts_with("also: ") && text.ends_with("[trigger.never_true]");
    assert!(places.any(|it| never(&it.description)), "{}", said.stdout);
}
