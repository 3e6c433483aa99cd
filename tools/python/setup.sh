#!/usr/bin/env bash
# Builds the wheel of the Python package and installs it, with the requirements of its tests, into the virtual
# environment target/python-venv. Arguments are extras to install besides `test`, as in
# `tools/python/setup.sh got10k export`.
# Without Python or a network it prints SKIPPED; with PATCHLOCK_PYTHON=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=$PWD/target/python-venv
wheels=$PWD/target/wheels

tools/python/prepare.sh test "$@"
[ -x "$venv/bin/maturin" ] || exit 0 # prepare.sh has printed the reason
rm -rf "$wheels"
"$venv/bin/maturin" build --quiet --release --locked \
    --manifest-path crates/patchlock-py/Cargo.toml --interpreter "$venv/bin/python" --out "$wheels"
wheel=$(echo "$wheels"/patchlock-*.whl)
"$venv/bin/pip" install --quiet --disable-pip-version-check --force-reinstall --no-deps "$wheel"
echo "installed $(basename "$wheel") in $venv"
