#!/usr/bin/env bash
# Builds the wheel of the Python package and installs it, with the requirements of its tests, into the virtual
# environment target/python-venv. Arguments are extras to install besides `test`, as in
# `tools/python/setup.sh got10k export`. Without Python or a network it prints SKIPPED; with
# PATCHLOCK_PYTHON=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=$PWD/target/python-venv
wheels=$PWD/target/wheels
extras=$(IFS=,; echo "test${*:+,$*}")

skip() {
    rm -rf "$venv"
    if [ "${PATCHLOCK_PYTHON:-}" = required ]; then
        echo "the Python package is required, but $1" >&2
        exit 1
    fi
    echo "SKIPPED, the Python package is not built: $1"
    exit 0
}

python=${PYTHON:-python3}
command -v "$python" >/dev/null || skip "there is no $python"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' ||
    skip "$("$python" --version) is older than 3.10"
if [ ! -x "$venv/bin/maturin" ] || ! cmp -s tools/python/requirements.txt "$venv/requirements.txt"; then
    "$python" -m venv --clear "$venv" || skip "$python can't create a virtual environment"
    "$venv/bin/pip" install --quiet --disable-pip-version-check --requirement tools/python/requirements.txt ||
        skip "maturin could not be installed"
    cp tools/python/requirements.txt "$venv/requirements.txt"
fi
rm -rf "$wheels"
"$venv/bin/maturin" build --quiet --release --locked --manifest-path crates/patchlock-py/Cargo.toml \
    --interpreter "$venv/bin/python" --out "$wheels"
wheel=$(echo "$wheels"/patchlock-*.whl)
"$venv/bin/pip" install --quiet --disable-pip-version-check --force-reinstall --no-deps "$wheel"
"$venv/bin/pip" install --quiet --disable-pip-version-check "patchlock[$extras] @ file://$wheel" ||
    skip "the requirements of its tests could not be installed"
echo "installed $(basename "$wheel") in $venv"
