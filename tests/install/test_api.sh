#!/usr/bin/env bash
# Every public name is documented, the check sees what is not, and the page has them all. Usage: test_api.sh SOURCE_FOLDER
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

cat >"$work/bare.h" <<'END'
/* A header. Thread safety: none. */
/* A struct. */
typedef struct {
    double length; /* how long */
    int count;
} Bare;
/* Makes one. */
Bare *bare_create(MildError *error);

double bare_length(const Bare *bare);
END
for gap in 'bare.h:4: Bare.length: the unit' 'bare.h:5: Bare.count has no remark' 'bare.h:8: bare_create: what happens on failure' \
    'bare.h:10: bare_length has no remark'; do
    ("${api[@]}" --check "$work/bare.h" || true) | grep -q "$gap" || fail "the check does not see: $gap"
done
! "${api[@]}" --check "$work/bare.h" >/dev/null || fail "gaps, but exit 0"

"${api[@]}" "$source"/include/mild/*.h >"$work/api.md"
for name in $(grep -oh '\bmild_[a-z0-9_]* *(' "$source"/include/mild/*.h | tr -d ' (' | sort -u); do
    grep -q "\b$name\b" "$work/api.md" || fail "$name is not on the page"
done
echo "$(grep -c '^```c' "$work/api.md") declarations on the page"
