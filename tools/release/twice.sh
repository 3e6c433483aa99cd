#!/usr/bin/env bash
# Runs a script that makes files of a release in two copies of the last commit, in folders of other names and
# depths, and compares what it makes, byte for byte. The arguments are the script and its own arguments:
#   tools/release/twice.sh tools/release/program.sh x86_64-unknown-linux-musl
#   MATURIN=$(command -v maturin) tools/release/twice.sh tools/python/wheel.sh
# Each copy compiles everything. The copies are in a temporary folder, or in that of TWICE, where they stay.
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: tools/release/twice.sh SCRIPT [ARGUMENT...]" >&2 && exit 2; }
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source=$PWD
work=${TWICE:-$(mktemp -d)}
[ -n "${TWICE:-}" ] || trap 'rm -rf "$work"' EXIT

copies=("$work/one" "$work/the other/copy")
for copy in "${copies[@]}"; do
    [ -d "$copy" ] || git clone --quiet "$source" "$copy"
    (cd "$copy" && env -u CARGO_TARGET_DIR "$@" >/dev/null)
done

count=0
for folder in release-files wheels web/npm; do
    first=${copies[0]}/target/$folder
    [ -d "$first" ] || continue
    diff -r "$first" "${copies[1]}/target/$folder"
    count=$((count + $(find "$first" -type f | wc -l)))
done
if ((count == 0)); then
    echo "$1 made nothing in target/release-files, target/wheels or target/web/npm" >&2
    exit 1
fi
echo "$count files, equal in both copies"
