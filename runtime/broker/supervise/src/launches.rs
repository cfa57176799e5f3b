//! Proof that a broker of this instance started a process, and under which name.
//!
//! Every start gets a proof in its environment, which other users cannot read. The proof contains
//! the launch, a digest with the instance's secret, and the name. The secret stays in the
//! instance's directory while a later broker may need to recognise the children of its predecessor.

use std::io::Write;
use std::path::{Path, PathBuf};

use qcbus_bus::LAUNCH;
use qcbus_disk::trust;
use qcbus_types::Launch;
use sha2::{Digest, Sha256};

/// Name of the file with the secret.
const FILE: &str = "launches";
/// Size of the secret in bytes.
const SECRET: usize = 32;

/// Creates and verifies the proofs of an instance.
#[derive(Clone)]
pub struct Launches {
    secret: [u8; SECRET],
    path: PathBuf,
}

impl std::fmt::Debug for Launches {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Launches").finish_non_exhaustive()
    }
}

impl Launches {
    /// Returns the proofs of the instance with this directory. Creates the secret if it is missing.
    ///
    /// # Errors
    /// When the secret cannot be created.
    pub fn of(instance_dir: &Path) -> std::io::Result<Launches> {
        let path = instance_dir.join(FILE);
        let kept = trust::read(&path, SECRET as u64);
        if let Some(secret) = kept.ok().and_then(|it| it.try_into().ok()) {
            return Ok(Launches { secret, path });
        }
        let mut secret = [0; SECRET];
        let mut empty = &mut secret[..];
        while !empty.is_empty() {
            let flags = rustix::rand::GetRandomFlags::empty();
            let filled = rustix::rand::getrandom(&mut *empty, flags)?;
            empty = &mut empty[filled..];
        }
        // Only the owner can read temporary files.
        let mut file = tempfile::NamedTempFile::new_in(instance_dir)?;
        file.write_all(&secret)?;
        file.persist(&path)?;
        Ok(Launches { secret, path })
    }

    /// Returns the proof for the environment of a process with this name.
    pub fn proof(&self, launch: Launch, name: &str) -> String {
        let mut hash = Sha256::new();
        hash.update(self.secret);
        hash.update(launch.0.to_le_bytes());
        hash.update(name);
        let digest: String = hash
            .finalize()
            .iter()
            .map(|it| format!("{it:02x}"))
            .collect();
        format!("{}:{digest}:{name}", launch.0)
    }

    /// Returns the launch and the name of a valid proof, or `None` if it was not created here.
    pub fn proven<'p>(&self, proof: &'p str) -> Option<(Launch, &'p str)> {
        let (launch, rest) = proof.split_once(':')?;
        let (_, name) = rest.split_once(':')?;
        let launch = Launch(launch.parse().ok()?);
        let expected = self.proof(launch, name);
        // The comparison takes constant time, wherever the proofs differ.
        let differing = |(a, b): (u8, u8)| a ^ b;
        let differs = expected.bytes().zip(proof.bytes()).map(differing);
        let differs = differs.fold(0, |all, it| all | it);
        (expected.len() == proof.len() && differs == 0).then_some((launch, name))
    }

    /// Returns the launch of a local process by its environment, or `None` without a valid proof.
    pub fn of_process(&self, id: u32) -> Option<Launch> {
        let environment = Path::new("/proc").join(id.to_string()).join("environ");
        let environment = std::fs::read(environment).ok()?;
        let mut variables = environment.split(|byte| *byte == 0);
        let proof =
            variables.find_map(|it| it.strip_prefix(LAUNCH.as_bytes())?.strip_prefix(b"="))?;
        let (launch, _) = self.proven(std::str::from_utf8(proof).ok()?)?;
        Some(launch)
    }

    /// Removes the secret, so existing proofs become invalid.
    pub fn forget(&self) {
        // The directory may have been removed already.
        let _ = qcbus_disk::remove(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launch_proof_is_bound_to_start_and_name() {
        let dir = tempfile::tempdir().unwrap();
        let one = Launches::of(dir.path()).unwrap();
        let proof = one.proof(Launch(7), "xodrBundle");
        let next = Launches::of(dir.path()).unwrap();
        assert_eq!(next.proven(&proof), Some((Launch(7), "xodrBundle")));
        let lies = [
            proof.replace("7:", "8:"),
            proof.replace("xodr", "xosc"),
            format!("{proof}x"),
            proof[..proof.len() - 1].to_owned(),
            "7::xodrBundle".to_owned(),
            String::new(),
        ];
        for lie in lies {
            assert_eq!(next.proven(&lie), None, "{lie}");
        }
        next.forget();
        let other = Launches::of(dir.path()).unwrap();
        assert_eq!(
            other.proven(&proof),
            None,
            "a proof for another instance is invalid"
        );
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::metadata(dir.path().join(FILE))
            .unwrap()
            .permissions()
            .mode();
        assert_eq!(mode & 0o7777, 0o600);
    }
}
