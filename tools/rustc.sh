#!/usr/bin/env bash
# For RUSTC_WORKSPACE_WRAPPER: documents, lints and compiles each crate of the workspace. `cargo clippy` and `cargo doc`
# find the same, but first analyse all dependencies once more. The pages of
# the documentation are in target/doc.
set -euo pipefail

if [[ " $* " != *" --out-dir "* ]]; then
    exec "$@" # Cargo asks for the version.
fi
target=${CARGO_TARGET_DIR:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/target}
arguments=()
for ((k = 2; k <= $#; k++)); do
    case ${!k} in
        --out-dir) ((++k)) ;;
        --emit=* | --error-format=* | --json=*) ;;
        *) arguments+=("${!k}") ;;
    esac
done
if [[ " $* " != *" --test "* && " $* " =~ " --crate-type "(lib|cdylib)" " ]]; then
    rustdoc "${arguments[@]}" -D warnings --out-dir "$target/doc"
fi
clippy-driver "$1" "${arguments[@]}" -D warnings --emit=metadata --out-dir "$target/lints"
# Tests are not optimised, which takes a third of the time: most of them wait for code that is. Those that compute
# much themselves stay optimised.
case " $* " in
    *" --crate-name golden "* | *" --crate-name robust "* | *" --crate-name somp "*) ;;
    *" --test "*) set -- "$@" -C opt-level=0 ;;
esac
exec "$@"
