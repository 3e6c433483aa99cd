#!/usr/bin/env bash
# Builds the npm package in target/web/npm, and the page with it in target/web/site. Prints their sizes. Needs
# a compiler for wasm32-unknown-unknown: that of rustup (`rustup target add wasm32-unknown-unknown`), or the
# one of Debian, which is unpacked into target/web/rust. Without both it prints SKIPPED; with
# PATCHLOCK_WEB=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
root=$PWD
target=${CARGO_TARGET_DIR:-$root/target}
out=$root/target/web
triple=wasm32-unknown-unknown

skip() {
    rm -rf "$out/npm" "$out/site"
    if [ "${PATCHLOCK_WEB:-}" = required ]; then
        echo "the module for browsers is required, but $1" >&2
        exit 1
    fi
    echo "SKIPPED, the module for browsers is not built: $1"
    exit 0
}

# Unpacks Debian's compiler, without installing it.
debian() {
    command -v apt-get dpkg >/dev/null || return 1
    local packages=(rustc-web rust-web-src libstd-rust-web-1.96 libstd-rust-web-dev libllvm22)
    if [ ! -e "$out/rust/complete" ]; then
        rm -rf "$out/rust" && mkdir -p "$out/rust/packages"
        (cd "$out/rust/packages" && apt-get -qq download "${packages[@]}" >/dev/null 2>&1) || return 1
        for package in "$out"/rust/packages/*.deb; do
            dpkg -x "$package" "$out/rust" || return 1
        done
        rm -r "$out/rust/packages"
        touch "$out/rust/complete"
    fi
}

# The flags of both compilers. Paths of this machine would make two builds differ.
flags=(-Ctarget-feature=+simd128 "--remap-path-prefix=$root=patchlock"
    "--remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo" "--remap-path-prefix=$out/rust=rust")
build=(cargo build --quiet --locked --profile web --target "$triple" -p patchlock-web)
module=$target/$triple/web/patchlock_web.wasm
if [ -d "$(rustc --print target-libdir --target "$triple" 2>/dev/null)" ]; then
    RUSTFLAGS="${flags[*]}" "${build[@]}"
elif debian; then
    linker=$(find "$(rustc --print sysroot)" -name rust-lld | head -n 1)
    [ -n "$linker" ] || skip "there is no rust-lld"
    # A folder of its own: the standard library is built too, by another compiler.
    module=$target/web/$triple/web/patchlock_web.wasm
    env RUSTC="$out/rust/usr/bin/rustc" RUSTC_BOOTSTRAP=1 RUSTFLAGS="${flags[*]}" \
        LD_LIBRARY_PATH="$out/rust/usr/lib/x86_64-linux-gnu" CARGO_TARGET_DIR="$target/web" \
        CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$linker" \
        "${build[@]}" -Zbuild-std=std,panic_abort
else
    skip "there is no compiler for $triple; rustup target add $triple installs one"
fi

cargo build --quiet --locked --release --manifest-path tools/web/bindgen/Cargo.toml \
    --target-dir "$target/web/bindgen"
rm -rf "$out/npm" "$out/site"
"$target/web/bindgen/release/patchlock-bindgen" "$module" "$out/npm"
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
sed "s/0.0.0/$version/" crates/patchlock-web/package.json >"$out/npm/package.json"
cp crates/patchlock-web/README.md LICENSE-APACHE LICENSE-MIT "$out/npm"
cp -r docs/try "$out/site"
mkdir "$out/site/patchlock"
cp "$out"/npm/patchlock* "$out/site/patchlock"
size=$(wc -c <"$out/npm/patchlock_bg.wasm")
small=$(gzip -9 <"$out/npm/patchlock_bg.wasm" | wc -c)
echo "built target/web/npm and target/web/site: module of $size bytes, $small compressed"
# What a visitor waits for.
if ((small > 3000000)); then
    echo "the module takes more than 3 MB compressed" >&2
    exit 1
fi
