#!/usr/bin/env bash
# Builds the program of a release from a commit, in target/release-files: the archive that `cargo binstall` takes,
# with man pages and completions, and with cargo-deb the package for Debian. Neither depends on where or when it
# is built. The argument is the target, that of this machine if there is none; cross.sh builds those whose standard
# library rustup has not installed. Prints SHA-256 sums.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

host=$(rustc -vV | sed -n 's/^host: //p')
target=${1:-$host}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
out=$PWD/target/release-files
name=patchlock-$version-$target
if [ -n "$(git status --porcelain)" ]; then
    echo "there are changes that are not committed; commit them, as the files have the commit's date" >&2
    exit 1
fi
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
build=(cargo rustc)
last=()
runner=()
zig_target=$target
cross_rust=
if [ ! -d "$(rustc --print target-libdir --target "$target")" ]; then
    # shellcheck source=tools/release/cross.sh
    source tools/release/cross.sh
fi
# Paths of this machine, which panics and generated code would name.
flags=()
for pair in "$PWD=patchlock" "${CARGO_TARGET_DIR:-$PWD/target}=target" "${CARGO_HOME:-$HOME/.cargo}=cargo" \
    ${cross_rust:+"$cross_rust=rust"}; do
    flags+=("--remap-path-prefix=$pair")
done
CARGO_ENCODED_RUSTFLAGS=$(IFS=$'\x1f' && echo "${flags[*]}")
export CARGO_ENCODED_RUSTFLAGS SOURCE_DATE_EPOCH

"${build[@]}" --quiet --release --locked --target "$zig_target" -p patchlock-cli --bin patchlock \
    ${last[@]+"${last[@]}"}
built=${CARGO_TARGET_DIR:-target}/$target/release
program=$built/patchlock
[ -e "$program" ] || program=$program.exe
# A program that cannot run here cannot write its own pages; those of this machine are the same.
if ! ${runner[@]+"${runner[@]}"} "$program" --version >/dev/null 2>&1; then
    cargo build --quiet --release --locked -p patchlock-cli
    runner=()
    pages=${CARGO_TARGET_DIR:-target}/release/patchlock
fi
runs=(${runner[@]+"${runner[@]}"} "${pages:-$program}")

rm -rf "$out/$name" target/man target/completions
mkdir -p "$out/$name" target/man target/completions
"${runs[@]}" man --out target/man >/dev/null
"${runs[@]}" completions bash >target/completions/patchlock.bash
"${runs[@]}" completions zsh >target/completions/_patchlock
"${runs[@]}" completions fish >target/completions/patchlock.fish
"${runs[@]}" completions powershell >target/completions/_patchlock.ps1
cp "$program" README.md CHANGELOG.md NOTICE.md LICENSE-MIT LICENSE-APACHE "$out/$name"
cp -r target/man target/completions "$out/$name"

files=()
case $target in
    *-windows-*)
        # The archive has the local time, and the permissions that the system gives new files.
        (cd "$out" && rm -f "$name.zip" && find "$name" -exec chmod go=rX,u+rw {} + \
            -exec touch --date="@$SOURCE_DATE_EPOCH" {} + && find "$name" | LC_ALL=C sort |
            TZ=UTC zip --quiet -X -@ "$name.zip")
        files+=("$name.zip")
        ;;
    *)
        tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=go=rX,u+rw \
            -C "$out" -cf - "$name" | gzip -9n >"$out/$name.tar.gz"
        files+=("$name.tar.gz")
        ;;
esac
rm -r "${out:?}/$name"
if [[ $target == *-linux-gnu ]] && cargo deb --version >/dev/null 2>&1; then
    deb=$(cargo deb --quiet --no-build --no-strip --locked --target "$target" -p patchlock-cli --output "$out/")
    files+=("$(basename "$deb")")
fi
cd "$out" && sha256sum "${files[@]}"
