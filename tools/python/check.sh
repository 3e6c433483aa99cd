#!/usr/bin/env bash
# Builds the Python package, installs it into a virtual environment and tests it there: types, stubs,
# behaviour, and other toolkits. `check.sh short` tests only the behaviour, without slow tests, and installs no
# toolkits; it writes the stubs again, which the whole form only compares.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
venv=$root/target/python-venv

if [ "${1-}" = short ]; then
    "$here/setup.sh"
    [ -x "$venv/bin/pytest" ] || exit 0 # prepare.sh has printed the reason
    "$venv/bin/python" "$here/stubs.py"
    cd "$root/crates/patchlock-py"
    exec "$venv/bin/python" -m pytest --quiet tests
fi

# Other toolkits, Ray, onnxruntime and onnx, readers of the export formats and the rerun SDK, and what builds the
# documentation.
"$here/setup.sh" export got10k onnxruntime oracles ray rerun vot docs
[ -x "$venv/bin/pytest" ] || exit 0 # prepare.sh has printed the reason

# In this folder Python finds the installed package, not the sources in python/.
cd "$root/crates/patchlock-py"
"$venv/bin/python" -m mypy --package patchlock
"$venv/bin/python" -m mypy.stubtest patchlock._patchlock --mypy-config-file pyproject.toml
"$venv/bin/python" -m pytest --quiet tests
"$here/docs.sh"
"$here/network.sh"
