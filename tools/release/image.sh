#!/usr/bin/env bash
# Makes a container image of nothing but the static program and its texts, as an OCI archive in
# target/release-files. The argument is what tools/release/program.sh made for a target with musl, such as
# target/release-files/patchlock-0.2.0-x86_64-unknown-linux-musl.tar.gz. Needs buildah; no rights of root, no
# service. The image has the date of the commit, so that two of one program are equal.
#   podman load --input patchlock-0.2.0-x86_64.oci.tar
#   podman run --rm --volume "$PWD:/work" patchlock track video.mp4 --box 120,80,64,48 --save track.csv
set -euo pipefail
files=${1:?"usage: tools/release/image.sh patchlock-VERSION-TARGET-musl.tar.gz"}
files=$(realpath "$files")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
name=$(basename "$files" .tar.gz)
machine=${name#patchlock-*-}
machine=${machine%%-*}
version=${name#patchlock-}
version=${version%%-"$machine"*}
case $name in
    *-linux-musl) ;;
    *)
        echo "$name is not for musl: an image without a system needs a static program" >&2
        exit 1
        ;;
esac
case $machine in
    x86_64) architecture=amd64 ;;
    aarch64) architecture=arm64 ;;
    *)
        echo "the machine is $machine; there are images for x86_64 and aarch64" >&2
        exit 1
        ;;
esac

out=$PWD/target/release-files/patchlock-$version-$machine.oci.tar
date=$(git log -1 --format=%ct)
parts=$(mktemp -d)
trap 'rm -rf "$parts"' EXIT
tar -xzf "$files" -C "$parts" --strip-components=1
container=$(buildah from --arch "$architecture" scratch)
trap 'buildah rm "$container" >/dev/null; rm -rf "$parts"' EXIT
buildah copy --quiet --chown 0:0 "$container" "$parts/patchlock" /bin/patchlock >/dev/null
for text in NOTICE.md LICENSE-MIT LICENSE-APACHE; do
    buildah copy --quiet --chown 0:0 "$container" "$parts/$text" "/licenses/$text" >/dev/null
done
# The folder of the user's files is mounted there.
buildah config --entrypoint '["/bin/patchlock"]' --workingdir /work \
    --label org.opencontainers.image.source=https://github.com/patchlock/patchlock \
    --label org.opencontainers.image.licenses="MIT OR Apache-2.0" \
    --label org.opencontainers.image.version="$version" "$container"
buildah commit --quiet --timestamp "$date" "$container" "oci:$parts/image:patchlock:$version" >/dev/null
tar --sort=name --mtime="@$date" --owner=0 --group=0 --numeric-owner --mode=go=rX,u+rw -C "$parts/image" \
    -cf "$out" blobs index.json oci-layout
cd "$(dirname "$out")" && sha256sum "$(basename "$out")"
