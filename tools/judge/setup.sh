#!/usr/bin/env bash
# Creates the virtual environment of the independent judge, target/judge-venv, if it does not exist. Without
# Python or a network it prints SKIPPED, and the tests compare only with golden files; with
# PATCHLOCK_JUDGE=required it fails.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
venv=$(cd "$here/../.." && pwd)/target/judge-venv

skip() {
    if [ "${PATCHLOCK_JUDGE:-}" = required ]; then
        echo "the independent judge is required, but $1" >&2
        exit 1
    fi
    echo "SKIPPED, the independent judge is not available: $1"
    exit 0
}

if cmp -s "$here/requirements.txt" "$venv/requirements.txt"; then
    echo "already exists: $venv"
    exit 0
fi
python=${PYTHON:-python3}
command -v "$python" >/dev/null || skip "there is no $python"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    skip "$("$python" --version) is older than 3.11"
mkdir -p "$(dirname "$venv")"
"$python" -m venv --clear "$venv" || skip "$python can't create a virtual environment"
# Source packages are built with these pinned versions of wheel and setuptools, without build isolation, which
# would download unpinned ones.
"$venv/bin/pip" install --quiet "$(grep ^setuptools "$here/requirements.txt")" wheel==0.45.1 &&
    "$venv/bin/pip" install --quiet --no-build-isolation --requirement "$here/requirements.txt" ||
    skip "its packages could not be installed"
cp "$here/requirements.txt" "$venv/requirements.txt"
echo "created $venv"
