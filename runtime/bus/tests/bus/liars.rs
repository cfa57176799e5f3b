//! Peers that make false statements about themselves.

use std::time::Duration;

use qcbus_bus::{Claims, Host, HostEvent, HostOptions, JoinError, Peer, PeerOptions};
use qcbus_messages::{Hello, PROTOCOL_VERSION};

use crate::support::{Site, hello, watched, welcome};

const PATIENT: PeerOptions = PeerOptions {
    patience: Duration::from_secs(60),
    grace: Duration::from_secs(60),
    rejoins: true,
};

#[tokio::test]
async fn kernel_determines_the_process_of_a_peer() {
    watched(async {
        let site = Site::new();
        let mut host = Host::start(&site.instance, HostOptions::default()).unwrap();
        let liar = Hello {
            pid: 1,
            ..hello("liar")
        };
        let joining = Peer::join_claiming(Claims::default(), &site.instance, liar, PATIENT);
        tokio::pin!(joining);
        let joined = loop {
            tokio::select! {
                joined = &mut joining => break joined,
                event = host.next() => if let HostEvent::Hello { peer, hello, process, .. } = event {
                    assert_eq!(hello.pid, std::process::id());
                    assert_eq!(process.unwrap().id(), std::process::id());
                    let welcome = welcome(&host);
                    host.accept(peer, &welcome);
                },
            }
        };
        joined.unwrap();
    })
    .await;
}

#[tokio::test]
async fn peer_without_proof_is_refused_and_others_still_join() {
    watched(async {
        let site = Site::new();
        let mut host = Host::start(&site.instance, HostOptions::default()).unwrap();
        let claims = Claims {
            protocol: PROTOCOL_VERSION,
            proves: false,
        };
        let stranger = Peer::join_claiming(claims, &site.instance, hello("str\nange"), PATIENT);
        let honest = Peer::join(&site.instance, hello("honest"), PATIENT);
        let (mut joined, mut refused, mut said) = (None, None, None);
        tokio::pin!(stranger, honest);
        while joined.is_none() || refused.is_none() || said.is_none() {
            tokio::select! {
                it = &mut honest, if joined.is_none() => joined = Some(it.unwrap()),
                it = &mut stranger, if refused.is_none() => refused = it.err(),
                event = host.next() => match event {
                    HostEvent::Hello { peer, hello, .. } => {
                        assert_eq!(hello.name, "honest");
                        let welcome = welcome(&host);
                        host.accept(peer, &welcome);
                    }
                    HostEvent::TurnedAway { why } => said = Some(why),
                    other => panic!("{other:?}"),
                },
            }
        }
        let Some(JoinError::Refused(why)) = refused else {
            panic!("{refused:?}");
        };
        assert_eq!(Some(&why), said.as_ref());
        assert!(why.contains("`str\\nange`: it has not proven"), "{why}");
    })
    .await;
}
