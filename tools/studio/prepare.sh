#!/usr/bin/env bash
# Downloads what the tests of the page need: packages of npm, and Chromium where apt-get can install it. With
# little else to do, `./test` runs it while Rust compiles. Without Node or Chromium it prints SKIPPED; with
# PATCHLOCK_STUDIO=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

skip() {
    rm -rf node_modules
    if [ "${PATCHLOCK_STUDIO:-}" = required ]; then
        echo "the tests of the page are required, but $1" >&2
        exit 1
    fi
    echo "SKIPPED, the page is not tested in a browser: $1"
    exit 0
}

# Without a window to draw, Chromium takes a quarter less of the processor.
has_shell() {
    [ -n "${CHROMIUM:-}" ] || command -v chromium-headless-shell >/dev/null
}

has_chromium() {
    has_shell || command -v chromium chromium-browser google-chrome >/dev/null
}

command -v npm >/dev/null || skip "there is no npm"
node -e 'process.exit(parseInt(process.versions.node) < 20 ? 1 : 0)' ||
    skip "$(node --version) of Node is older than 20"
if ! has_shell && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    { apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends \
        chromium-headless-shell fonts-inter; } >/dev/null 2>&1 || true
fi
has_chromium || skip "there is no Chromium; install it, or name it in CHROMIUM"
if ! cmp -s package-lock.json node_modules/.patchlock-lock; then
    npm ci --silent || skip "its packages could not be installed"
    cp package-lock.json node_modules/.patchlock-lock
fi
