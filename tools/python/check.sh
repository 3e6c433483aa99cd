#!/usr/bin/env bash
# Builds the Python package, installs it into a virtual environment and tests it there: types, stubs,
# behaviour, and other toolkits.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
venv=$root/target/python-venv

# Other toolkits, Ray, readers of the export formats and the rerun SDK: about 600 MB the first time. If they
# can't be installed, the tests that need them are skipped with a message.
toolkits() {
    local pip=("$venv/bin/pip" install --quiet --disable-pip-version-check) wheel version
    wheel=$(echo "$root"/target/wheels/patchlock-*.whl)
    "${pip[@]}" --no-compile "patchlock[export,got10k,ray,rerun,vot] @ file://$wheel" || return
    # The VOT toolkit depends on OpenCV with a GUI, which needs desktop libraries. Replace it by the same
    # version without a GUI and with CSRT.
    version=$("$venv/bin/python" -c \
        'from importlib.metadata import version; print(version("opencv-python"))') || return
    "${pip[@]}" --no-deps "opencv-contrib-python-headless==$version"
}

"$here/setup.sh"
[ -x "$venv/bin/pytest" ] || exit 0 # setup.sh has printed the reason
if ! toolkits; then
    if [ "${PATCHLOCK_PYTHON:-}" = required ]; then
        echo "other toolkits are required, but could not be installed" >&2
        exit 1
    fi
    echo "SKIPPED, tests with other toolkits, which could not be installed"
fi

# In this folder Python finds the installed package, not the sources in python/.
cd "$root/crates/patchlock-py"
"$venv/bin/python" -m mypy --package patchlock
"$venv/bin/python" -m mypy.stubtest patchlock._patchlock --mypy-config-file pyproject.toml
"$venv/bin/python" -m pytest --quiet tests
"$here/docs.sh"
