#!/usr/bin/env bash
# Installs files of a release, each into an environment that has nothing else, and makes a first track with it
# there, without a network: the archive of the program, the package for Debian (needs root and debootstrap), the
# wheel, the source distribution (compiles for minutes), the npm package, the container image (needs root and
# buildah). What they depend on is downloaded before.
# Prints a row for each file: its size and how well the target was tracked, which must be well.
#   tools/release/installs.sh target/release-files/* target/wheels/* target/web/*.tgz
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
[ $# -gt 0 ] || { echo "usage: tools/release/installs.sh FILE..." >&2 && exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python=${PYTHON:-python3}

# Runs a command in an empty folder without a network, with nothing of this shell but what is named before it.
alone() {
    rm -rf "$work/alone"
    mkdir "$work/alone"
    (cd "$work/alone" && unshare --map-root-user --net env -i HOME="$work/alone" PATH=/usr/bin:/bin "$@")
}

# How much of the truth the boxes of the demo in a folder cover, where the target counts as tracked.
judge() {
    paste -d, "$1/demo.csv" "$1/truth.csv" | awk -F, '
        function most(a, b) { return a > b ? a : b }
        function least(a, b) { return a < b ? a : b }
        NR == 1 { for (k = 1; k <= NF; k++) at[$k] = at[$k] ? at[$k] : k; truth = at["frame_h"]; next }
        $at["status"] == "tracked" {
            x = $(truth + 2); y = $(truth + 3); w = $(truth + 4); h = $(truth + 5)
            common = most(0, least($2 + $4, x + w) - most($2, x)) * most(0, least($3 + $5, y + h) - most($3, y))
            sum += common / ($4 * $5 + w * h - common)
            tracked++
        }
        END {
            printf "demo: %d of %d frames tracked, overlap %.3f", tracked, NR - 1, tracked ? sum / tracked : 0
            exit !(tracked > (NR - 1) / 2 && sum > .9 * tracked)
        }'
}

# Each page must be one that man can format.
pages() {
    local page count=0
    for page in "$1"/patchlock*.1*; do
        [ -z "$(man --warnings --local-file "$page" 2>&1 >/dev/null)" ] || { echo "man warns of $page" && return 1; }
        count=$((count + 1))
    done
    printf '%d man pages' "$count"
}

# The names that `cargo binstall` makes of the metadata must be those of the archive and of the program in it.
binstall() {
    "$python" - "$1" <<'PY'
import re, sys, tarfile, tomllib, zipfile
from pathlib import Path

archive = Path(sys.argv[1])
package = tomllib.loads(Path("Cargo.toml").read_text())["workspace"]["package"]
metadata = tomllib.loads(Path("crates/patchlock-cli/Cargo.toml").read_text())["package"]["metadata"]["binstall"]
target = re.sub(r"\.(tar\.gz|zip)$", "", archive.name.removeprefix(f"patchlock-{package['version']}-"))
form = {**metadata, **metadata["overrides"].get(target, {})}
values = {
    "repo": package["repository"], "version": package["version"], "target": target, "bin": "patchlock",
    "archive-suffix": {"tgz": ".tar.gz", "zip": ".zip"}[form["pkg-fmt"]],
    "binary-ext": ".exe" if "windows" in target else "",
}
filled = lambda template: re.sub(r"\{ (\S+) \}", lambda match: values[match[1]], template)
is_zip = form["pkg-fmt"] == "zip"
names = zipfile.ZipFile(archive).namelist() if is_zip else tarfile.open(archive).getnames()
url, program = filled(form["pkg-url"]), filled(form["bin-dir"])
if url.rpartition("/")[2] != archive.name or program not in names:
    sys.exit(f"cargo binstall looks for {program} in {url}")
PY
}

archive() {
    binstall "$1"
    mkdir "$work/archive"
    case $1 in
        *.zip) unzip -q "$1" -d "$work/archive" ;;
        *) tar -xzf "$1" -C "$work/archive" ;;
    esac
    local program=("$work"/archive/*/patchlock*)
    pages "$work"/archive/*/man
    if alone "${program[0]}" --version >/dev/null 2>&1; then
        alone "${program[0]}" demo --out demo >/dev/null
        printf ', names for binstall, '
        judge "$work/alone/demo"
    else
        printf ', names for binstall; does not run here'
    fi
    rm -r "$work/archive"
}

debian() {
    if [ "$(id -u)" != 0 ] || ! command -v debootstrap >/dev/null; then
        printf 'SKIPPED: needs root and debootstrap'
        return
    fi
    local root=$work/debian
    debootstrap --variant=minbase stable "$root" >"$work/log" 2>&1
    cp "$1" "$root/patchlock.deb"
    # dpkg refuses it where the system has not what it depends on.
    chroot "$root" dpkg --install /patchlock.deb >"$work/log" 2>&1
    unshare --net chroot "$root" patchlock demo --out /demo >/dev/null
    pages "$root/usr/share/man/man1"
    chroot "$root" bash -c 'source /usr/share/bash-completion/completions/patchlock && complete -p patchlock' >/dev/null
    test -s "$root/usr/share/zsh/vendor-completions/_patchlock"
    test -s "$root/usr/share/fish/vendor_completions.d/patchlock.fish"
    printf ', completions, %s, ' "$(chroot "$root" sh -c '. /etc/os-release && echo "$PRETTY_NAME"')"
    judge "$root/demo"
    chroot "$root" dpkg --purge patchlock >"$work/log" 2>&1
    test ! -e "$root/usr/bin/patchlock"
    rm -r "$root"
}

# A new virtual environment, and a folder with what the arguments depend on.
environment() {
    "$python" -m venv --clear "$work/venv"
    "$work/venv/bin/pip" download --quiet --disable-pip-version-check --only-binary :all: --dest "$work/house" "$@"
}
pip_alone() {
    alone PATH="$work/venv/bin:$(rustc --print sysroot)/bin:/usr/bin:/bin" pip "$@" --quiet \
        --disable-pip-version-check --no-index --find-links "$work/house"
}

wheel() {
    environment "$1"
    pip_alone install "$1"
    alone "$work/venv/bin/patchlock" demo --out demo >/dev/null
    printf 'the program: '
    judge "$work/alone/demo"
    alone "$work/venv/bin/python" -I -c '
import patchlock

scene = patchlock.Scene("demo")
estimates = list(patchlock.track(scene, scene.truth(0)))


def overlap(a, b):
    width = max(0, min(a.x + a.w, b.x + b.w) - max(a.x, b.x))
    height = max(0, min(a.y + a.h, b.y + b.h) - max(a.y, b.y))
    return width * height / (a.w * a.h + b.w * b.h - width * height)


overlaps = [overlap(e.box, scene.truth(e.frame)) for e in estimates if e.status == "tracked"]
mean = sum(overlaps) / len(overlaps)
print(f"; Python: {len(overlaps)} of {len(estimates)} frames tracked, overlap {mean:.3f}", end="")
assert len(overlaps) > len(estimates) / 2 and mean > 0.9
'
}

source_distribution() {
    local needs
    mapfile -t needs < <(tar -xzOf "$1" "$(basename "$1" .tar.gz)/pyproject.toml" | "$python" -c '
import sys, tomllib; print(*tomllib.load(sys.stdin.buffer)["build-system"]["requires"], sep="\n")')
    environment "${needs[@]}"
    # CARGO_HOME is empty: the sources can only come from the file.
    pip_alone wheel --no-deps --wheel-dir "$work/built" "$1"
    printf 'compiled without a network; '
    wheel "$work"/built/patchlock-*.whl
}

npm_package() {
    # Where node is, which may be in no folder of the system.
    alone PATH="$(dirname "$(command -v node)"):/usr/bin:/bin" sh -c '
        npm install --silent --offline "$0" && exec node --input-type=module --eval "$1"' "$1" '
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { initSync, Tracker, TrackerConfig } from "patchlock";

initSync({ module: readFileSync(fileURLToPath(import.meta.resolve("patchlock/patchlock_bg.wasm"))) });
const [width, height, count] = [320, 240, 40];
// A noise of squares; the target is of another noise, and moves by 3 and 2 pixels a frame.
const mix = (n) => Math.imul(n ^ (n >>> 16), 0x45d9f3b);
const noise = (x, y, seed) => mix(mix((x >> 3) * 997 + (y >> 3) * 31 + seed)) >>> 24;
const place = (k) => ({ x: 40 + 3 * k, y: 30 + 2 * k, w: 48, h: 40 });
const frame = (k) => {
    const { x: left, y: top, w, h } = place(k);
    const data = new Uint8ClampedArray(4 * width * height);
    for (let y = 0; y < height; y += 1)
        for (let x = 0; x < width; x += 1) {
            const inside = x >= left && x < left + w && y >= top && y < top + h;
            const value = inside ? noise(x - left, y - top, 90001) : noise(x, y, 1) >> 1;
            data.set([value, inside ? value >> 1 : value, value, 255], 4 * (y * width + x));
        }
    return { data, width, height };
};
const tracker = Tracker.start(new TrackerConfig("robust"), frame(0), place(0));
let most = 0;
for (let k = 1; k < count; k += 1) {
    const { bbox, status } = tracker.update(frame(k));
    if (status !== "tracked") throw new Error(`frame ${k}: ${status}`);
    for (const side of ["x", "y"]) most = Math.max(most, Math.abs(bbox[side] - place(k)[side]));
}
if (most > 2) throw new Error(`the box is ${most} pixels from the truth`);
process.stdout.write(`Node ${process.versions.node}: ${count} frames tracked, at most ${most.toFixed(2)} pixels off`);
'
}

image() {
    if [ "$(id -u)" != 0 ] || ! command -v buildah >/dev/null; then
        printf 'SKIPPED: needs root and buildah'
        return
    fi
    local container root
    container=$(buildah from --quiet "oci-archive:$1")
    root=$(buildah mount "$container")
    unshare --net chroot "$root" /bin/patchlock demo --out /demo >/dev/null
    judge "$root/demo"
    root=$(buildah inspect --format '{{.FromImageID}}' "$container")
    buildah rm "$container" >/dev/null
    buildah rmi "$root" >/dev/null
}

status=0
touch "$work/log"
echo "| file | MB | what it did |"
echo "| ---- | -- | ----------- |"
for given in "$@"; do
    file=$(realpath "$given")
    # Not in a condition, where a command that fails would not end it.
    set +e
    case $(basename "$file") in
        *.deb) did=$(set -e && debian "$file" 2>&1) ;;
        *.whl) did=$(set -e && wheel "$file" 2>&1) ;;
        *.oci.tar) did=$(set -e && image "$file" 2>&1) ;;
        *.tgz) did=$(set -e && npm_package "$file" 2>&1) ;;
        patchlock-*-*.tar.gz | *.zip) did=$(set -e && archive "$file" 2>&1) ;;
        patchlock-*.tar.gz) did=$(set -e && source_distribution "$file" 2>&1) ;;
        *) did="is of no kind that is known: .deb, .whl, .tgz, .tar.gz, .zip, .oci.tar" && false ;;
    esac
    code=$?
    set -e
    ((code == 0)) || { status=1 && did="FAILED: ${did//$'\n'/ } $(tail -n 3 "$work/log" | tr '\n' ' ')"; }
    echo "| $(basename "$file") | $(awk "BEGIN { printf \"%.1f\", $(stat -c %s "$file") / 1e6 }") | $did |"
done
exit $status
