#!/bin/sh
# Compiles tests without optimisation, for RUSTC_WORKSPACE_WRAPPER: most of them wait for what is optimised, and to
# compile them takes a third of the time. Those of the tracker compute themselves.
if [ "$CARGO_PKG_NAME" != patchlock ]; then
    for word; do
        [ "$word" != --test ] || exec "$@" -C opt-level=0
    done
fi
exec "$@"
