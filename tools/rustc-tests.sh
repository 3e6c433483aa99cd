#!/bin/sh
# For RUSTC_WORKSPACE_WRAPPER: compiles tests without optimisation, in a third of the time. Most of them wait for
# code that is optimised. The tests of the crate `patchlock` compute much themselves, so they stay optimised.
if [ "$CARGO_PKG_NAME" != patchlock ]; then
    for word; do
        [ "$word" != --test ] || exec "$@" -C opt-level=0
    done
fi
exec "$@"
