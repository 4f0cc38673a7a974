#!/usr/bin/env bash
# Every public name is documented, the check sees what is not, and the page has them all. What is public is what api.txt says.
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
# The snapshot: a change of the interface is meant, or it is a mistake.
"${api[@]}" --names "$source"/include/mild/*.h >"$work/api.txt"
for name in $(nm -g --defined-only "${2:-/dev/null}" 2>/dev/null | awk 'NF == 3 && $3 !~ /^mild_inside_/ { print $3 }' | sort -u); do # inside: for libmild_batch
    grep -qw "$name" "$work/api.txt" || fail "the snapshot does not see $name, which the library has"
done
diff -u "$source/tests/install/api.txt" "$work/api.txt" >"$work/changes" || fail "include/mild is not what tests/install/api.txt says:
$(sed 1,2d "$work/changes")
If that is meant, see VERSIONING.md for what it asks (an alias, a line in CHANGELOG.md, a new version), then run
    scripts/api.py --names include/mild/*.h >tests/install/api.txt"
"${api[@]}" --names "$source/include/mild/map.h" >"$work/map.txt"
mkdir "$work/changed"
for change in '/^    double amplitude;/d' 's/^    double slope;/    float slope;/' 's/ROW(WAVES, waves)/ROW(SWELL, swell)/' \
    '/^size_t mild_map_bytes/d' 's/MILD_MAP_TILES 5/MILD_MAP_TILES 6/'; do
    sed "$change" "$source/include/mild/map.h" >"$work/changed/map.h"
    "${api[@]}" --names "$work/changed/map.h" >"$work/other.txt"
    ! cmp -s "$work/map.txt" "$work/other.txt" || fail "the snapshot does not see $change"
done

echo "$(grep -c '^```c' "$work/api.md") declarations on the page"
