#!/usr/bin/env bash
# Builds the documentation in target/site with the package installed by setup.sh, and runs the notebooks. Any
# warning is a failure.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=$PWD/target/python-venv

wheel=$(echo "$PWD"/target/wheels/patchlock-*.whl)
if ! "$venv/bin/pip" install --quiet --disable-pip-version-check "patchlock[docs] @ file://$wheel"; then
    [ "${PATCHLOCK_PYTHON:-}" != required ] || exit 1
    echo "SKIPPED, the documentation is not built: its requirements could not be installed"
    exit 0
fi
# The notebooks use the first python in the PATH.
PATH=$venv/bin:$PATH NO_MKDOCS_2_WARNING=1 mkdocs build --quiet --strict
# The page that tracks in the browser needs the module that tools/web/build.sh builds.
if [ -d target/web/site/patchlock ]; then
    cp -r target/web/site/patchlock target/site/try
else
    echo "SKIPPED, the page that tracks in the browser has no module: run tools/web/build.sh first"
fi
# Opened as files, pages that link to a folder would show its listing.
if grep -rnoE 'href="([^":#]*/|\.|\.\.)"' target/site --include='*.html'; then
    echo "these links lead to folders"
    exit 1
fi
# The reference of Rust, beside that of Python.
rust=${CARGO_TARGET_DIR:-target}/doc
if [ -e "$rust/patchlock/index.html" ]; then
    cp -r "$rust" target/site/rust
else
    echo "SKIPPED, the reference of Rust is not beside that of Python: run cargo doc --workspace --no-deps first"
fi
echo "built the documentation in target/site"
