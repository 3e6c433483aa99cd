#!/usr/bin/env bash
# Makes the virtual environment of the outside judge, target/judge-venv, if it is not there. Without Python or a network it says so,
# and the tests compare with golden files alone. With PATCHLOCK_JUDGE=required that is a failure.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
venv=$(cd "$here/../.." && pwd)/target/judge-venv

skip() {
    if [ "${PATCHLOCK_JUDGE:-}" = required ]; then
        echo "the outside judge is required, but $1" >&2
        exit 1
    fi
    echo "SKIPPED, there is no outside judge: $1"
    exit 0
}

if cmp -s "$here/requirements.txt" "$venv/requirements.txt"; then
    echo "it is there: $venv"
    exit 0
fi
python=${PYTHON:-python3}
command -v "$python" >/dev/null || skip "there is no $python"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || skip "$("$python" --version) is older than 3.11"
mkdir -p "$(dirname "$venv")"
"$python" -m venv --clear "$venv" || skip "$python can make no virtual environment"
# wheel and setuptools build what comes as source; they are the environment's own, so that nothing unpinned is fetched for that.
"$venv/bin/pip" install --quiet "$(grep ^setuptools "$here/requirements.txt")" wheel==0.45.1 &&
    "$venv/bin/pip" install --quiet --no-build-isolation --requirement "$here/requirements.txt" ||
    skip "its packages could not be installed"
cp "$here/requirements.txt" "$venv/requirements.txt"
echo "made $venv"
