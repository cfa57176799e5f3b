use std::fs;
use std::time::{Duration, SystemTime};

use qcbus_bus::{Host, HostOptions, Instance};
use qcbus_messages::{DocumentRole, JobDocument};
use tempfile::TempDir;

use super::*;

const MAP: &[u8] = b"<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/></OpenDRIVE>";
/// Another map of the same length.
const OTHER: &[u8] = b"<OpenDRIVE><header revMajor=\"1\" revMinor=\"8\"/></OpenDRIVE>";

/// Directory with scenarios and maps, and the intake that reads them.
struct Farm {
    dir: TempDir,
    intake: Intake,
    jobs: AtomicU64,
    /// Serves the bus as long as it exists.
    _host: Mutex<Host>,
}

impl Farm {
    fn new() -> Farm {
        Farm::with(HostOptions::default())
    }

    fn with(options: HostOptions) -> Farm {
        let dir = tempfile::tempdir().unwrap();
        let host = Host::start(&Instance::at(dir.path().join("instance")), options).unwrap();
        let roots = vec![dir.path().to_path_buf()];
        Farm {
            intake: Intake::new(
                host.documents(),
                Limits::default(),
                roots,
                64,
                Box::new(|_| None),
            ),
            jobs: AtomicU64::new(0),
            _host: Mutex::new(host),
            dir,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path(name), bytes).unwrap();
    }

    fn scenario(&self, name: &str, map: &str) {
        let text = format!(
            "<OpenSCENARIO><RoadNetwork><LogicFile filepath=\"{map}\"/></RoadNetwork></OpenSCENARIO>"
        );
        self.put(name, text.as_bytes());
    }

    fn prepare(&self, name: &str, asked: Instant) -> PreparedJob {
        let job = JobId(self.jobs.fetch_add(1, Ordering::Relaxed));
        let path = self.path(name);
        let prepared = self.intake.prepare(job, &path, asked, Within::Watched);
        let prepared = prepared.unwrap();
        self.intake.release(job);
        *prepared
    }

    /// Returns the map of a scenario that is requested now.
    fn map_of(&self, scenario: &str) -> JobDocument {
        let prepared = self.prepare(scenario, Instant::now());
        assert_eq!(prepared.missing, []);
        prepared.documents[1].clone()
    }

    fn begun(&self, name: &str) -> Instant {
        self.intake.shared.begun(&self.path(name)).unwrap()
    }
}

#[tokio::test]
async fn scenarios_share_map_image_while_bytes_are_unchanged() {
    let farm = Farm::new();
    farm.put("town.xodr", MAP);
    farm.scenario("a.xosc", "town.xodr");
    farm.scenario("b.xosc", "./town.xodr");
    let (a, b) = (farm.map_of("a.xosc"), farm.map_of("b.xosc"));
    assert_eq!((a.doc, a.digest), (b.doc, b.digest));
    farm.put("town.xodr", MAP);
    assert_eq!(
        farm.map_of("a.xosc").doc,
        a.doc,
        "the same bytes were written again"
    );
}

#[tokio::test]
async fn map_changed_in_place_is_read_again() {
    let farm = Farm::new();
    farm.put("town.xodr", MAP);
    farm.scenario("a.xosc", "town.xodr");
    let before = farm.map_of("a.xosc");
    for (bytes, modified) in [
        (OTHER, None),
        (MAP, Some(SystemTime::now() - Duration::from_secs(3600))),
    ] {
        let file = fs::OpenOptions::new()
            .write(true)
            .open(farm.path("town.xodr"));
        let mut file = file.unwrap();
        std::io::Write::write_all(&mut file, bytes).unwrap();
        if let Some(modified) = modified {
            file.set_modified(modified).unwrap();
        }
        drop(file);
        let after = farm.map_of("a.xosc");
        assert_ne!(after.doc, before.doc);
        assert_eq!(after.digest == before.digest, bytes == MAP);
    }
}

#[tokio::test]
async fn replaced_map_of_equal_size_and_time_is_reread() {
    let farm = Farm::new();
    let long_ago = SystemTime::now() - Duration::from_secs(3600);
    let put_old = |name: &str, bytes: &[u8]| {
        farm.put(name, bytes);
        let file = fs::File::options().write(true).open(farm.path(name));
        file.unwrap().set_modified(long_ago).unwrap();
    };
    put_old("town.xodr", MAP);
    put_old("next", OTHER);
    farm.scenario("a.xosc", "town.xodr");
    let before = farm.map_of("a.xosc");
    fs::rename(farm.path("next"), farm.path("town.xodr")).unwrap();
    let after = farm.map_of("a.xosc");
    assert_ne!((after.doc, after.digest), (before.doc, before.digest));
}

#[tokio::test]
async fn equal_maps_at_two_paths_are_two_documents() {
    let farm = Farm::new();
    farm.put("one.xodr", MAP);
    farm.put("two.xodr", MAP);
    farm.scenario("a.xosc", "one.xodr");
    farm.scenario("b.xosc", "two.xodr");
    let (a, b) = (farm.map_of("a.xosc"), farm.map_of("b.xosc"));
    assert_eq!(a.digest, b.digest);
    assert_ne!(
        a.doc, b.doc,
        "equal bytes in different files are different documents"
    );
    assert!(a.path.ends_with("one.xodr") && b.path.ends_with("two.xodr"));
}

#[tokio::test]
async fn map_with_changed_include_is_new_document() {
    let farm = Farm::new();
    farm.put(
        "town.xodr",
        b"<OpenDRIVE><include file=\"part.xml\"/></OpenDRIVE>",
    );
    farm.put("part.xml", b"<OpenDRIVE><road id=\"1\"/></OpenDRIVE>");
    farm.scenario("a.xosc", "town.xodr");
    let before = farm.map_of("a.xosc");
    assert_eq!(farm.map_of("a.xosc").doc, before.doc);
    farm.put("part.xml", b"<OpenDRIVE><road id=\"2\"/></OpenDRIVE>");
    let after = farm.map_of("a.xosc");
    assert_eq!(
        after.digest, before.digest,
        "the digest covers only the map's own bytes"
    );
    assert_ne!(after.doc, before.doc);
}

/// The stamp of a young map proves nothing yet: a second write may leave it unchanged.
#[tokio::test]
async fn young_map_is_read_again_for_later_requests() {
    let farm = Farm::new();
    farm.put("town.xodr", MAP);
    farm.scenario("a.xosc", "town.xodr");
    let asked = Instant::now();
    assert!(farm.prepare("a.xosc", asked).racy);
    let first = farm.begun("town.xodr");
    assert!(first >= asked);
    let prepared = farm.prepare("a.xosc", asked);
    assert_eq!(
        farm.begun("town.xodr"),
        first,
        "not read again, because the request is older"
    );
    assert!(prepared.racy, "the reading is still too recent");
    farm.prepare("a.xosc", Instant::now());
    assert!(farm.begun("town.xodr") > first);
}

#[tokio::test]
async fn map_needed_concurrently_is_published_once() {
    let farm = Farm::new();
    farm.put("town.xodr", MAP);
    let asked = Instant::now();
    let names: Vec<String> = (0..8).map(|number| format!("{number}.xosc")).collect();
    names
        .iter()
        .for_each(|name| farm.scenario(name, "town.xodr"));
    let maps: Vec<DocId> = std::thread::scope(|scope| {
        let farm = &farm;
        let all: Vec<_> = names
            .iter()
            .map(|name| scope.spawn(move || farm.prepare(name, asked).documents[1].doc))
            .collect();
        all.into_iter().map(|one| one.join().unwrap()).collect()
    });
    assert!(maps.iter().all(|map| *map == maps[0]), "{maps:?}");
}

#[tokio::test]
async fn missing_map_is_found_when_it_appears() {
    let farm = Farm::new();
    farm.scenario("a.xosc", "town.xodr");
    let missing = farm.prepare("a.xosc", Instant::now()).missing;
    assert_eq!(missing.len(), 1);
    farm.put("town.xodr", MAP);
    farm.map_of("a.xosc");
    fs::remove_file(farm.path("town.xodr")).unwrap();
    let missing = farm.prepare("a.xosc", Instant::now()).missing;
    assert_eq!(missing.len(), 1);
}

#[tokio::test]
async fn cached_documents_make_room_for_needed_ones() {
    let farm = Farm::with(HostOptions {
        active_documents: 4,
        ..HostOptions::default()
    });
    // There are more maps than the bus carries at once.
    for number in 0..40 {
        let (map, scenario) = (format!("{number}.xodr"), format!("{number}.xosc"));
        farm.put(&map, MAP);
        farm.scenario(&scenario, &map);
        farm.map_of(&scenario);
    }
    let last = farm.map_of("39.xosc").doc;
    assert_eq!(
        farm.map_of("39.xosc").doc,
        last,
        "the newest document is cached"
    );
}

const LIBRARY: &[u8] = b"<OpenSCENARIO><ManeuverGroup name=\"G\"/></OpenSCENARIO>";

fn modular(file: &str) -> Vec<u8> {
    format!(
        "<OpenSCENARIO><ManeuverGroup name=\"P\"><ScenarioReference scenarioFileName=\"{file}\">\
         <ManeuverGroupReference maneuverGroupName=\"G\"/></ScenarioReference></ManeuverGroup></OpenSCENARIO>"
    )
    .into_bytes()
}

fn roles(prepared: &PreparedJob) -> Vec<DocumentRole> {
    prepared.documents.iter().map(|it| it.role).collect()
}

fn depends_on(prepared: &PreparedJob, path: &Path) -> bool {
    prepared.inputs.iter().any(|input| &*input.path == path)
}

#[tokio::test]
async fn modular_scenario_includes_library_and_expansion() {
    use DocumentRole::{Expanded, Listing, Root, Scenario};
    let farm = Farm::new();
    farm.put("main.xosc", &modular("library.xosc"));
    let prepared = farm.prepare("main.xosc", Instant::now());
    assert_eq!(roles(&prepared), [Root]);
    let whys = prepared.missing.iter().map(|it| it.role);
    assert_eq!(whys.collect::<Vec<_>>(), [Scenario, Expanded]);
    assert!(
        depends_on(&prepared, &farm.path("library.xosc")),
        "the missing library is a dependency"
    );

    farm.put("library.xosc", LIBRARY);
    let prepared = farm.prepare("main.xosc", Instant::now());
    assert_eq!(roles(&prepared), [Root, Scenario, Expanded]);
    assert_eq!(prepared.missing, []);
    let to: Vec<u32> = prepared.documents[0].links.iter().map(|it| it.to).collect();
    assert_eq!(to, [1]);
    let basis = prepared.basis;
    farm.put("library.xosc", &[LIBRARY, b" "].concat());
    assert_ne!(farm.prepare("main.xosc", Instant::now()).basis, basis);

    let files = [
        ("main.xosc".to_owned(), modular("library.xosc")),
        ("library.xosc".to_owned(), LIBRARY.to_vec()),
    ];
    let archive = qcbus_ingest::modular::pack(&files).unwrap();
    farm.put("main.mosc", &archive);
    let prepared = farm.prepare("main.mosc", Instant::now());
    assert_eq!(roles(&prepared), [Root, Listing, Scenario, Expanded]);
    assert_eq!(prepared.inputs.len(), 1, "the archive contains all files");
}

#[tokio::test]
async fn search_path_is_searched_and_watched() {
    let farm = Farm::new();
    farm.put("main.xosc", &modular("library.xosc"));
    let search = SearchPath::parse("far;near".as_ref(), farm.dir.path());
    farm.intake.search_in(Arc::new(search));
    fs::create_dir(farm.path("near")).unwrap();
    farm.put("near/library.xosc", LIBRARY);
    let prepared = farm.prepare("main.xosc", Instant::now());
    assert_eq!(prepared.missing, []);
    for name in ["library.xosc", "far/library.xosc", "near/library.xosc"] {
        assert!(depends_on(&prepared, &farm.path(name)), "{name}");
    }
}
