//! A bundle in Python: a script and its examples, without a build step.

use super::Layout;

/// Paths of the files and their templates.
const TEMPLATES: [(&str, &str); 4] = [
    ("README.md", include_str!("python/README.md.in")),
    (".gitignore", include_str!("python/gitignore.in")),
    ("bundle.py", include_str!("python/bundle.py.in")),
    ("test_bundle.py", include_str!("python/test_bundle.py.in")),
];

/// Returns the files of a bundle with this name.
pub(super) fn layout(name: &str) -> Layout {
    // A UID allows letters, digits and underscores between its dots.
    let domain = name.replace(['-', '.'], "_").to_ascii_lowercase();
    let fill = |text: &str| {
        let text = text.replace("{{name}}", name);
        text.replace("{{domain}}", &domain)
    };
    let files = TEMPLATES.iter().map(|(path, text)| (*path, fill(text)));
    Layout {
        files: files.collect(),
        next: format!(
            "  python3 -m qcbus.test bundle.py\n  python3 bundle.py FILE.xodr\n  qcbus bundle add {name} bundle.py"
        ),
    }
}
