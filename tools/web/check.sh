#!/usr/bin/env bash
# Builds the module and tests it, and the page around it, in Chromium and Firefox: types, format, the boxes
# against those of this machine, and what a visitor does. Arguments are handed to Playwright. PATCHLOCK_MODELS
# names the folder of networks for the tests with one. Without the tools it prints SKIPPED; with
# PATCHLOCK_WEB=required it fails.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
cd "$root"

# The tests share packages and browser with those of the studio's page.
PATCHLOCK_STUDIO=${PATCHLOCK_WEB:-} tools/studio/prepare.sh
[ -x tools/studio/node_modules/.bin/playwright ] || exit 0 # prepare.sh has printed the reason
ln -sfn ../studio/node_modules tools/web/node_modules
"$here/build.sh"
[ -d target/web/site ] || exit 0 # build.sh has printed the reason

clip=$root/target/web/clip
models=${PATCHLOCK_MODELS:-}
case $models in
    '' | required) models=$root/../shared/models ;;
esac
networks=()
if [ -d "$models/nanotrack-v3" ]; then
    networks=("$models/nanotrack-v3"/*.onnx)
elif [ "${PATCHLOCK_MODELS:-}" = required ]; then
    echo "networks are required, but there is no $models/nanotrack-v3" >&2
    exit 1
else
    echo "SKIPPED, no network is tried in a browser: there is no $models/nanotrack-v3"
fi
rm -rf "$clip"
built=${CARGO_TARGET_DIR:-target}/release
# Of the whole workspace, with whose features `./test` has built the tracker: without, it would be built again.
cargo build --quiet --locked --release --workspace --example clip
"$built/examples/clip" "$clip" "${networks[@]}"
# A video as browsers play it.
program=${PATCHLOCK:-$built/patchlock}
[ -x "$program" ] || cargo build --quiet --release --locked -p patchlock-cli
"$program" demo --out target/web/demo >/dev/null

cd "$here"
bin=node_modules/.bin
"$bin/prettier" --config ../studio/.prettierrc.json --log-level warn --check \
    '../../docs/try/*.{mjs,css,html,d.ts}' '../../crates/patchlock-web/src/*.d.ts' 'tests/*.mjs' '*.mjs'
"$bin/tsc" --project tsconfig.json
"$bin/playwright" test "$@"
