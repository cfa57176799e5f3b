//! Programs that tests install. Other processes write them. If this process had a program open for
//! writing, a child of another test could inherit it, and the program could not be run ("text file
//! busy").

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Copies a program.
pub fn copy_program(from: &Path, to: &Path) {
    let copied = Command::new("cp").arg(from).arg(to).status();
    assert!(
        copied.unwrap().success(),
        "{} must be copied",
        from.display()
    );
}

/// Writes an executable script, in place if it exists.
pub fn write_script(path: &Path, text: &str) {
    let mut writer = Command::new("sh")
        .args(["-c", "cat > \"$0\" && chmod 755 \"$0\""])
        .arg(path)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = writer.stdin.take().unwrap();
    stdin.write_all(text.as_bytes()).unwrap();
    drop(stdin);
    assert!(writer.wait().unwrap().success(), "{}", path.display());
}

/// Puts an executable script at a path in one step, as an installation of a newer program does.
pub fn install_script(path: &Path, text: &str) {
    let aside = path.with_extension("new");
    write_script(&aside, text);
    std::fs::rename(&aside, path).unwrap();
}

/// Returns the exit code and the whole output of a command.
pub fn told(said: &Output) -> (Option<i32>, String) {
    let text = [&*said.stdout, &*said.stderr].concat();
    (said.status.code(), String::from_utf8(text).unwrap())
}
