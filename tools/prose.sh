#!/usr/bin/env bash
# Formats all Markdown: 100 columns, by the prettier that tools/studio pins.
#   tools/prose.sh            formats
#   tools/prose.sh --check    names the files that are not formatted, and fails
# Without npm the check prints SKIPPED; with PATCHLOCK_PROSE=required it fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mode=${1:---write}
case $mode in
    --check | --write) ;;
    *)
        echo "usage: tools/prose.sh [--check]" >&2
        exit 2
        ;;
esac

skip() {
    if [ "$mode" = --write ] || [ "${PATCHLOCK_PROSE:-}" = required ]; then
        echo "Markdown cannot be formatted: $1" >&2
        exit 1
    fi
    echo "SKIPPED, the format of Markdown is not checked: $1"
    exit 0
}

prettier=tools/studio/node_modules/.bin/prettier
if [ ! -x "$prettier" ]; then
    command -v npm >/dev/null || skip "npm is not installed"
    npm ci --silent --prefix tools/studio || skip "npm could not install prettier"
fi
# Links lead to files that are formatted themselves.
git ls-files -z '*.md' ':!crates/*/NOTICE.md' | xargs -0 "$prettier" "$mode" --no-config --log-level warn \
    --prose-wrap always --print-width 100 --embedded-language-formatting off
