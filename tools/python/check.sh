#!/usr/bin/env bash
# Builds the Python package into a virtual environment and runs its tests from there: types, stubs, behaviour.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
venv=$(cd "$here/../.." && pwd)/target/python-venv

"$here/setup.sh"
[ -x "$venv/bin/pytest" ] || exit 0 # setup.sh said why

# From the package's own folder, so that what is tested is what is installed and not the source beside it.
cd "$here/../../crates/patchlock-py"
"$venv/bin/python" -m mypy --package patchlock
"$venv/bin/python" -m mypy.stubtest patchlock --mypy-config-file pyproject.toml
"$venv/bin/python" -m pytest --quiet tests
