use std::os::unix::fs::{PermissionsExt, chown, symlink};

use super::*;

/// A user who is neither root nor the user of the tests.
const STRANGER: u32 = 12_345;

fn mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

fn mode_of(path: &Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o7777
}

/// Creates a directory that only the current user can write to, with a file in it.
fn place() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    std::fs::write(&file, "ours").unwrap();
    mode(&file, 0o644);
    (dir, file)
}

fn why(result: Result<Vec<u8>, TrustError>) -> (PathBuf, Foreign) {
    match result {
        Err(TrustError::Foreign { at, why, .. }) => (at, why),
        other => panic!("{other:?}"),
    }
}

/// Checks whether the tests can give files to another user here.
fn may_give_away() -> bool {
    let is_root = rustix::process::geteuid().is_root();
    if !is_root {
        eprintln!("SKIPPED: only root can make files of another user");
    }
    is_root
}

#[test]
fn file_of_the_current_user_is_read() {
    let (dir, file) = place();
    assert_eq!(read(&file, 4).unwrap(), b"ours");
    let too_large = read(&file, 3).unwrap_err();
    assert!(
        matches!(too_large, TrustError::Io { source, .. } if source.kind() == io::ErrorKind::FileTooLarge)
    );
    symlink("file", dir.path().join("link")).unwrap();
    symlink(dir.path(), dir.path().join("around")).unwrap();
    for way in ["link", "around/link", "around/around/../", "./around/file"] {
        let path = dir.path().join(way);
        let end = match way.ends_with("../") {
            // The path leads out of the directory and into it again.
            true => path.join(dir.path().file_name().unwrap()).join("file"),
            false => path,
        };
        assert_eq!(read(&end, 100).unwrap(), b"ours", "{way}");
    }
    look_at_file(&file).unwrap();
    directory(dir.path()).unwrap();
    directory(Path::new("/")).unwrap();
    assert!(read(&dir.path().join("none"), 100).unwrap_err().is_absent());
    assert!(read(&file.join("below"), 100).is_err());
    symlink("circle", dir.path().join("circle")).unwrap();
    assert!(read(&dir.path().join("circle"), 100).is_err());
}

#[test]
fn file_writable_by_others_is_not_trusted() {
    let (dir, file) = place();
    mode(&file, 0o666);
    assert_eq!(why(read(&file, 100)), (file.clone(), Foreign::World(0o666)));
    assert!(look_at_file(&file).is_err());
    mode(&file, 0o644);
    mode(dir.path(), 0o777);
    let (at, reason) = why(read(&file, 100));
    assert_eq!((&*at, reason), (dir.path(), Foreign::World(0o777)));
    assert!(directory(dir.path()).is_err());
    // In such a directory the user's own files stay safe, but others can add files beside them.
    mode(dir.path(), 0o1777);
    assert_eq!(read(&file, 100).unwrap(), b"ours");
    let said = directory(dir.path()).unwrap_err().to_string();
    let below = format!(
        "directory of your own below it ({}/NAME)",
        dir.path().display()
    );
    assert!(
        said.contains(&below) && !said.contains("chmod +t"),
        "{said}"
    );
    assert!(directory(&dir.path().join(".")).is_err());
}

#[test]
fn special_file_is_not_opened() {
    let (dir, _) = place();
    let pipe = dir.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    assert_eq!(why(read(&pipe, 100)), (pipe, Foreign::Special));
    assert!(read(dir.path(), 100).is_err());
}

#[test]
fn only_a_private_group_may_write() {
    let (dir, file) = place();
    mode(&file, 0o664);
    let us = rustix::process::geteuid().as_raw();
    let group = std::os::unix::fs::MetadataExt::gid(&std::fs::metadata(&file).unwrap());
    let is_private = group == 0 || group == us;
    assert_eq!(read(&file, 100).is_ok(), is_private, "group {group}");
    if may_give_away() {
        chown(&file, None, Some(STRANGER)).unwrap();
        let wrong = Foreign::Group(0o664, STRANGER);
        assert_eq!(why(read(&file, 100)), (file.clone(), wrong));
        chown(dir.path(), None, Some(STRANGER)).unwrap();
        mode(&file, 0o644);
        mode(dir.path(), 0o2770);
        assert_eq!(why(read(&file, 100)).0, dir.path());
        mode(dir.path(), 0o3770);
        assert_eq!(read(&file, 100).unwrap(), b"ours");
    }
}

#[test]
fn file_of_another_user_is_not_trusted() {
    if !may_give_away() {
        return;
    }
    let (dir, file) = place();
    let theirs = Foreign::Owner(STRANGER);
    chown(&file, Some(STRANGER), None).unwrap();
    assert_eq!(why(read(&file, 100)), (file.clone(), theirs));
    chown(&file, Some(0), None).unwrap();
    // Another user's link leads to the user's own file now, but may lead elsewhere later.
    let link = dir.path().join("link");
    symlink(&file, &link).unwrap();
    std::os::unix::fs::lchown(&link, Some(STRANGER), None).unwrap();
    assert_eq!(why(read(&link, 100)), (link, theirs));
    // A link of the current user leads to a file of another user.
    let below = dir.path().join("below");
    std::fs::create_dir(&below).unwrap();
    chown(&below, Some(STRANGER), None).unwrap();
    std::fs::write(below.join("file"), "ours").unwrap();
    let ours = dir.path().join("ours");
    symlink("below/file", &ours).unwrap();
    assert_eq!(why(read(&ours, 100)), (below.clone(), theirs));
    let said = read(&ours, 100).unwrap_err().to_string();
    assert!(
        said.contains("chown 0") && said.contains("docker run --user 12345"),
        "{said}"
    );
    // In a directory that everybody can write to, the files of others stay theirs.
    mode(dir.path(), 0o1777);
    assert!(make_directory(&below.join("more")).is_err());
    assert!(!below.join("more").exists(), "nothing is created in it");
}

#[test]
fn missing_directory_is_created_unwritable_by_others() {
    let (dir, _) = place();
    symlink("behind", dir.path().join("link")).unwrap();
    let deep = dir.path().join("link/a/b");
    make_directory(&deep).unwrap();
    assert!(dir.path().join("behind/a/b").is_dir());
    make_directory(&deep).unwrap();
    assert_eq!(mode_of(&deep) & 0o022, 0);
    assert!(make_directory(&dir.path().join("file")).is_err());
}

#[test]
fn private_directory_is_owned_and_closed() {
    let (dir, _) = place();
    let fresh = dir.path().join("run/one");
    make_private_directory(&fresh).unwrap();
    assert_eq!(mode_of(&fresh), 0o700);
    mode(&fresh, 0o755);
    make_private_directory(&fresh).unwrap();
    assert_eq!(mode_of(&fresh), 0o700, "the directory is private again");
    if !may_give_away() {
        return;
    }
    // Another user plants a link to a directory that does not belong to the current user.
    mode(dir.path(), 0o1777);
    let (target, link) = (dir.path().join("target"), dir.path().join("link"));
    std::fs::create_dir(&target).unwrap();
    mode(&target, 0o755);
    symlink(&target, &link).unwrap();
    std::os::unix::fs::lchown(&link, Some(STRANGER), None).unwrap();
    assert!(make_private_directory(&link).is_err());
    assert_eq!(
        mode_of(&target),
        0o755,
        "the target of the link is unchanged"
    );
    chown(&target, Some(STRANGER), None).unwrap();
    assert!(make_private_directory(&target).is_err());
    assert_eq!(
        mode_of(&target),
        0o755,
        "a directory of another user is unchanged"
    );
}
