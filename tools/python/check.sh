#!/usr/bin/env bash
# Builds the Python package into a virtual environment and runs its tests from there: types, stubs, behaviour.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
venv=$(cd "$here/../.." && pwd)/target/python-venv

"$here/setup.sh" got10k vot
[ -x "$venv/bin/pytest" ] || exit 0 # setup.sh said why
# The VOT toolkit brings OpenCV with windows, which needs libraries of a desktop. The same version without windows takes its place.
version=$("$venv/bin/python" -c 'from importlib.metadata import version; print(version("opencv-python"))')
"$venv/bin/pip" install --quiet --disable-pip-version-check --no-deps "opencv-python-headless==$version"

# From the package's own folder, so that what is tested is what is installed and not the source beside it.
cd "$here/../../crates/patchlock-py"
"$venv/bin/python" -m mypy --package patchlock
"$venv/bin/python" -m mypy.stubtest patchlock --mypy-config-file pyproject.toml
"$venv/bin/python" -m pytest --quiet tests
