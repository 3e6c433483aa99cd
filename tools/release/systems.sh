#!/usr/bin/env bash
# Builds the program for other systems and tries each one that can be run here: on another processor by qemu
# (package qemu-user, and libc6-arm64-cross for glibc), as a program of Windows by wine. That of Debian 12 is too old:
# it lacks bcryptprimitives.dll, without which no program in Rust starts; that of Debian 13 has it. The program renders
# and tracks the demo, tracks the demo's video as the program of this machine does, and writes its pages, all in a
# folder with a space in its name. Prints a row of a table for each target; the boxes are compared with those of this
# machine. The arguments are targets, those of a release if there are none.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$PWD/target/release-files
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
targets=("$@")
[ $# -gt 0 ] || targets=(x86_64-unknown-linux-musl aarch64-unknown-linux-gnu aarch64-unknown-linux-musl
    x86_64-pc-windows-gnu aarch64-apple-darwin)

# What program.sh makes for a target, unpacked.
built() {
    tools/release/program.sh "$1" >"$work/log" || return 1
    mkdir -p "$work/its files"
    case $1 in
        *-windows-*) unzip -q "$out/patchlock-$version-$1.zip" -d "$work/its files" ;;
        *) tar -xzf "$out/patchlock-$version-$1.tar.gz" -C "$work/its files" ;;
    esac
}

track() {
    "$@" track input.mp4 --box 48.5,204.5,80,64 --save "the track.csv" --overwrite >/dev/null
}

# The shortest of some starts, in milliseconds.
start() {
    local best=1000000 before
    for _ in {1..10}; do
        before=${EPOCHREALTIME/./}
        "$@" --version >/dev/null
        before=$((${EPOCHREALTIME/./} - before))
        ((before >= best)) || best=$before
    done
    awk "BEGIN { printf \"%.1f\", $best / 1000 }"
}

# How far the boxes of two tables are apart, and how many statuses differ.
distance() {
    paste -d, "$1" "$2" | awk -F, '
        function apart(a, b) { a -= b; if (a < 0) a = -a; if (a > most) most = a }
        NR == 1 { for (k = 1; k <= NF / 2; k++) if ($k == "status") status = k; half = NF / 2; next }
        {
            apart($2, $(half + 2)); apart($3, $(half + 3))
            apart($2 + $4, $(half + 2) + $(half + 4)); apart($3 + $5, $(half + 3) + $(half + 5))
            others += $status != $(half + status)
        }
        END { printf "%s px in %d frames, %d other statuses", most + 0, NR - 1, others }'
}

# Runs the program in the folder that is named, and writes what it does.
try() {
    local folder=$1 before seconds
    shift
    cp "$work/input.mp4" "$folder"
    cd "$folder"
    "$@" --version | tr -d '\r' >version
    before=${EPOCHREALTIME/./}
    "$@" demo --out "a demo" >/dev/null
    seconds=$(((${EPOCHREALTIME/./} - before) / 1000000))
    "$@" man --out "man pages" >/dev/null
    diff -r --strip-trailing-cr "$work/man" "man pages" >/dev/null || { echo "its pages differ" && return 1; }
    track "$@"
    printf '%s | %s s | %s' "$(start "$@") ms" "$seconds" "$(distance "$work/track.csv" "the track.csv")"
}

host=$(rustc -vV | sed -n 's/^host: //p')
built "$host"
here=$work/patchlock
mv "$work/its files/patchlock-$version-$host/patchlock" "$here"
mv "$work/its files/patchlock-$version-$host/man" "$work/man"
(cd "$work" && "$here" demo --out demo >/dev/null && cp demo/input.mp4 . && track "$here")
mv "$work/the track.csv" "$work/track.csv"

echo "| target | program | starts in | demo | boxes of the demo's video against $host |"
echo "| ------ | ------- | --------- | ---- | --------------------------------------- |"
status=0
for target in "$host" "${targets[@]}"; do
    rm -rf "$work/its files"
    # program.sh has printed why.
    if ! built "$target"; then
        echo "| $target | was not built |"
        status=1
        continue
    fi
    folder="$work/its files/patchlock-$version-$target"
    program=$folder/patchlock
    runs=()
    case $target in
        "$(uname -m)"-*-linux-*) ;;
        *-windows-*) program=$program.exe && runs=(env WINEDEBUG=-all wine) ;;
        aarch64-*-linux-*) runs=(qemu-aarch64 -L /usr/aarch64-linux-gnu) ;;
        *) runs=(none) ;;
    esac
    tried="cannot be run here | |"
    if [ "${runs[0]:-env}" = env ] || command -v "${runs[0]}" >/dev/null; then
        # Not in a condition, where a command that fails would not end it.
        set +e
        tried=$(set -e && try "$folder" ${runs[@]+"${runs[@]}"} "$program" 2>"$work/log")
        code=$?
        set -e
        ((code == 0)) || { status=1 && tried="FAILED: $tried $(tail -n 3 "$work/log")"; }
    fi
    echo "| $target | $(($(stat -c %s "$program") / 1000000)) MB | $tried |"
done
exit $status
