//! Helper processes: this test binary, started again with a role in its environment.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::FileExt;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use qcbus_bus::{
    Host, HostEvent, HostOptions, Instance, JoinError, LoanError, Peer, PeerEvent, PeerOptions,
};
use qcbus_document::FileKind;
use qcbus_messages::{Digest, DocId, FromPeer, Job, JobId, ToPeer};

use crate::support::{WATCHDOG, hello, is_uniform, run_forever, welcome};

const ROLE: &str = "QCBUS_BUS_TEST_ROLE";
const PLACE: &str = "QCBUS_BUS_TEST_PLACE";
/// Prefix of the lines that a helper prints for its test. Other lines come from the test harness.
const MARK: &str = "@@ ";

/// A process that is killed and waited for at the end of the test.
pub struct Helper {
    child: Child,
    lines: Receiver<String>,
}

impl Helper {
    pub fn start(role: &str, instance: &Instance) -> Helper {
        Helper::run(
            Command::new(std::env::current_exe().unwrap()),
            role,
            instance,
        )
    }

    /// Starts a helper with its own /dev/shm of 64 MB. Returns `None` if that is not allowed here.
    pub fn start_in_small_memory(role: &str, instance: &Instance) -> Option<Helper> {
        const MOUNT: &str = "mount -t tmpfs -o size=64m tmpfs /dev/shm";
        let allowed = Command::new("unshare")
            .args(["-m", "sh", "-c", MOUNT])
            .stderr(Stdio::null())
            .status();
        if !allowed.is_ok_and(|status| status.success()) {
            return None;
        }
        let mut command = Command::new("unshare");
        let script = format!("{MOUNT} && exec \"$0\" \"$@\"");
        command.args(["-m", "sh", "-c", &script]);
        command.arg(std::env::current_exe().unwrap());
        Some(Helper::run(command, role, instance))
    }

    fn run(mut command: Command, role: &str, instance: &Instance) -> Helper {
        let mut child = command
            .args(["--exact", "helper::other_process", "--nocapture"])
            .env(ROLE, role)
            .env(PLACE, instance.dir())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let (said, lines) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                if let Some((_, text)) = line.split_once(MARK) {
                    let _ = said.send(text.to_owned());
                }
            }
        });
        Helper { child, lines }
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Waits for the next line of the helper.
    pub fn line(&mut self) -> String {
        self.lines
            .recv_timeout(WATCHDOG)
            .expect("the helper must print a line in time")
    }

    /// Returns the lines that the helper has printed meanwhile.
    pub fn lines_so_far(&mut self) -> Vec<String> {
        self.lines.try_iter().collect()
    }

    pub fn signal(&self, signal: rustix::process::Signal) {
        let pid = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(pid, signal).unwrap();
    }

    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Waits for the end of the helper.
    pub fn end(mut self) -> std::process::ExitStatus {
        self.child.wait().unwrap()
    }
}

impl Drop for Helper {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn say(text: &str) {
    println!("{MARK}{text}");
}

/// Runs a helper process. This is not a real test.
#[test]
fn other_process() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let instance = Instance::at(std::env::var_os(PLACE).unwrap().into());
    run_forever(async {
        match role.as_str() {
            "holds_documents" => holds_documents(&instance).await,
            "reads_and_weighs_itself" => reads_and_weighs_itself(&instance).await,
            "lives_in_a_small_memory" => lives_in_a_small_memory(&instance).await,
            "speaks_in_a_full_memory" => speaks_in_a_full_memory(&instance).await,
            "asks_for_too_much" => asks_for_too_much(&instance),
            "many_take_at_once" => many_take_at_once(&instance),
            "answers_jobs" => answers_jobs(&instance).await,
            "writes_into_a_document" => writes_into_a_document(&instance).await,
            "serves" => serves(&instance).await,
            "rewrites_images" => rewrite_images(&instance),
            other => panic!("unknown role {other}"),
        }
    });
}

async fn member(instance: &Instance, name: &str) -> Result<Peer, JoinError> {
    let options = PeerOptions {
        patience: Duration::from_secs(30),
        grace: Duration::from_secs(30),
        ..PeerOptions::default()
    };
    Peer::join(instance, hello(name), options).await
}

/// Holds every document that arrives for ever, and reports it to the broker.
async fn holds_documents(instance: &Instance) {
    let mut peer = member(instance, "holder").await.unwrap();
    let mut images = Vec::new();
    loop {
        if let PeerEvent::Document(doc) = peer.next().await {
            images.extend(peer.document(doc));
            peer.send(&FromPeer::JobDone {
                job: JobId(doc.0),
                micros: images.len() as u64,
            });
        }
    }
}

/// Reads every byte of a document. Then it reports the size of its own memory in KiB to the broker.
async fn reads_and_weighs_itself(instance: &Instance) {
    let mut peer = member(instance, "reader").await.unwrap();
    loop {
        if let PeerEvent::Document(doc) = peer.next().await {
            let mapped_image = peer.document(doc).unwrap();
            assert!(is_uniform(&mapped_image, mapped_image[0]));
            peer.send(&FromPeer::JobDone {
                job: JobId(doc.0),
                micros: private_memory(),
            });
        }
    }
}

/// Runs a broker and a reader in a /dev/shm without room for the history of large documents.
async fn lives_in_a_small_memory(instance: &Instance) {
    let site = crate::support::Site::at(instance);
    let mut host = site.host();
    let (_, mut peer) = crate::support::join(&mut host, &site, "reader").await;
    let documents = host.documents();
    let mut refused = 0;
    // These images exceed the ones that the library keeps itself. They are dropped only when the
    // peer is told to let them go.
    let mut kept = Vec::new();
    for doc in 1..=40 {
        let mut loan = loop {
            match documents.loan(10_000_000) {
                Ok(loan) => break loan,
                Err(LoanError::NoSpace { .. }) => refused += 1,
                Err(other) => panic!("{other}"),
            }
            tokio::select! {
                event = host.next() => panic!("{event:?}"),
                event = peer.next() => if matches!(event, PeerEvent::LetGo) {
                    kept.clear();
                },
                () = tokio::time::sleep(Duration::from_millis(5)) => {}
            }
        };
        loan.fill(doc as u8);
        let mapped_image = loan
            .publish(DocId(doc), 10_000_000, Digest::default(), FileKind::Xodr)
            .unwrap();
        while peer.document(DocId(doc)).is_none() {
            tokio::select! {
                event = host.next() => panic!("{event:?}"),
                _ = peer.next() => {}
            }
        }
        assert!(is_uniform(&peer.document(DocId(doc)).unwrap(), doc as u8));
        kept.extend(peer.document(DocId(doc)));
        peer.forget(DocId(doc));
        drop(mapped_image);
    }
    say(&format!("40 documents, {} refusals", refused.min(1)));
}

/// Takes all remaining shared memory to the last page, as another program might.
fn fill_memory() -> std::path::PathBuf {
    let path = std::path::PathBuf::from("/dev/shm/filler");
    let filler = std::fs::File::create(&path).unwrap();
    let mut had = 0;
    for step in [1 << 20, 4096] {
        let none = rustix::fs::FallocateFlags::empty();
        while rustix::fs::fallocate(&filler, none, had, step).is_ok() {
            had += step;
        }
    }
    path
}

/// Runs a broker and a peer. The shared memory is full while the peer sends many messages.
async fn speaks_in_a_full_memory(instance: &Instance) {
    let site = crate::support::Site::at(instance);
    let mut host = site.host();
    let (_, mut peer) = crate::support::join(&mut host, &site, "speaker").await;
    let filler = fill_memory();
    for number in 0..500 {
        peer.send(&crate::support::numbered(number, 15_000));
    }
    // The messages go around in the existing frames, or wait for more.
    let mut heard = Vec::new();
    for _ in 0..50 {
        tokio::select! {
            event = host.next() => heard.push(event),
            _ = peer.next() => {}
            () = tokio::time::sleep(Duration::from_millis(2)) => {}
        }
    }
    say("full");
    std::fs::remove_file(filler).unwrap();
    while heard.len() < 500 {
        tokio::select! {
            event = host.next() => heard.push(event),
            event = peer.next() => panic!("{event:?}"),
        }
    }
    for (number, event) in heard.into_iter().enumerate() {
        let HostEvent::Message { message, .. } = event else {
            panic!("{event:?}")
        };
        let expected = crate::support::numbered(number as u64, 15_000);
        assert_eq!(message, expected);
    }
    say("500 messages, in order");
}

/// Reports the reasons for two refusals: an image is too large for the memory, and another one is
/// too large at this time.
fn asks_for_too_much(instance: &Instance) {
    let host = Host::start(instance, HostOptions::default()).unwrap();
    let documents = host.documents();
    let never = documents.loan(60 << 20).err();
    assert!(
        matches!(never, Some(LoanError::NeverFits { .. })),
        "{never:?}"
    );
    say(&never.unwrap().to_string());
    let others = documents.loan(40 << 20).unwrap();
    let later = documents.loan(40 << 20).err();
    assert!(
        matches!(later, Some(LoanError::NoSpace { .. })),
        "{later:?}"
    );
    say(&later.unwrap().to_string());
    drop(others);
}

/// Lets several brokers request more memory at once than exists. The losers are refused, and the
/// reserve for the rest of the bus stays free.
fn many_take_at_once(instance: &Instance) {
    let memory = || qcbus_bus::SharedMemory::now().unwrap();
    let options = HostOptions {
        max_peers: 2,
        ..HostOptions::default()
    };
    let hosts: Vec<Host> = (0..6)
        .map(|number| {
            let place = instance.dir().with_file_name(format!("broker-{number}"));
            Host::start(&Instance::at(place), options).unwrap()
        })
        .collect();
    let all: Vec<_> = hosts.iter().map(Host::documents).collect();
    let reserve = memory().size / 8;
    let least = std::thread::scope(|scope| {
        let takers = all.iter().map(|documents| {
            scope.spawn(move || {
                let mut least = u64::MAX;
                for _ in 0..40 {
                    match documents.loan(25 << 20) {
                        Ok(mut loan) => {
                            least = least.min(memory().free);
                            loan.fill(1);
                        }
                        Err(LoanError::NoSpace { .. }) => {}
                        Err(other) => panic!("{other}"),
                    }
                }
                least
            })
        });
        let takers: Vec<_> = takers.collect();
        takers.into_iter().map(|it| it.join().unwrap()).min()
    });
    // The header before a slot takes a page or two.
    assert!(
        least.unwrap() + (64 << 10) >= reserve,
        "{least:?} of {reserve}"
    );
    say("no page of the reserve was taken");
}

/// Returns the unshared memory of this process in KiB (proc(5), `smaps_rollup`).
fn private_memory() -> u64 {
    std::fs::read_to_string("/proc/self/smaps_rollup")
        .unwrap()
        .lines()
        .filter(|line| line.starts_with("Private_"))
        .map(|line| {
            line.split_whitespace()
                .nth(1)
                .unwrap()
                .parse::<u64>()
                .unwrap()
        })
        .sum()
}

/// Answers every job with the sum of its document's bytes, if it has a document.
async fn answers_jobs(instance: &Instance) {
    let mut peer = member(instance, "answerer").await.unwrap();
    say("joined");
    let mut waiting: Vec<Job> = Vec::new();
    loop {
        match peer.next().await {
            PeerEvent::Message(ToPeer::Job(job)) => {
                let answered = waiting.is_empty() && answer(&mut peer, &job);
                if !answered {
                    let doc = job.documents[0].doc;
                    peer.send(&FromPeer::NeedDocument { doc });
                    waiting.push(job);
                }
            }
            PeerEvent::Document(_) => waiting.retain(|job| !answer(&mut peer, job)),
            PeerEvent::Message(ToPeer::Drain) => return peer.leave().await,
            PeerEvent::Rejoined => {
                waiting.clear();
                say("rejoined");
            }
            PeerEvent::Closed { .. } => return,
            _ => {}
        }
    }
}

/// Answers a job. Returns `false` if its document is missing.
fn answer(peer: &mut Peer, job: &Job) -> bool {
    let mut sum = 0;
    for document in &job.documents {
        let Some(mapped_image) = peer.document(document.doc) else {
            return false;
        };
        sum += mapped_image
            .iter()
            .map(|byte| u64::from(*byte))
            .sum::<u64>();
        peer.forget(document.doc);
    }
    peer.send(&FromPeer::JobDone {
        job: job.job,
        micros: sum,
    });
    true
}

#[expect(unsafe_code, reason = "the test checks that this write fails")]
async fn writes_into_a_document(instance: &Instance) {
    let mut peer = member(instance, "scribbler").await.unwrap();
    loop {
        if let PeerEvent::Document(doc) = peer.next().await {
            let mapped_image = peer.document(doc).unwrap();
            say("writes");
            // SAFETY: there is none. The process dies here, and the test checks exactly that.
            unsafe { std::ptr::write_volatile(mapped_image.as_ptr().cast_mut(), 0) };
            say("has written");
        }
    }
}

/// Opens the segment with the first image for writing, and rewrites it at random until it is
/// killed. Any unrestricted program of the same user may do so. It writes only ASCII, because no
/// accessor can handle a text that stops being UTF-8 while it is borrowed.
fn rewrite_images(instance: &Instance) {
    let (segment, at) = segments_of(instance)
        .into_iter()
        .find_map(|path| {
            let file = std::fs::File::options().read(true).write(true).open(path);
            let file = file.ok()?;
            let at = find_image(&file)?;
            Some((file, at))
        })
        .expect("an image exists");
    let mut random = qcbus_fuzzing::Random(crate::support::fresh_number());
    let mut sound = vec![0; IMAGE_AT_MOST];
    let len = segment.read_at(&mut sound, at).unwrap();
    sound.truncate(len);
    say("rewrites");
    loop {
        let mut spoilt = sound.clone();
        for _ in 0..20 {
            qcbus_fuzzing::corrupt(&mut spoilt, &mut random);
            spoilt.resize(sound.len(), 0);
            for (byte, whole) in spoilt.iter_mut().zip(&sound) {
                *byte = if byte == whole { *byte } else { *byte & 0x7F };
            }
            // The header stays, because it locates the text. The text must not overlap numbers.
            segment
                .write_all_at(&spoilt[HEADER..], at + HEADER as u64)
                .unwrap();
        }
        segment.write_all_at(&sound, at).unwrap();
    }
}

/// Maximum size in bytes of an image that a test rewrites.
const IMAGE_AT_MOST: usize = 4 << 10;

/// Bytes of an image before its sections.
const HEADER: usize = 256;

fn segments_of(instance: &Instance) -> Vec<std::path::PathBuf> {
    let identity = crate::support::identity_of(instance);
    let mut found: Vec<std::path::PathBuf> = crate::support::shared_memory_named(&identity)
        .iter()
        .flat_map(|root| std::fs::read_dir(format!("/dev/shm/{root}")).unwrap())
        .map(|entry| entry.unwrap().path())
        .collect();
    found.retain(|path| path.extension().is_some_and(|it| it == "data"));
    found
}

/// Returns the offset of an image in a segment, if there is one.
fn find_image(segment: &std::fs::File) -> Option<u64> {
    const WINDOW: usize = 1 << 20;
    let mut from = rustix::fs::seek(segment, rustix::fs::SeekFrom::Data(0)).ok()?;
    loop {
        let mut bytes = vec![0; WINDOW];
        let len = segment.read_at(&mut bytes, from).ok()?;
        let magic = bytes[..len].windows(8).position(|it| it == b"qcbusDOC");
        if let Some(place) = magic {
            return Some(from + place as u64);
        }
        let next = from + WINDOW as u64;
        from = rustix::fs::seek(segment, rustix::fs::SeekFrom::Data(next)).ok()?;
    }
}

/// Number of jobs that each peer of [`serves`] has at a time.
const IN_FLIGHT: u64 = 8;

/// Runs a broker that keeps every peer busy without end. It reports missing, doubled and misordered
/// answers.
async fn serves(instance: &Instance) {
    let mut host = Host::start(instance, HostOptions::default()).unwrap();
    say(&format!("serves {}", host.generation()));
    let documents = host.documents();
    let mut image = documents.loan(1000).unwrap();
    image.fill(1);
    let mapped_image = image
        .publish(DocId(1), 1000, Digest::default(), FileKind::Xodr)
        .unwrap();
    let mut expected = BTreeMap::new();
    loop {
        match host.next().await {
            HostEvent::Hello { peer, .. } => {
                let welcome = welcome(&host);
                host.accept(peer, &welcome);
                expected.insert(peer, 1);
                for number in 1..=IN_FLIGHT {
                    host.send(peer, &job_with(number, DocId(1)));
                }
            }
            HostEvent::Message { peer, message } => match message {
                FromPeer::JobDone { job, micros } => {
                    let next = expected.get_mut(&peer).unwrap();
                    if (*next, 1000) != (job.0, micros) {
                        say(&format!("wrong: {job:?} {micros} instead of {next}"));
                    }
                    *next += 1;
                    if job.0 % 100 == 1 {
                        say(&format!("done {}", job.0));
                    }
                    host.send(peer, &job_with(job.0 + IN_FLIGHT, DocId(1)));
                }
                FromPeer::NeedDocument { .. } => {
                    if let Err(error) = documents.publish_again(&mapped_image) {
                        say(&format!("wrong: {error}"));
                    }
                }
                _ => {}
            },
            HostEvent::Garbage { what, .. } => say(&format!("wrong: garbage, {what}")),
            HostEvent::Gone { .. } | HostEvent::TurnedAway { .. } => {}
        }
    }
}

pub fn job_with(number: u64, doc: DocId) -> ToPeer {
    ToPeer::Job(Job {
        job: JobId(number),
        config: Digest::default(),
        kind: FileKind::Xodr,
        documents: vec![qcbus_messages::JobDocument {
            doc,
            role: qcbus_messages::DocumentRole::Root,
            path: "/farm/map.xodr".to_owned(),
            digest: Digest::default(),
            referred_at: 0,
            links: Vec::new(),
        }],
        missing: Vec::new(),
    })
}
