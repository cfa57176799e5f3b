//! Tests of the gate: a few files in a temporary directory with a gate beside it, and calls in any order.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use qcbus_messages::{Digest, JobId, Verdict};
use qcbus_types::{Epoch, Reading, RequiredSet};
use qcbus_watch::stamp::stamp_through_links;
use tempfile::TempDir;

use super::*;

/// Files with the inputs of each. Maps include fragments, scenarios have maps and scenarios; two refer to each other.
const FARM: [(&str, &[&str]); 7] = [
    ("part.xml", &[]),
    ("a.xodr", &["part.xml"]),
    ("b.xodr", &["part.xml"]),
    ("s.xosc", &["a.xodr", "catalogs"]),
    ("t.xosc", &["a.xodr", "b.xodr", "s.xosc"]),
    ("u.xosc", &["v.xosc"]),
    ("v.xosc", &["u.xosc"]),
];

struct Bench {
    dir: TempDir,
    gate: Gate,
    said: Arc<Mutex<Vec<String>>>,
}

impl Bench {
    fn new(outside: Outside) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(dir.path().join("farm/catalogs")).unwrap();
        let said: Arc<Mutex<Vec<String>>> = Arc::default();
        let gate = open(dir.path(), outside, &said);
        let bench = Bench { dir, gate, said };
        for (name, _) in FARM {
            bench.write(name, "1");
        }
        bench
    }

    fn path(&self, name: &str) -> Arc<Path> {
        self.dir.path().join("farm").join(name).as_path().into()
    }

    fn write(&self, name: &str, version: &str) {
        std::fs::write(self.path(name), format!("{name} {version}")).unwrap();
    }

    fn input(&self, name: &str) -> Input {
        let path = self.path(name);
        let stamp = stamp_through_links(&path);
        let digest = std::fs::read(&path).map_or(Digest([7; 32]), |bytes| digest_of(&bytes));
        Input {
            content: stamp.map_or(Reading::Absent, |stamp| Reading::Read(stamp, digest)),
            path,
        }
    }

    /// Returns an acceptance of the current bytes.
    fn judged(&self, name: &str) -> Judged {
        let parts = FARM
            .iter()
            .find(|it| it.0 == name)
            .map_or(&[][..], |it| it.1);
        let mut names: Vec<&str> = [name].iter().chain(parts).copied().collect();
        if parts.contains(&"a.xodr") || parts.contains(&"b.xodr") {
            names.push("part.xml");
        }
        let inputs: Vec<Input> = names.into_iter().map(|it| self.input(it)).collect();
        accepted(inputs)
    }

    fn accept(&self, name: &str) {
        let judged = self.judged(name);
        self.gate.accept(&self.path(name), &judged).unwrap();
        self.gate.follow(&self.path(name)).unwrap();
    }

    fn refuse(&self, name: &str) {
        self.gate.refuse(&self.path(name)).unwrap();
    }

    /// Returns the names behind the gate.
    fn behind(&self) -> BTreeSet<String> {
        let gate = self.dir.path().join("gate");
        let files = contents::files(&gate).unwrap();
        let name = |it: &PathBuf| it.strip_prefix(&gate).unwrap().display().to_string();
        files.keys().map(name).collect()
    }

    fn content(&self, name: &str) -> String {
        std::fs::read_to_string(self.dir.path().join("gate").join(name)).unwrap()
    }

    fn said(&self) -> Vec<String> {
        std::mem::take(&mut *self.said.lock().unwrap())
    }
}

fn open(dir: &Path, outside: Outside, said: &Arc<Mutex<Vec<String>>>) -> Gate {
    let said = said.clone();
    let options = GateOptions {
        outputs: Outputs::default(),
        max_file: 1 << 20,
        probes: Probes::default(),
        directory: dir.join("gate"),
        paths: ResultPaths::of_watched(dir.join("out"), vec![dir.join("farm")]),
        durable: false,
        outside,
        is_judged: Box::new(|path| {
            let ignored = path.file_name().is_some_and(|it| it == "ignored.xodr");
            !ignored && qcbus_document::FileKind::of_path(path).is_some()
        }),
        say: Box::new(move |text| said.lock().unwrap().push(text)),
    };
    Gate::open(options, "test").unwrap()
}

fn accepted(inputs: Vec<Input>) -> Judged {
    Judged {
        job: JobId(1),
        verdict: Verdict::Accepted,
        own: Verdict::Accepted,
        own_errors: 0,
        rests_on: None,
        digest: inputs[0].digest().unwrap(),
        basis: Digest([1; 32]),
        config: Digest([1; 32]),
        required_set: Arc::new(RequiredSet::unknown()),
        epoch: Epoch(0),
        inputs,
        racy: false,
        counts: [0; 3],
        why: Vec::new(),
        xqar: None,
    }
}

fn names(all: &[&str]) -> BTreeSet<String> {
    all.iter().map(|it| (*it).to_owned()).collect()
}

#[test]
fn file_is_published_with_dependencies_and_removed_before_them() {
    let bench = Bench::new(Outside::Name);
    bench.accept("t.xosc");
    bench.accept("s.xosc");
    assert_eq!(
        bench.behind(),
        names(&[]),
        "the scenarios wait for their maps"
    );
    bench.accept("a.xodr");
    assert_eq!(bench.behind(), names(&["a.xodr", "part.xml", "s.xosc"]));
    bench.accept("b.xodr");
    let all = names(&["a.xodr", "b.xodr", "part.xml", "s.xosc", "t.xosc"]);
    assert_eq!(bench.behind(), all);
    assert_eq!(bench.said(), [""; 0], "nothing is wrong");
    bench.refuse("a.xodr");
    assert_eq!(bench.behind(), names(&["b.xodr", "part.xml"]));
    let said = bench.said();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(
        said[0].contains("s.xosc and 1 more not published"),
        "{said:?}"
    );
    bench.refuse("a.xodr");
    assert_eq!(bench.said(), [""; 0], "said once");
    bench.gate.revoke(&bench.path("b.xodr")).unwrap();
    assert_eq!(
        bench.behind(),
        names(&[]),
        "the fragment is no longer needed"
    );
    // The same bytes are accepted again.
    bench.accept("a.xodr");
    bench.accept("b.xodr");
    assert_eq!(bench.behind(), all);
}

#[test]
fn changed_part_withdraws_all_dependents() {
    let bench = Bench::new(Outside::Name);
    for name in ["a.xodr", "b.xodr", "s.xosc"] {
        bench.accept(name);
    }
    bench.write("part.xml", "2");
    let judged = bench.judged("a.xodr");
    bench.gate.make_way(&bench.path("a.xodr"), &judged).unwrap();
    assert_eq!(bench.behind(), names(&["b.xodr", "part.xml"]));
    bench.accept("a.xodr");
    // The other map was accepted with the old part, and the scenario with the old map.
    assert_eq!(bench.behind(), names(&["a.xodr", "part.xml"]));
    assert_eq!(bench.content("part.xml"), "part.xml 2");
    bench.accept("b.xodr");
    bench.accept("s.xosc");
    let all = names(&["a.xodr", "b.xodr", "part.xml", "s.xosc"]);
    assert_eq!(bench.behind(), all);
}

#[test]
fn bytes_other_than_accepted_are_not_published() {
    let bench = Bench::new(Outside::Name);
    for changed in ["a.xodr", "part.xml"] {
        let judged = bench.judged("a.xodr");
        bench.write(changed, "2");
        bench.gate.accept(&bench.path("a.xodr"), &judged).unwrap();
        assert_eq!(bench.behind(), names(&[]), "{changed}");
        bench.write(changed, "1");
    }
    bench.accept("a.xodr");
    assert_eq!(bench.behind(), names(&["a.xodr", "part.xml"]));
}

#[test]
fn files_that_refer_to_each_other_are_published_together() {
    let bench = Bench::new(Outside::Name);
    bench.accept("u.xosc");
    assert_eq!(bench.behind(), names(&[]));
    bench.accept("v.xosc");
    assert_eq!(bench.behind(), names(&["u.xosc", "v.xosc"]));
    bench.gate.revoke(&bench.path("u.xosc")).unwrap();
    assert_eq!(bench.behind(), names(&[]));
}

#[test]
fn input_outside_gate_root_is_named_or_refused() {
    for outside in [Outside::Name, Outside::Refuse] {
        let bench = Bench::new(outside);
        let mut judged = bench.judged("b.xodr");
        judged.inputs.push(bench.input("../map.xodr"));
        assert_eq!(
            bench.gate.outside(&judged.inputs).len(),
            0,
            "the input is not available"
        );
        let map = bench.dir.path().join("map.xodr");
        std::fs::write(&map, "map").unwrap();
        let input = Input {
            path: map.as_path().into(),
            ..bench.input("../map.xodr")
        };
        judged.inputs.pop();
        judged.inputs.push(input);
        assert_eq!(bench.gate.outside(&judged.inputs), [&*map]);
        bench.gate.accept(&bench.path("b.xodr"), &judged).unwrap();
        let published = bench.behind().contains("b.xodr");
        assert_eq!(published, outside == Outside::Name);
        assert_eq!(bench.said().len(), usize::from(!published));
        assert_eq!(bench.gate.status().held_back, u64::from(!published));
    }
}

/// There are no links behind the gate. The same path leads to another file there, or to none.
#[test]
fn file_reached_through_parent_of_link_is_not_published() {
    let bench = Bench::new(Outside::Name);
    let far = bench.dir.path().join("far");
    std::fs::create_dir_all(far.join("deep")).unwrap();
    std::fs::write(far.join("a.xodr"), "another map").unwrap();
    std::os::unix::fs::symlink(far.join("deep"), bench.path("link")).unwrap();
    let inputs = vec![bench.input("s.xosc"), bench.input("link/../a.xodr")];
    let judged = accepted(inputs);
    bench.gate.accept(&bench.path("s.xosc"), &judged).unwrap();
    assert_eq!(bench.behind(), names(&[]));
    let said = bench.said();
    assert!(said[0].contains("link/../a.xodr"), "{said:?}");
}

#[test]
fn ignored_file_is_published_along_until_it_has_verdict() {
    let bench = Bench::new(Outside::Name);
    bench.write("ignored.xodr", "1");
    let inputs = vec![bench.input("s.xosc"), bench.input("ignored.xodr")];
    let scenario = accepted(inputs);
    bench.gate.accept(&bench.path("s.xosc"), &scenario).unwrap();
    assert_eq!(bench.behind(), names(&["ignored.xodr", "s.xosc"]));
    bench.refuse("ignored.xodr");
    assert_eq!(bench.behind(), names(&[]));
    bench.accept("ignored.xodr");
    assert_eq!(bench.behind(), names(&["ignored.xodr", "s.xosc"]));
}

#[test]
fn start_keeps_valid_publications_and_removes_the_rest() {
    let bench = Bench::new(Outside::Name);
    for name in ["a.xodr", "b.xodr", "s.xosc", "t.xosc"] {
        bench.accept(name);
    }
    let Bench { dir, gate, said } = bench;
    drop(gate);
    let of_gate = |name: &str| dir.path().join("gate").join(name);
    std::fs::remove_file(of_gate("b.xodr")).unwrap();
    std::fs::create_dir(of_gate("deep")).unwrap();
    std::fs::write(of_gate("deep/stale.xosc"), "stale").unwrap();
    let gate = open(dir.path(), Outside::Name, &said);
    let bench = Bench { dir, gate, said };
    let state_of_publication = ["a.xodr", "b.xodr", "s.xosc", "t.xosc"].map(|name| Remembered {
        path: bench.path(name),
        judged: bench.judged(name),
        written: None,
        delivered: Vec::new(),
    });
    let mut left = bench.gate.take_over(&state_of_publication).unwrap();
    left.sort();
    assert_eq!(left, [bench.path("b.xodr"), bench.path("t.xosc")]);
    assert_eq!(bench.behind(), names(&["a.xodr", "part.xml", "s.xosc"]));
    bench.gate.follow(&bench.path("a.xodr")).unwrap();
    assert_eq!(bench.behind(), names(&["a.xodr", "part.xml", "s.xosc"]));
    bench.accept("t.xosc");
    bench.accept("b.xodr");
    let all = names(&["a.xodr", "b.xodr", "part.xml", "s.xosc", "t.xosc"]);
    assert_eq!(bench.behind(), all);
    drop(bench.gate.take_over(&[]).unwrap());
}

#[test]
fn foreign_directory_is_refused_as_gate() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("precious"), "").unwrap();
    assert!(matches!(
        contents::refuse_foreign(dir.path()),
        Err(GateError::Foreign { .. })
    ));
    std::fs::write(dir.path().join(crate::directory_lock::GATE_FILE), "").unwrap();
    contents::refuse_foreign(dir.path()).unwrap();
}

#[test]
fn gate_file_is_restored_only_in_own_directory() {
    let bench = Bench::new(Outside::Name);
    bench.accept("a.xodr");
    let directory = &bench.gate.options.directory;
    let file = directory.join(crate::directory_lock::GATE_FILE);
    std::fs::remove_file(&file).unwrap();
    bench.gate.keep_its_file();
    assert!(file.exists());
    std::fs::remove_file(&file).unwrap();
    bench.accept("b.xodr");
    assert_eq!(bench.behind(), names(&["a.xodr", "b.xodr", "part.xml"]));
    assert!(file.exists(), "a publication also restores the file");

    std::fs::rename(directory, bench.dir.path().join("aside")).unwrap();
    std::fs::create_dir(directory).unwrap();
    std::fs::write(directory.join("precious"), "").unwrap();
    bench.gate.keep_its_file();
    assert!(
        !file.exists(),
        "a directory of another owner is left unchanged"
    );
}

/// An operation on a file.
#[derive(Debug, Clone, Copy)]
enum Step {
    Accept(usize),
    Refuse(usize),
    Revoke(usize),
    Forget(usize),
    /// The bytes change. The publications that depend on the file are revoked, as the core does.
    Change(usize, u8),
    /// The bytes change, and the change is not noticed yet.
    ChangeUnseen(usize, u8),
}

fn step() -> impl Strategy<Value = Step> {
    let file = 0..FARM.len();
    prop_oneof![
        8 => file.clone().prop_map(Step::Accept),
        1 => file.clone().prop_map(Step::Refuse),
        1 => file.clone().prop_map(Step::Revoke),
        1 => file.clone().prop_map(Step::Forget),
        1 => (file.clone(), 0..3_u8).prop_map(|(file, version)| Step::Change(file, version)),
        1 => (file, 0..3_u8).prop_map(|(file, version)| Step::ChangeUnseen(file, version)),
    ]
}

/// Expected publications: for each name the bytes of all its inputs, including the file itself.
type Model = BTreeMap<String, BTreeMap<String, String>>;

fn take(bench: &Bench, model: &mut Model, step: Step) {
    let name = |file: usize| FARM[file].0;
    let read = |name: &str| std::fs::read_to_string(bench.path(name)).unwrap();
    match step {
        Step::Accept(file) if name(file) != "part.xml" => {
            let judged = bench.judged(name(file));
            let files = judged.inputs.iter().filter(|it| !it.path.is_dir());
            let files = files.map(|it| it.path.file_name().unwrap().to_string_lossy());
            let bytes = files.map(|it| (it.to_string(), read(&it))).collect();
            bench.accept(name(file));
            model.insert(name(file).to_owned(), bytes);
        }
        Step::Accept(_) => {}
        Step::Refuse(file) if name(file) != "part.xml" => {
            bench.refuse(name(file));
            model.remove(name(file));
        }
        Step::Refuse(_) => {}
        Step::Revoke(file) => {
            bench.gate.revoke(&bench.path(name(file))).unwrap();
            model.remove(name(file));
        }
        Step::Forget(file) => {
            bench.gate.forget(&bench.path(name(file))).unwrap();
            model.remove(name(file));
        }
        Step::Change(file, version) => {
            bench.write(name(file), &version.to_string());
            for (other, parts) in FARM {
                if other == name(file) || parts.contains(&name(file)) {
                    bench.gate.revoke(&bench.path(other)).unwrap();
                    model.remove(other);
                }
            }
        }
        Step::ChangeUnseen(file, version) => bench.write(name(file), &version.to_string()),
    }
}

/// Returns the faults in the contents of the gate.
fn faults(bench: &Bench, model: &Model) -> Vec<String> {
    let behind = bench.behind();
    let mut faults = Vec::new();
    for name in behind.iter().filter(|it| *it != "part.xml") {
        let Some(publication) = model.get(name) else {
            faults.push(format!("{name} has no publication"));
            continue;
        };
        for (part, bytes) in publication {
            if !behind.contains(part) || bench.content(part) != *bytes {
                faults.push(format!("{name} is there without its {part}"));
            }
        }
    }
    let needed = model
        .iter()
        .any(|(name, publication)| behind.contains(name) && publication.contains_key("part.xml"));
    if behind.contains("part.xml") && !needed {
        faults.push("nobody needs part.xml".to_owned());
    }
    faults
}

/// Returns the files that must be published if the bytes on the disk match every publication.
fn complete(model: &Model) -> BTreeSet<String> {
    let mut complete: BTreeSet<String> = model.keys().cloned().collect();
    loop {
        let before = complete.clone();
        complete.retain(|name| {
            let parts = model[name].iter().filter(|(part, _)| *part != "part.xml");
            let same = |(part, bytes): (&String, &String)| {
                before.contains(part) && model[part].get(part) == Some(bytes)
            };
            parts.into_iter().all(same)
        });
        if complete == before {
            return complete;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn nothing_is_published_without_all_its_parts(
        steps in proptest::collection::vec(step(), 1..40)
    ) {
        let bench = Bench::new(Outside::Name);
        let mut model = Model::new();
        for step in &steps {
            take(&bench, &mut model, *step);
            let faults = faults(&bench, &model);
            prop_assert!(faults.is_empty(), "{step:?} in {steps:?}: {faults:?}");
        }
        // After every file was judged in its current state, all of them must be published.
        for _ in 0..2 {
            for file in 0..FARM.len() {
                take(&bench, &mut model, Step::Accept(file));
            }
        }
        let mut behind = bench.behind();
        behind.remove("part.xml");
        prop_assert_eq!(complete(&model), behind);
    }
}

#[test]
fn publications_of_different_bytes_wait_for_verdict() {
    let bench = Bench::new(Outside::Name);
    bench.accept("a.xodr");
    bench.write("part.xml", "2");
    let stale = bench.judged("s.xosc");
    let path = bench.path("s.xosc");
    bench.gate.accept(&path, &stale).unwrap();
    // The bytes that the map was accepted with are back. Those that the scenario was accepted with are not.
    bench.write("part.xml", "1");
    bench.gate.accept(&path, &stale).unwrap();
    assert!(!bench.behind().contains("s.xosc"));
    for name in FARM.map(|it| it.0) {
        bench.accept(name);
    }
    assert_eq!(bench.behind(), FARM.map(|it| it.0.to_owned()).into());
}

#[test]
fn concurrent_publications_neither_block_nor_leave_gaps() {
    let bench = Bench::new(Outside::Name);
    std::thread::scope(|scope| {
        for thread in 0..8 {
            let bench = &bench;
            scope.spawn(move || {
                for round in 0..100 {
                    let (name, _) = FARM[(thread + round) % FARM.len()];
                    match round % 5 {
                        0 => bench.gate.revoke(&bench.path(name)).unwrap(),
                        1 if name != "part.xml" => bench.refuse(name),
                        _ if name != "part.xml" => bench.accept(name),
                        _ => {}
                    }
                }
            });
        }
    });
    for (name, _) in FARM.iter().filter(|it| it.0 != "part.xml") {
        bench.accept(name);
    }
    assert_eq!(bench.behind(), FARM.map(|it| it.0.to_owned()).into());
}
