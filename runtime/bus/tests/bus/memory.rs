//! Shared memory: it is allocated before writing, and the bus takes a known amount.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use qcbus_bus::{Host, HostOptions, StartError};
use qcbus_messages::services::{Limits, Services};

use crate::helper::Helper;
use crate::support::{Site, join, run, shared_memory_of};

/// Returns the bytes in the segments of this instance, without the reserve for joining peers.
fn taken(site: &Site) -> u64 {
    let segments = shared_memory_of(&site.instance).into_iter();
    let bytes = |name: String| {
        let path = Path::new("/dev/shm").join(name);
        let below = std::fs::read_dir(&path).map_or(0, |_| tree(&path));
        std::fs::metadata(&path).map_or(0, |data| data.blocks() * 512 + below)
    };
    segments.map(bytes).sum()
}

fn tree(directory: &Path) -> u64 {
    let Ok(entries) = std::fs::read_dir(directory) else {
        return 0;
    };
    let segments = entries
        .flatten()
        .filter(|entry| entry.file_name() != "room");
    let bytes = segments.map(|entry| match entry.metadata() {
        Ok(data) if data.is_dir() => tree(&entry.path()),
        Ok(data) => data.blocks() * 512,
        Err(_) => 0,
    });
    bytes.sum()
}

#[test]
fn table_states_the_memory_use_of_the_bus() {
    for (peers, documents) in [(1, 64), (3, 64), (32, 64), (100, 16)] {
        run(async move {
            let site = Site::new();
            let options = HostOptions {
                max_peers: peers,
                active_documents: documents,
                ..HostOptions::default()
            };
            let limits = Limits {
                peers,
                small_active: documents,
                small_held: documents + documents / 2 + 2,
                large_held: 14,
                ..Limits::default()
            };
            let services = Services::new(&limits);
            let mut host = Host::start(&site.instance, options).unwrap();
            let alone = taken(&site);
            let said = services.broker_bytes();
            assert!(alone <= said, "{peers}: {alone} of {said} bytes");
            assert!(alone * 2 > said, "{peers}: {alone} of {said} bytes");
            let (_, _peer) = join(&mut host, &site, "peer").await;
            let with_one = taken(&site) - alone;
            let said = services.peer_bytes();
            println!("{peers} peers: {alone} bytes, and {with_one} of {said} for each");
            assert!(with_one <= said, "{peers}: {with_one} of {said} bytes");
            assert!(with_one * 2 > said, "{peers}: {with_one} of {said} bytes");
        });
    }
}

#[test]
fn memory_is_reserved_for_expected_peers() {
    run(async {
        let site = Site::new();
        let options = HostOptions {
            max_peers: 3,
            expected_peers: 2,
            ..HostOptions::default()
        };
        let mut host = Host::start(&site.instance, options).unwrap();
        let names = shared_memory_of(&site.instance);
        let [root] = names.as_slice() else {
            panic!("{names:?}");
        };
        let room = Path::new("/dev/shm").join(root).join("room");
        let kept = || std::fs::metadata(&room).unwrap().blocks() * 512;
        let both = kept();
        assert!(both > 0);
        let (_, _first) = join(&mut host, &site, "first").await;
        assert!(kept() <= both / 2 + 4096, "{} of {both}", kept());
        let (_, _second) = join(&mut host, &site, "second").await;
        assert!(kept() <= 4096, "{} of {both}", kept());
        let (_, _third) = join(&mut host, &site, "not expected").await;
        drop(host);
        assert!(!room.exists());
    });
}

#[test]
fn permanent_lack_of_memory_differs_from_a_temporary_one() {
    let site = Site::new();
    let role = "asks_for_too_much";
    let Some(mut helper) = Helper::start_in_small_memory(role, &site.instance) else {
        println!("skipped: mounting a small /dev/shm is not allowed here");
        return;
    };
    let never = helper.line();
    assert!(never.contains("`mount -o remount,size="), "{never}");
    assert!(never.contains("`docker run --shm-size="), "{never}");
    let later = helper.line();
    assert!(later.starts_with("not enough shared memory: "), "{later}");
    assert!(helper.end().success());
}

#[test]
fn full_memory_kills_no_process_and_loses_no_message() {
    let site = Site::new();
    let role = "speaks_in_a_full_memory";
    let Some(mut helper) = Helper::start_in_small_memory(role, &site.instance) else {
        println!("skipped: mounting a small /dev/shm is not allowed here");
        return;
    };
    assert_eq!(helper.line(), "full");
    assert_eq!(helper.line(), "500 messages, in order");
    assert!(helper.end().success());
}

#[test]
fn concurrent_allocations_are_refused_and_not_killed() {
    let site = Site::new();
    let role = "many_take_at_once";
    let Some(mut helper) = Helper::start_in_small_memory(role, &site.instance) else {
        println!("skipped: mounting a small /dev/shm is not allowed here");
        return;
    };
    assert_eq!(helper.line(), "no page of the reserve was taken");
    assert!(helper.end().success());
}

#[test]
fn start_without_memory_suggests_a_sufficient_size() {
    let refused = |size, needed| StartError::NoSharedMemory {
        size,
        free: 0,
        needed,
    };
    let later = refused(64 << 20, 8 << 20);
    assert!(later.may_pass());
    let text = later.to_string();
    assert!(text.contains("remove what they left"), "{text}");
    let more = "docker run --shm-size=128m`";
    assert!(text.ends_with(more), "more than the present size: {text}");
    let never = refused(4 << 20, 8 << 20);
    assert!(!never.may_pass());
    let text = never.to_string();
    assert!(text.ends_with("docker run --shm-size=64m`"), "{text}");
}
