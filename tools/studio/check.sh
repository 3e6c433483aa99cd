#!/usr/bin/env bash
# Tests the page of `patchlock studio`: format, types, and what a person does with it, in Chromium and with
# the program built for release. Arguments are handed to Playwright: `tools/studio/check.sh camera` runs one file, and
# `PATCHLOCK_SCREENSHOTS=1 tools/studio/check.sh screenshots` writes the pictures of docs/.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)

"$here/prepare.sh"
[ -x "$here/node_modules/.bin/playwright" ] || exit 0 # prepare.sh has printed the reason

cd "$root"
program=${PATCHLOCK:-${CARGO_TARGET_DIR:-target}/release/patchlock}
[ -x "$program" ] || cargo build --quiet --release --locked -p patchlock-cli
cd "$here"
page=../../crates/patchlock-studio/src/page
window=../../crates/patchlock-studio/src/window
node_modules/.bin/prettier --config .prettierrc.json --log-level warn --check \
    "$page/*.{mjs,css,html,d.ts}" "$window/*.{mjs,css,html}" 'tests/*.mjs' '*.mjs'
node_modules/.bin/tsc --project tsconfig.json
node_modules/.bin/playwright test "$@"
