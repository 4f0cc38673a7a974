#!/usr/bin/env bash
# Every public name is documented, and the page has them all. What is public is what api.txt says.
# Usage: test_api.sh SOURCE_FOLDER [LIBRARY]
set -eu
source=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
api=(python3 "$source/scripts/api.py")

fail() {
    echo "FAIL: $*" >&2
    exit 1
}

"${api[@]}" --check "$source"/include/mild/*.h || fail "undocumented"

"${api[@]}" "$source"/include/mild/*.h >"$work/api.md"
for name in $(grep -oh '\bmild_[a-z0-9_]* *(' "$source"/include/mild/*.h | tr -d ' (' | sort -u); do
    grep -q "\b$name\b" "$work/api.md" || fail "$name is not on the page"
done
# The snapshot: a change of the interface is meant, or it is a mistake.
"${api[@]}" --names "$source"/include/mild/*.h >"$work/api.txt"
for name in $(nm -g --defined-only "${2:-/dev/null}" 2>/dev/null | awk 'NF == 3 && $3 !~ /^mild_inside_/ { print $3 }' | sort -u); do # inside: for libmild_batch
    grep -qw "$name" "$work/api.txt" || fail "the snapshot does not see $name, which the library has"
done
diff -u "$source/tests/install/api.txt" "$work/api.txt" >"$work/changes" || fail "include/mild is not what tests/install/api.txt says:
$(sed 1,2d "$work/changes")
If that is meant, see VERSIONING.md for what it asks (an alias, a line in CHANGELOG.md, a new version), then run
    scripts/api.py --names include/mild/*.h >tests/install/api.txt"

echo "$(grep -c '^```c' "$work/api.md") declarations on the page"
