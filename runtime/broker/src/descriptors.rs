//! How many files, sockets and mappings the broker may have open at once, and for how many peers that is
//! enough: it is bounded here, so that nobody who comes late takes what is needed to go on.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use crate::environment::is_simulated;

/// What one peer takes: its services, ports and connections on the bus (22 were counted), and a few more
/// while it comes and goes.
const PER_PEER: u64 = 26;
/// What everything else takes: the bus, the journal, threads that read and write, commands that ask.
const FOR_THE_REST: u64 = 448;
/// With fewer the bus does not start.
const FOR_THE_BUS: u64 = 64;
/// More is of no use, and some programs walk through all that they may have.
const ENOUGH: u64 = 1 << 16;

/// What the system allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Descriptors {
    /// Open at once.
    pub allowed: u64,
    /// What was allowed before, for the programs that the broker starts: some cannot do with more.
    pub before: Option<Rlimit>,
}

impl Descriptors {
    /// Takes as many as this process may give itself.
    pub fn take() -> Descriptors {
        let before = getrlimit(Resource::Nofile);
        if is_simulated() {
            return Descriptors {
                allowed: ENOUGH,
                before: None,
            };
        }
        // No limit at all is none that matters here.
        let now = before.current.unwrap_or(ENOUGH);
        let wanted = before.maximum.map_or(ENOUGH, |most| most.min(ENOUGH));
        if wanted <= now {
            return Descriptors {
                allowed: now,
                before: None,
            };
        }
        let raised = Rlimit {
            current: Some(wanted),
            ..before
        };
        match setrlimit(Resource::Nofile, raised) {
            Ok(()) => Descriptors {
                allowed: wanted,
                before: Some(before),
            },
            Err(_) => Descriptors {
                allowed: now,
                before: None,
            },
        }
    }

    /// As many as may be had; peers that there are none for are not let in, and what is to be said then.
    pub fn for_peers(most: &mut usize) -> (Descriptors, Option<String>) {
        let descriptors = Descriptors::take();
        let (peers, limited) = descriptors.peers(*most);
        *most = peers;
        // The bus may not even start with so few, and its error would not say why.
        if let Some(said) = limited
            .as_ref()
            .filter(|_| descriptors.allowed < FOR_THE_BUS)
        {
            tracing::warn!("{said}");
        }
        (descriptors, limited)
    }

    /// For how many peers they are enough, of so many that are wanted, and what is to be said when these
    /// are fewer.
    pub fn peers(&self, wanted: usize) -> (usize, Option<String>) {
        let fit = self.allowed.saturating_sub(FOR_THE_REST) / PER_PEER;
        // Without its standard bundles and a reporter a broker is of no use.
        let fit = usize::try_from(fit).unwrap_or(usize::MAX);
        if fit >= wanted {
            return (wanted, None);
        }
        let (allowed, needed) = (self.allowed, FOR_THE_REST + PER_PEER * wanted as u64);
        let so_that = match fit >= FEWEST {
            true => {
                format!("no more than {fit} bundles and reporters can join instead of {wanted}")
            }
            false => "not even the standard bundles may be able to join".to_owned(),
        };
        let said = format!(
            "only {allowed} files may be open at once, so that {so_that}; raise the limit to {needed} \
             (`ulimit -Hn {needed}`; systemd: LimitNOFILE={needed}; docker: --ulimit nofile={needed})"
        );
        (fit.max(FEWEST), Some(said))
    }
}

const FEWEST: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_peers_are_let_in_as_there_are_descriptors_for() {
        let allowed = |allowed| Descriptors {
            allowed,
            before: None,
        };
        assert_eq!(allowed(1 << 16).peers(64), (64, None));
        let (peers, said) = allowed(1024).peers(64);
        assert_eq!(peers, 22);
        let said = said.unwrap();
        assert!(
            said.starts_with("only 1024 files may be open at once"),
            "{said}"
        );
        assert!(said.contains("LimitNOFILE=2112"), "{said}");
        assert_eq!(allowed(64).peers(64).0, FEWEST, "it is tried all the same");
    }

    #[test]
    fn what_may_be_had_is_taken() {
        let taken = Descriptors::take();
        let now = getrlimit(Resource::Nofile);
        assert!(now.current.is_none_or(|it| it >= taken.allowed));
        assert_eq!(Descriptors::take().before, None, "there is no more");
    }
}
