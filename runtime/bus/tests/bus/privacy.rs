//! Only the user of the bus can access its files.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use qcbus_bus::{MappedImage, PeerEvent};
use qcbus_document::{Document, FileKind};
use qcbus_fuzzing::{Tree, walk};
use qcbus_messages::{Digest, DocId};

use crate::helper::Helper;
use crate::support::{Site, WATCHDOG, identity_of, join, run, shared_memory_named};

/// User id without any rights.
const NOBODY: u32 = 65534;

/// Returns every entry that a host and its peers have created: in /dev/shm, in the runtime
/// directory, and below.
fn entries(site: &Site) -> Vec<PathBuf> {
    let identity = identity_of(&site.instance);
    let mut found: Vec<PathBuf> = std::fs::read_dir("/dev/shm")
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.to_string_lossy().contains(&identity))
        .collect();
    found.push(site.instance.dir().to_owned());
    let mut at = 0;
    while let Some(path) = found.get(at).cloned() {
        at += 1;
        if path.is_dir() {
            let inside = std::fs::read_dir(&path).unwrap();
            found.extend(inside.map(|entry| entry.unwrap().path()));
        }
    }
    found
}

/// Returns the paths that the user nobody can open for reading, writing or listing.
fn open_to_nobody(paths: &[PathBuf]) -> String {
    let script = r#"for path in "$@"; do
        ( : < "$path" ) 2> /dev/null && echo "reads $path"
        ( : >> "$path" ) 2> /dev/null && echo "writes $path"
        ls "$path" > /dev/null 2>&1 && echo "sees $path"
    done; true"#;
    let output = Command::new("sh")
        .args(["-c", script, "sh"])
        .args(paths)
        .uid(NOBODY)
        .gid(NOBODY)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn files_of_the_bus_are_closed_to_other_users() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let _peer = join(&mut host, &site, "there").await;
        let found = entries(&site);
        assert!(found.len() > 40, "{found:?}");
        for path in &found {
            let mode = std::fs::symlink_metadata(path)
                .unwrap()
                .permissions()
                .mode();
            let is_in_nodes = path
                .parent()
                .is_some_and(|parent| parent.ends_with("nodes"));
            // iceoryx2 sets the mode 0750 here whenever a peer joins. The directory above is
            // closed.
            let rights = if is_in_nodes && path.is_dir() {
                0o027
            } else {
                0o077
            };
            assert_eq!(mode & rights, 0, "{mode:o} {}", path.display());
        }
        if !rustix::process::geteuid().is_root() {
            println!("skipped: only root can look with the eyes of another user");
            return;
        }
        // Nobody would stop at the first directory, so the way to the runtime directory is opened.
        let above = site.instance.dir().parent().unwrap();
        std::fs::set_permissions(above, PermissionsExt::from_mode(0o755)).unwrap();
        assert_eq!(
            open_to_nobody(&[above.to_owned()]).lines().count(),
            2,
            "the path must be accessible"
        );
        assert_eq!(open_to_nobody(&found), "");
    });
}

#[test]
fn next_name_in_shared_memory_is_unpredictable() {
    run(async {
        let site = Site::new();
        let helper = Helper::start("serves", &site.instance);
        let identity = loop {
            // The generation is published after everything is created.
            if site.instance.dir().join("current").exists() {
                break identity_of(&site.instance);
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        };
        let first = shared_memory_named(&identity);
        let [name] = &first[..] else {
            panic!("{first:?}")
        };
        helper.kill();
        let suffix = name.strip_prefix(&format!("{identity}1_")).unwrap();
        // An attacker plants this entry to be there before the next broker.
        let planted = format!("/dev/shm/{identity}2_{suffix}");
        std::fs::write(&planted, "").unwrap();
        let mut host = site.host();
        assert_eq!(host.generation(), 2);
        let _peer = join(&mut host, &site, "there").await;
        let _ = std::fs::remove_file(&planted);
    });
}

/// Creates an image of a few dozen elements, in ASCII.
fn image() -> Vec<u8> {
    let mut root = Tree::new("OpenDRIVE");
    for id in 0..6 {
        let lane = Tree::new("lane").with("id", "-1").saying("sidewalk");
        let road = Tree::new("road").with("id", &id.to_string());
        let road = road.with("name", "Street").with("length", "12.5");
        root = root.holding(road.holding(Tree::new("lanes").holding(lane.clone()).holding(lane)));
    }
    root.image("maps/straight.xodr").unwrap()
}

/// Reads an image in every way until it was often seen unchanged and often changed. Returns the
/// number of refusals.
fn read_it_while_it_changes(mapped_image: &MappedImage, sound: &[u8]) -> usize {
    let as_it_is = walk(Document::open(sound).unwrap());
    let (mut same, mut other, mut refused) = (0, 0, 0);
    let before = Document::open(sound).unwrap().len();
    while same < 20 || other < 2_000 {
        let Ok(document) = Document::open(mapped_image) else {
            refused += 1;
            continue;
        };
        match walk(document) == as_it_is {
            true => same += 1,
            false => other += 1,
        }
        // Every call ends, whatever it returns. Its result is not trusted.
        for _ in 0..50 {
            let _ = document.validate();
        }
        if let Some(node) = document.root() {
            assert!(node.ancestors().count() <= before as usize);
        }
    }
    refused
}

#[test]
fn slot_rewritten_while_it_is_read_does_no_harm() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let sound = image();
        let mut loan = host.documents().loan(sound.len()).unwrap();
        loan.copy_from_slice(&sound);
        let ours = loan
            .publish(DocId(1), sound.len(), Digest::default(), FileKind::Xodr)
            .unwrap();
        let (_, mut peer) = join(&mut host, &site, "reader").await;
        let mapped_image = loop {
            tokio::select! {
                event = host.next() => panic!("{event:?}"),
                event = peer.next() => if matches!(event, PeerEvent::Document(_)) {
                    break peer.document(DocId(1)).unwrap();
                }
            }
        };
        assert_eq!(&*mapped_image, &sound[..]);
        let mut rewriter = Helper::start("rewrites_images", &site.instance);
        assert_eq!(rewriter.line(), "rewrites");
        let (done, reading) = std::sync::mpsc::channel();
        let original = sound.clone();
        std::thread::spawn(move || {
            let _ = done.send(read_it_while_it_changes(&mapped_image, &original));
        });
        let refused = reading.recv_timeout(WATCHDOG);
        rewriter.kill();
        let refused = refused.expect("reading must end without a panic");
        println!("refused {refused} times");
        drop(ours);
    });
}
