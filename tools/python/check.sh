#!/usr/bin/env bash
# Builds the Python package into a virtual environment and runs its tests from there: types, stubs, behaviour, and other people's toolkits.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
venv=$root/target/python-venv

# Other people's toolkits, Ray, the readers of exports and the SDK of rerun: about 600 MB the first time. Where they can't be had, the tests that need them say that they were skipped.
toolkits() {
    local pip=("$venv/bin/pip" install --quiet --disable-pip-version-check) version
    "${pip[@]}" --no-compile "patchlock[export,got10k,ray,rerun,vot] @ file://$(echo "$root"/target/wheels/patchlock-*.whl)" || return
    # The VOT toolkit brings OpenCV with windows, which needs libraries of a desktop. The same version without windows, and with CSRT, takes its place.
    version=$("$venv/bin/python" -c 'from importlib.metadata import version; print(version("opencv-python"))') || return
    "${pip[@]}" --no-deps "opencv-contrib-python-headless==$version"
}

"$here/setup.sh"
[ -x "$venv/bin/pytest" ] || exit 0 # setup.sh said why
if ! toolkits; then
    if [ "${PATCHLOCK_PYTHON:-}" = required ]; then
        echo "other people's toolkits are required, but could not be installed" >&2
        exit 1
    fi
    echo "SKIPPED, tests with other people's toolkits: these could not be installed"
fi

# From the package's own folder, so that what is tested is what is installed and not the source beside it.
cd "$root/crates/patchlock-py"
"$venv/bin/python" -m mypy --package patchlock
"$venv/bin/python" -m mypy.stubtest patchlock._patchlock --mypy-config-file pyproject.toml
"$venv/bin/python" -m pytest --quiet tests
"$here/docs.sh"
