# What people type. Each recipe is one command that can be typed without `just` as well.

# List the recipes.
default:
    @just --list

# Everything that must hold before a change is merged: what CI runs.
ready:
    .ci/run

# Format all code.
fmt:
    cargo fmt --all

# Check with clippy, warnings denied.
lint:
    cargo clippy --workspace --all-targets -- -D warnings

# Run all tests.
test *ARGS:
    cargo test --workspace {{ARGS}}

# Rewrite snapshots and the expected issues of rule pages; review the difference before committing.
bless:
    INSTA_UPDATE=always QCBUS_BLESS=1 cargo test --workspace

# Check the sample farm; ends with exit code 1, because of its faulty files.
farm:
    cargo run --release -- check tests/farm

# Try the pages of the HTML report in Chromium, those of the sample farm among them; needs node and npm.
browser:
    cargo build -p qcbus
    -target/debug/qcbus check tests/farm --quiet --out target/pages/out --output-format html=target/pages/farm.html
    reporters/html/browser/run target/pages

# Make the wheel of the Python package, with the program `qcbus` in it; needs Python.
wheel *ARGS:
    bundles/python/wheel {{ARGS}}

# Make it, install it into an empty environment and test it there; needs Python.
python *ARGS:
    bundles/python/run-tests {{ARGS}}

# Times beside a rival, whose command line is in QCBUS_RIVAL: 'PROGRAM ARGS {}'.
bench-rivals *ARGS:
    cargo build --release -p qcbus
    python3 tests/rivals.py {{ARGS}}

# Instructions of the hot paths beside the last ones; needs valgrind. QCBUS_BLESS=1 keeps the new ones.
figures:
    cargo bench -p qcbus-benches --bench instructions

# Advisories, licences and bans of dependencies; needs cargo-deny.
deny:
    cargo deny --all-features check

# Documentation of all our crates.
doc:
    cargo doc --workspace --no-deps --open
