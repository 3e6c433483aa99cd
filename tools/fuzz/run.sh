#!/usr/bin/env bash
# Fuzzes the surfaces of crates/patchlock-fuzz, one after the other: run.sh [SECONDS] [TARGET...], by default
# 30 seconds each. Needs cargo-fuzz and a nightly compiler, or PATCHLOCK_FUZZ_STABLE=1 to use the usual one.
# PATCHLOCK_FUZZ_SANITIZER (address, or none) is the sanitizer. Inputs that were found stay in fuzz/corpus;
# those that fail are in fuzz/artifacts, and the script ends with 1. At the end it prints how many inputs
# were tried of each surface. Without the tools it prints why and ends with 3.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

seconds=${1:-30}
targets=("${@:2}")
sanitizer=${PATCHLOCK_FUZZ_SANITIZER:-address}

if ! cargo fuzz --version >/dev/null 2>&1; then
    echo "cargo-fuzz is not installed: cargo install cargo-fuzz --locked"
    exit 3
fi
if [[ -n ${PATCHLOCK_FUZZ_STABLE:-} ]]; then
    export RUSTC_BOOTSTRAP=1
elif [[ $(rustc --version) == *nightly* ]]; then
    :
elif rustup run nightly rustc --version >/dev/null 2>&1; then
    export RUSTUP_TOOLCHAIN=nightly
else
    echo "there is no nightly compiler; PATCHLOCK_FUZZ_STABLE=1 fuzzes with the usual one"
    exit 3
fi

folder=${CARGO_TARGET_DIR:-target}/fuzz
cargo run --quiet --locked --release -p patchlock-fuzz --example seeds -- "$folder/seeds" "${targets[@]}"
cargo fuzz build --sanitizer "$sanitizer" --target-dir "$folder/build"
if ((${#targets[@]} == 0)); then
    mapfile -t targets < <(ls "$folder/seeds")
fi

# Files go to memory, where there is such a folder, and are removed at the end, also after a crash.
parent=/tmp
[[ -w /dev/shm ]] && parent=/dev/shm
scratch=$(mktemp -d "$parent/patchlock-fuzz.XXXXXX")
trap 'rm -rf "$scratch" "$scratch.log"' EXIT

host=$(rustc -vV | sed -n 's/^host: //p')
failed=0
tried=0
summary=
for target in "${targets[@]}"; do
    mkdir -p "fuzz/corpus/$target" "fuzz/artifacts/$target"
    longest=16384
    case $target in
        mp4 | h264 | y4m | model) longest=65536 ;;
        snapshot_*) longest=262144 ;;
    esac
    printf '\n=== fuzz %s: %s s\n' "$target" "$seconds"
    # With this PATH no ffmpeg is found: the surfaces are our own readers.
    if ! PATH="$scratch" TMPDIR="$scratch" RAYON_NUM_THREADS=1 RUST_BACKTRACE=1 \
        "$folder/build/$host/release/$target" \
        -max_total_time="$seconds" -max_len="$longest" -timeout=10 -rss_limit_mb=1024 \
        -malloc_limit_mb=1024 -print_final_stats=1 -verbosity=0 \
        -artifact_prefix="fuzz/artifacts/$target/" \
        "fuzz/corpus/$target" "$folder/seeds/$target" 2>&1 | tee "$scratch.log"; then
        failed=1
    fi
    inputs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$scratch.log")
    tried=$((tried + ${inputs:-0}))
    summary+=$(printf '%-20s%s' "$target" "${inputs:-ended}")$'\n'
done
printf '\n%s%-20s%s\n' "$summary" "all" "$tried"
exit $failed
