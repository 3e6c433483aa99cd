#!/usr/bin/env bash
# Compares what published networks answer and where their loops go, by the built-in runtime, with onnxruntime in
# target/python-venv (setup.sh with `oracles` and `vot` makes it), on frames of otb-dev. PATCHLOCK_MODELS and
# PATCHLOCK_DATA name the folders, by default ../shared/models and ../shared/data beside the checkout. If one is
# missing it prints SKIPPED; if its variable is `required`, it fails.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
out=$root/target/network-check

folder() {
    case ${!1:-} in
        "" | required) echo "$root/../shared/$2" ;;
        *) echo "${!1}" ;;
    esac
}

present() {
    [ -d "$2" ] && return
    if [ "${!1:-}" = required ]; then
        echo "$1 is required, but there is no $2" >&2
        exit 1
    fi
    echo "SKIPPED, networks are not compared with onnxruntime: there is no $2 ($1 names the folder around it)"
    exit 0
}

models=$(folder PATCHLOCK_MODELS models)
data=$(folder PATCHLOCK_DATA data)/otb-dev
present PATCHLOCK_MODELS "$models"
present PATCHLOCK_DATA "$data"

rm -rf "$out"
"${PYTHON:-$root/target/python-venv/bin/python}" "$root/tools/oracles/network_check.py" "$models" "$data" "$out"
cd "$root"
# What `./test` has built.
cargo test --quiet --release --locked --workspace --lib real_networks -- --ignored --nocapture
