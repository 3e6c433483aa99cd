#!/usr/bin/env bash
# Runs the notebooks in docs/notebooks and stores their outputs in them, for those who read them in the
# repository: the pages are built with outputs of their own. It needs the package and the extra docs in
# target/python-venv, as tools/python/check.sh leaves them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

PATH=$PWD/target/python-venv/bin:$PATH jupyter nbconvert --to notebook --execute --inplace \
    --ExecutePreprocessor.record_timing=False --log-level ERROR docs/notebooks/*.ipynb
