#!/usr/bin/env bash
# Creates the virtual environment target/python-venv and installs all that does not depend on the wheel: what
# builds it, and the requirements of the extras named as arguments. It downloads up to 600 MB and needs little
# else, so `./test` runs it while Rust compiles. Without Python or a network it prints SKIPPED and leaves no
# environment; with PATCHLOCK_PYTHON=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=$PWD/target/python-venv
pip=("$venv/bin/pip" install --quiet --disable-pip-version-check --no-compile)
# uv needs about half of the processor time, but does not read the configuration of pip.
uv=("$venv/bin/uv" pip install --quiet --python "$venv/bin/python")

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
    "${pip[@]}" --requirement tools/python/requirements.txt || skip "maturin and uv could not be installed"
    cp tools/python/requirements.txt "$venv/requirements.txt"
fi
install() {
    "$venv/bin/python" tools/python/requirements.py "$@" >"$venv/extras.txt"
    "${uv[@]}" --requirement "$venv/extras.txt" || "${pip[@]}" --requirement "$venv/extras.txt"
}

if ! install "$@"; then
    [ "${PATCHLOCK_PYTHON:-}" != required ] || skip "the requirements of its extras could not be installed"
    echo "SKIPPED, tests with other toolkits, which could not be installed"
    install test || skip "the requirements of its tests could not be installed"
    exit 0
fi
# The VOT toolkit depends on OpenCV with a GUI, which needs desktop libraries. Replace it by the same version
# without a GUI and with CSRT.
if [[ " $* " == *" vot "* ]]; then
    version=$("$venv/bin/python" -c \
        'from importlib.metadata import version; print(version("opencv-python"))')
    "${pip[@]}" --no-deps "opencv-contrib-python-headless==$version"
fi
