#!/usr/bin/env bash
# Unpacks Debian's compiler and the source of its standard library into the folder that is named; nothing is
# installed. With RUSTC_BOOTSTRAP=1 and -Zbuild-std it builds for targets for which rustup has no standard library.
# Prints nothing; fails where it cannot be had.
set -euo pipefail
rust=${1:?"usage: tools/release/debian-rust.sh FOLDER"}
packages=(rustc-web rust-web-src libstd-rust-web-1.96 libstd-rust-web-dev libllvm22)

download() {
    (cd "$rust/packages" && apt-get -qq download "${packages[@]}" >/dev/null 2>&1)
}

[ ! -e "$rust/complete" ] || exit 0
[ "$(uname -m)" = x86_64 ] && command -v apt-get dpkg >/dev/null || exit 1
rm -rf "$rust" && mkdir -p "$rust/packages"
download || { [ "$(id -u)" = 0 ] && apt-get -qq update >/dev/null 2>&1 && download; } || exit 1
for package in "$rust"/packages/*.deb; do
    dpkg -x "$package" "$rust"
done
rm -r "$rust/packages"
touch "$rust/complete"
