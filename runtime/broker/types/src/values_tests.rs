use super::*;
use crate::Notice;

fn spec(command: &str) -> ChildSpec {
    ChildSpec {
        name: "Child".to_owned(),
        role: Role::Bundle,
        version: Some("1".to_owned()),
        command: vec![command.to_owned()],
        restart: Restart::Always,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

#[test]
fn launches_increase_and_identify_what_was_started() {
    let (one, other) = (spec("one"), spec("other"));
    let mut launch = Launch::first_of(3);
    for number in 0..1000 {
        let started = if number % 2 == 0 { &one } else { &other };
        let next = launch.next(started);
        assert!(next > launch && next < Launch::first_of(4), "{number}");
        assert!(next.is_of(started));
        assert!(!next.is_of(if number % 2 == 0 { &other } else { &one }));
        launch = next;
    }
    // The next start is another launch, whatever the digest is.
    let full = Launch(launch.0 | ((1 << SPEC_BITS) - 1));
    assert!(full.next(&one) > full);
}

#[test]
fn touched_stamp_differs_in_ctime_only() {
    let stamp = Stamp {
        size: 1,
        mtime_ns: 2,
        ctime_ns: 3,
        inode: 4,
    };
    let touched = Stamp {
        ctime_ns: 5,
        ..stamp
    };
    assert!(touched.differs_in_ctime_only(&stamp));
    assert!(
        !stamp.differs_in_ctime_only(&stamp),
        "equal stamps do not differ"
    );
    for other in [
        Stamp { size: 9, ..touched },
        Stamp {
            mtime_ns: 9,
            ..touched
        },
        Stamp {
            inode: 9,
            ..touched
        },
    ] {
        assert!(!other.differs_in_ctime_only(&stamp), "{other:?}");
    }
}

#[test]
fn notice_names_the_affected_peer() {
    let name = "Child".to_owned();
    let why = "it crashed".to_owned();
    assert_eq!(Notice::Ended { name, why }.about(), Some("Child"));
    assert_eq!(Notice::NoRoom("full".to_owned()).about(), None);
}
