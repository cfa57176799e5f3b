//! File descriptors: limits the open files, sockets and mappings of the broker and derives the
//! maximum number of peers. Thus late peers cannot use up the descriptors that the broker needs.

use qcbus_environment::is_simulated;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Descriptors of one peer: its services, ports and connections on the bus (22 were counted). A few
/// more are needed while it joins and leaves.
const PER_PEER: u64 = 26;
/// Descriptors for all other purposes: the bus, the journal, I/O threads and commands.
const FOR_THE_REST: u64 = 448;
/// Minimum number of descriptors for the start of the bus.
const FOR_THE_BUS: u64 = 64;
/// Maximum number of descriptors. More are useless, and some programs iterate over all permitted descriptors.
const ENOUGH: u64 = 1 << 16;

/// Limits of the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Descriptors {
    /// Maximum number of open descriptors.
    pub allowed: u64,
    /// Former limit for the programs that the broker starts, because some cannot handle a higher one.
    pub before: Option<Rlimit>,
}

impl Descriptors {
    /// Raises the limit as far as this process is allowed to.
    pub fn take() -> Descriptors {
        let before = getrlimit(Resource::Nofile);
        if is_simulated() {
            return Descriptors {
                allowed: ENOUGH,
                before: None,
            };
        }
        // An unlimited number is treated as the maximum.
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

    /// Raises the limit and reduces the maximum number of peers to it. Returns the notice for a reduced number.
    pub fn for_peers(most: &mut usize) -> (Descriptors, Option<String>) {
        let descriptors = Descriptors::take();
        let (peers, limited) = descriptors.peers(*most);
        *most = peers;
        // The bus may fail to start with so few descriptors, and its error would not state the reason.
        if let Some(said) = limited
            .as_ref()
            .filter(|_| descriptors.allowed < FOR_THE_BUS)
        {
            tracing::warn!("{said}");
        }
        (descriptors, limited)
    }

    /// Returns the number of peers that the descriptors are sufficient for, up to the wanted
    /// number. Also returns the notice for a reduced number.
    pub fn peers(&self, wanted: usize) -> (usize, Option<String>) {
        let fit = self.allowed.saturating_sub(FOR_THE_REST) / PER_PEER;
        // A broker is useless without its standard bundles and a reporter.
        let fit = usize::try_from(fit).unwrap_or(usize::MAX);
        if fit >= wanted {
            return (wanted, None);
        }
        let (allowed, needed) = (self.allowed, FOR_THE_REST + PER_PEER * wanted as u64);
        let so_that = match fit >= FEWEST {
            true => {
                format!("at most {fit} bundles and reporters can join instead of {wanted}")
            }
            false => "possibly not even the standard bundles can join".to_owned(),
        };
        let said = format!(
            "only {allowed} files may be open at once, so {so_that}; raise the limit to {needed} (`ulimit -Hn \
             {needed}`; systemd: LimitNOFILE={needed}; docker: --ulimit nofile={needed})"
        );
        (fit.max(FEWEST), Some(said))
    }
}

const FEWEST: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peer_limit_follows_available_descriptors() {
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
        assert_eq!(
            allowed(64).peers(64).0,
            FEWEST,
            "the minimum is allowed nevertheless"
        );
    }

    #[test]
    fn descriptor_limit_is_raised_to_maximum() {
        let taken = Descriptors::take();
        let now = getrlimit(Resource::Nofile);
        assert!(now.current.is_none_or(|it| it >= taken.allowed));
        assert_eq!(
            Descriptors::take().before,
            None,
            "the limit is already at its maximum"
        );
    }
}
