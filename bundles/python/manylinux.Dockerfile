# Container that builds wheels for old systems: glibc 2.28 and later (Debian 10, RHEL 8, Ubuntu 20.04).
#
#   docker build -f bundles/python/manylinux.Dockerfile -t qcbus-manylinux .
#   docker run --rm -v "$PWD:/src" -e QCBUS_PYTHON=/opt/python/cp312-cp312/bin/python qcbus-manylinux
#
# It writes the wheel to bundles/python/dist. With QCBUS_PYTHON=/opt/python/cp310-cp310/bin/python the wheel works only
# with Python 3.10. Test the installation in an old container:
#
#   docker run --rm -v "$PWD/bundles/python/dist:/dist" python:3.11-slim-bookworm \
#     sh -c 'pip install /dist/*abi3*.whl && qcbus --version && python -c "import qcbus"'
FROM quay.io/pypa/manylinux_2_28_x86_64
ENV CARGO_HOME=/opt/cargo RUSTUP_HOME=/opt/rustup CARGO_TARGET_DIR=/tmp/target PATH="/opt/cargo/bin:${PATH}"
COPY rust-toolchain.toml /tmp/
RUN curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs \
    | sh -s -- -y --profile minimal --default-toolchain "$(sed -n 's/^channel *= *"\(.*\)".*/\1/p' /tmp/rust-toolchain.toml)"
WORKDIR /src
# auditwheel is part of the image. It confirms maturin's platform tag of the wheel.
CMD ["sh", "-c", "bundles/python/wheel bundles/python/dist && auditwheel show bundles/python/dist/*.whl"]
