#!/bin/sh
# Remakes all golden files: tools/oracles/make_all.sh FRAMES
# FRAMES holds the rendered frames described in README.md. PYTHON may name another Python 3.11.
set -eu
[ $# -eq 1 ] || { echo "usage: make_all.sh FRAMES" >&2; exit 2; }
frames=$(cd "$1" && pwd)
cd "$(dirname "$0")"
venv=../../.venv
if [ ! -x "$venv/bin/python" ]; then
    "${PYTHON:-python3.11}" -m venv "$venv"
    "$venv/bin/pip" install --quiet --requirement requirements.txt
fi
# Sums are reproducible only in a fixed order, hence one thread.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
for script in warp subspace guided_filter lasso network_model; do
    "$venv/bin/python" "$script.py"
done
"$venv/bin/python" somp.py "$frames"
