#!/usr/bin/env bash
# Fails if a type has a name that is no noun of the field, and says what to call it instead: one of tools/words.txt,
# or a single word that ends in -ed or -ly (a participle or an adverb).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Python's batch tells how a run ended by these names. They are public, and stay.
public='class (Failed|Lost|Made)\b'
nouns='Family|Feed|Reply|Seed|Speed|Tally'
listed=$(sed -n 's/^\([A-Z][A-Za-z]*\) .*/\1/p' tools/words.txt | paste -sd '|' -)
ends='[A-Z][a-z]*(ed|ly)'

# The declarations of types, as FILE:LINE:DECLARATION.
declarations() {
    git grep --untracked -noE "\b(struct|enum|trait|type|union) ($1)\b" -- '*.rs' || true
    git grep --untracked -noE "^ *(export )?(class|interface|type) ($1)\b" -- '*.py' '*.mjs' '*.ts' || true
    git grep --untracked -noE "@typedef \{object\} ($1)\b" -- '*.mjs' || true
}

found=$(declarations "$listed|$ends" | grep -vE "$public" | grep -vE " ($nouns)$" | sort -u) || true
if [ -z "$found" ]; then
    exit 0
fi
while IFS= read -r line; do
    word=${line##* }
    instead=$(sed -n "s/^$word  *//p" tools/words.txt)
    echo "${line%%:*}:$(cut -d: -f2 <<<"$line"): a type named $word; use a noun: ${instead:-what was done, or what it is}"
done <<<"$found" >&2
echo "Names of types are the field's nouns: see tools/words.txt, docs/glossary.md" >&2
exit 1
