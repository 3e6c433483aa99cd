#!/usr/bin/env bash
# Builds the documentation into target/site with the package that setup.sh installed; the notebooks are run on the way. Any warning is a failure.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=$PWD/target/python-venv

if ! "$venv/bin/pip" install --quiet --disable-pip-version-check "patchlock[docs] @ file://$(echo "$PWD"/target/wheels/patchlock-*.whl)"; then
    [ "${PATCHLOCK_PYTHON:-}" != required ] || exit 1
    echo "SKIPPED, the documentation is not built: what it needs could not be installed"
    exit 0
fi
# The notebooks' kernel is the first python that is found.
PATH=$venv/bin:$PATH NO_MKDOCS_2_WARNING=1 mkdocs build --quiet --strict
echo "built the documentation in target/site"
