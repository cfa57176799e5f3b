# Common commands. Each recipe is a command that also works without `just`.

# List the recipes.
default:
    @just --list

# Run all checks that must pass before a change is merged, as CI does.
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

# Check the sample farm. The exit code is 1, because the farm has faulty files.
farm:
    cargo run --release -- check tests/farm

# Test the pages of the HTML report in Chromium, including those of the sample farm; needs node and npm.
browser:
    cargo build -p qcbus
    -target/debug/qcbus check tests/farm --quiet --out target/pages/out --output-format html=target/pages/farm.html
    reporters/html/browser/run target/pages

# Build the wheel of the Python package with the program `qcbus`; needs Python.
wheel *ARGS:
    bundles/python/wheel {{ARGS}}

# Build the wheel, install it into an empty environment and test it there; needs Python.
python *ARGS:
    bundles/python/run-tests {{ARGS}}

# Compare times with a rival; QCBUS_RIVAL has its command line: 'PROGRAM ARGS {}'.
bench-rivals *ARGS:
    cargo build --release -p qcbus
    python3 tests/rivals.py {{ARGS}}

# Compare the instructions of the hot paths with the stored ones; needs valgrind. QCBUS_BLESS=1 stores the new ones.
figures:
    cargo bench -p qcbus-benches --bench instructions

# Check advisories, licences and bans of dependencies; needs cargo-deny.
deny:
    cargo deny --all-features check

# Build the documentation of all our crates.
doc:
    cargo doc --workspace --no-deps --open
