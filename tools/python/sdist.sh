#!/usr/bin/env bash
# Builds the source distribution with the sources of all crates that it needs, so that `pip install` compiles it
# without a network where Rust and maturin are installed. The argument is the folder for it, `target/wheels` if
# there is none. MATURIN names another maturin than that of the virtual environment that tools/python/prepare.sh
# makes. Two of one commit are equal.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

maturin=${MATURIN:-$PWD/target/python-venv/bin/maturin}
if [ ! -x "$maturin" ]; then
    echo "there is no $maturin; run tools/python/prepare.sh, or name another one in MATURIN" >&2
    exit 1
fi
if [ -n "$(git status --porcelain)" ]; then
    echo "there are changes that are not committed; commit them, as the files have the commit's date" >&2
    exit 1
fi
out=$(mkdir -p "${1:-target/wheels}" && cd "${1:-target/wheels}" && pwd)
date=$(git log -1 --format=%ct)
work=$(mktemp -d)
trap 'rm -rf "$work" "$work.log"' EXIT

"$maturin" sdist --manifest-path crates/patchlock-py/Cargo.toml --out "$work" >"$work.log" 2>&1 || { cat "$work.log" >&2; exit 1; }
tar -xzf "$work"/patchlock-*.tar.gz -C "$work"
rm "$work"/patchlock-*.tar.gz
name=$(basename "$work"/patchlock-*)
# Cargo.lock loses the crates that are not in it; the versions stay.
mkdir "$work/$name/.cargo"
(cd "$work/$name" && cargo vendor --quiet --versioned-dirs vendor >/dev/null)
cat >"$work/$name/.cargo/config.toml" <<'TOML'
[source.crates-io]
replace-with = "vendored-sources"

[source.vendored-sources]
directory = "vendor"
TOML
# With no other source: all that Cargo.lock names must be there.
(cd "$work/$name" && CARGO_HOME=$work/home cargo metadata --offline --locked --format-version 1 >/dev/null)
if diff <(grep -A 2 '^name' Cargo.lock) <(grep -A 2 '^name' "$work/$name/Cargo.lock") | grep '^>' >&2; then
    echo "Cargo.lock was changed: run cargo check, and commit Cargo.lock" >&2
    exit 1
fi
tar --sort=name --format=posix --pax-option=exthdr.name=%d/PaxHeaders/%f,delete=atime,delete=ctime \
    --mtime="@$date" --owner=0 --group=0 --numeric-owner --mode=go=rX,u+rw \
    -C "$work" -cf - "$name" | gzip -9n >"$out/$name.tar.gz"
cd "$out" && sha256sum "$name.tar.gz"
