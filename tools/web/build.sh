#!/usr/bin/env bash
# Builds the npm package in target/web/npm, and the page with it in target/web/site. Prints their sizes.
# PATCHLOCK_WEB_PROFILE names another profile than `web`. Needs a compiler for wasm32-unknown-unknown: that of
# rustup (`rustup target add wasm32-unknown-unknown`), or the one of Debian, which prepare.sh unpacks into
# target/web/rust. Without both it prints SKIPPED; with PATCHLOCK_WEB=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
root=$PWD
target=${CARGO_TARGET_DIR:-$root/target}
out=$root/target/web
triple=wasm32-unknown-unknown
profile=${PATCHLOCK_WEB_PROFILE:-web}

rm -rf "$out/npm" "$out/site"
tools/web/prepare.sh
# There are no lints for this compiler.
unset RUSTC_WORKSPACE_WRAPPER
# The flags of both compilers. Paths of this machine would make two builds differ.
flags=(-Ctarget-feature=+simd128 "--remap-path-prefix=$root=patchlock"
    "--remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo" "--remap-path-prefix=$out/rust=rust")
build=(cargo build --quiet --locked --profile "$profile" --target "$triple" -p patchlock-web)
module=$target/$triple/$profile/patchlock_web.wasm
if [ -d "$(rustc --print target-libdir --target "$triple" 2>/dev/null)" ]; then
    RUSTFLAGS="${flags[*]}" "${build[@]}"
elif [ -e "$out/rust/complete" ]; then
    linker=$(find "$(rustc --print sysroot)" -name rust-lld | head -n 1)
    # A folder of its own: the standard library is built too, by another compiler. It has no backtraces there.
    module=$target/web/$triple/$profile/patchlock_web.wasm
    env RUSTC="$out/rust/usr/bin/rustc" RUSTC_BOOTSTRAP=1 RUSTFLAGS="${flags[*]}" \
        LD_LIBRARY_PATH="$out/rust/usr/lib/x86_64-linux-gnu" CARGO_TARGET_DIR="$target/web" \
        CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$linker" \
        "${build[@]}" -Zbuild-std=std,panic_abort -Zbuild-std-features=
else
    exit 0 # prepare.sh has printed the reason
fi

cargo build --quiet --locked --release --manifest-path tools/web/bindgen/Cargo.toml \
    --target-dir "$target/web/bindgen"
"$target/web/bindgen/release/patchlock-bindgen" "$module" "$out/npm"
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
sed "s/0.0.0/$version/" crates/patchlock-web/package.json >"$out/npm/package.json"
cp crates/patchlock-web/README.md LICENSE-APACHE LICENSE-MIT "$out/npm"
# The folder gets its name when it is complete: tools/python/docs.sh may look for it at any time.
rm -rf "$out/site.part"
cp -r docs/try "$out/site.part"
mkdir "$out/site.part/patchlock"
cp "$out"/npm/patchlock* "$out/site.part/patchlock"
mv "$out/site.part" "$out/site"
size=$(wc -c <"$out/npm/patchlock_bg.wasm")
small=$(gzip -9 <"$out/npm/patchlock_bg.wasm" | wc -c)
echo "built target/web/npm and target/web/site: module of $size bytes, $small compressed"
# What a visitor waits for.
if [ "$profile" = web ] && ((small > 3000000)); then
    echo "the module takes more than 3 MB compressed" >&2
    exit 1
fi
