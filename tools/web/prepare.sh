#!/usr/bin/env bash
# Downloads what the module for browsers and its tests need, beside what tools/studio/prepare.sh downloads:
# Firefox, where apt-get can install it, and Debian's compiler for WebAssembly, unless rustup has installed
# one. The compiler is unpacked into target/web/rust, not installed. With little else to do, `./test` runs it
# while Rust compiles. Without a compiler it prints SKIPPED; with PATCHLOCK_WEB=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
triple=wasm32-unknown-unknown
rust=$PWD/target/web/rust

skip() {
    rm -rf "$rust"
    if [ "${PATCHLOCK_WEB:-}" = required ]; then
        echo "the module for browsers is required, but $*" >&2
        exit 1
    fi
    echo "SKIPPED, the module for browsers is not built: $*"
    exit 0
}

if ! command -v firefox-esr firefox >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends firefox-esr \
        >/dev/null 2>&1 || echo "SKIPPED, nothing is tested in Firefox: it could not be installed"
fi
[ ! -d "$(rustc --print target-libdir --target "$triple" 2>/dev/null)" ] || exit 0
[ ! -e "$rust/complete" ] || exit 0
find "$(rustc --print sysroot)" -name rust-lld | grep -q . || skip "there is no rust-lld"
tools/release/debian-rust.sh "$rust" ||
    skip "there is no compiler for $triple: rustup target add $triple installs one, and that of Debian" \
        "(rustc-web) could not be had"
