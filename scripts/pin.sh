#!/usr/bin/env bash
# scripts/pin.sh "reason": sets the numbers that tests/pins compares to those that this tree computes now. It rewrites the
# rows of this platform and those of all platforms in tests/pins.txt, and appends date, platform and reason to that file.
# BUILD=FOLDER: a configured build other than build/, for the rows of another compiler. After a merge conflict, take
# either side of tests/pins.txt and run this again.
set -euo pipefail
cd "$(dirname "$0")/.."
reason=${1-}
build=${BUILD:-build}
pins=tests/pins.txt
if [ -z "${reason//[[:space:]]/}" ] || [ $# -ne 1 ]; then
    echo 'usage: scripts/pin.sh "why the numbers change"' >&2
    exit 2
fi
if [ ! -f "$build/CMakeCache.txt" ]; then
    echo "pin: no build in $build; run make build, or set BUILD" >&2
    exit 2
fi
cmake --build "$build" --target pins_test_pins --parallel "${JOBS:-$(nproc)}" >/dev/null
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if ! PIN_ROWS="$work/new" "$build/tests/pins_test_pins" >"$work/log" 2>&1; then
    cat "$work/log" >&2
    exit 1
fi
platform=$(awk '$1 != "any" { print $1; exit }' "$work/new")

# A number that changed here has changed on other platforms too. Their rows for it are removed, until someone renews them there.
awk -v new="$work/new" -v count="$work/count" '
    BEGIN {
        while ((getline line < new) > 0) {
            split(line, row, " ")
            value[row[1] " " row[2]] = row[3]
        }
    }
    FNR == NR {
        if ($0 !~ /^#/ && NF == 3) {
            key = $1 " " $2
            if (key in value && value[key] != $3) {
                changed[$2] = 1
            }
            old[key] = $3
        }
        next
    }
    /^#/ || NF != 3 { next }
    $1 == "any" { next } # all of them are in the new ones
    !($2 in changed) && !(($1 " " $2) in value) { print }
    END {
        for (key in value) {
            print key, value[key]
            differ += !(key in old) || old[key] != value[key]
            total++
        }
        for (key in old) {
            differ += !(key in value) && key ~ /^any /
        }
        print differ + 0, total > count
    }' "$pins" "$pins" | LC_ALL=C sort >"$work/rows"
read -r differ total <"$work/count"
if [ "$differ" = 0 ]; then
    echo "pin: all $total numbers of $platform are as pinned; nothing written"
    exit 0
fi
{
    sed -n '1,/^# history/p' "$pins"
    sed '1,/^# history/d' "$pins" | grep '^#' || true
    echo "# $(date -u +%F) $platform: $reason ($differ of $total)"
    cat "$work/rows"
} >"$work/pins"
cp "$work/pins" "$pins"
echo "pin: $differ of $total numbers of $platform renewed in $pins"
