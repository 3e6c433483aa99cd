#!/usr/bin/env bash
# Builds the wheel that is published, without the paths of this machine and with the date of the commit, so
# that it does not depend on where and when it is built. The arguments are the folder for the wheel,
# `target/wheels` if there is none; the target, that of this machine if there is none; and the oldest system, such
# as `manylinux2014` or `musllinux_1_2`: both are linked by zig, which the Python package `ziglang` brings.
# MATURIN names another maturin than that of the virtual environment that
# tools/python/prepare.sh makes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

maturin=${MATURIN:-$PWD/target/python-venv/bin/maturin}
if [ ! -x "$maturin" ]; then
    echo "there is no $maturin; run tools/python/prepare.sh, or name another one in MATURIN" >&2
    exit 1
fi
if [ -n "$(git status --porcelain)" ]; then
    echo "there are changes that are not committed; commit them, as the wheel has the commit's date" >&2
    exit 1
fi

# Paths of this machine, which panics and generated code would name.
flags=()
for pair in "$PWD=patchlock" "${CARGO_TARGET_DIR:-$PWD/target}=target" "${CARGO_HOME:-$HOME/.cargo}=cargo"; do
    flags+=("--remap-path-prefix=$pair")
done
CARGO_ENCODED_RUSTFLAGS=$(IFS=$'\x1f' && echo "${flags[*]}")
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export CARGO_ENCODED_RUSTFLAGS SOURCE_DATE_EPOCH

out=$(mkdir -p "${1:-target/wheels}" && cd "${1:-target/wheels}" && pwd)
options=(${2:+--target "$2"} ${3:+--compatibility "$3"})
case ${3:-} in
    manylinux* | musllinux*) options+=(--zig) ;;
esac
"$maturin" build --quiet --release --locked --manifest-path crates/patchlock-py/Cargo.toml --out "$out" \
    "${options[@]}"
sha256sum "$out"/patchlock-*.whl
