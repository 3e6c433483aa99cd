# shellcheck shell=bash
# Sourced by program.sh, for a target for which rustup has no standard library here: Debian's compiler builds the
# standard library too, and zig links, which the Python package ziglang brings with the C libraries of all targets.
# Sets `build`, `last` and `zig_target`, `cross_rust` to the folder of the compiler, `runner` to what runs the program
# of another machine, and CARGO_TARGET_DIR to a folder of its own. Stops the script, with the reason, where that
# cannot be had.

cross_root=$PWD/target/release-tools
cross_rust=$PWD/target/web/rust
if [ ! -x "$cross_root/bin/cargo-zigbuild" ]; then
    python3 -m venv "$cross_root"
    "$cross_root/bin/pip" install --quiet cargo-zigbuild==0.24.1 ziglang==0.17.1
fi
tools/release/debian-rust.sh "$cross_rust" || {
    echo "$target: rustup target add $target installs its standard library; that of Debian's compiler" \
        "(rust-web-src) could not be had" >&2
    exit 1
}
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/debian
PATH=$cross_root/bin:$PATH
export CARGO_TARGET_DIR PATH
export CARGO_ZIGBUILD_CACHE_DIR=$CARGO_TARGET_DIR/zig
build=(env "RUSTC=$cross_rust/usr/bin/rustc" RUSTC_BOOTSTRAP=1
    "LD_LIBRARY_PATH=$cross_rust/usr/lib/x86_64-linux-gnu" cargo-zigbuild rustc -Zbuild-std=std,panic_abort)
# The oldest system with glibc that Rust's standard library supports, as manylinux2014.
zig_target=$target
case $target in
    *-linux-gnu) zig_target=$target.2.17 ;;
    # The C library and its start come from zig.
    *-linux-musl) last=(-- -Clink-self-contained=no) ;;
    # Linked by GCC (package gcc-mingw-w64-x86-64): zig has not all libraries that Rust names.
    *-windows-gnu)
        build=("${build[@]/cargo-zigbuild/cargo}")
        last=(-- -Ctarget-feature=+crt-static)
        ;;
esac
case $target in
    "$(uname -m)"-*-linux-*) ;;
    aarch64-*-linux-*) runner=(qemu-aarch64 -L /usr/aarch64-linux-gnu) ;;
    *-windows-*) runner=(env WINEDEBUG=-all wine) ;;
esac
