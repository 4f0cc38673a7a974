#!/usr/bin/env bash
# libmild as a release for any processor of the last decade is small. Usage: test_size.sh SOURCE_FOLDER MOST_BYTES
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() {
    echo "FAIL: $*" >&2
    exit 1
}

cmake -S "$1" -B "$work" -DCMAKE_BUILD_TYPE=Release -DMILD_MARCH=x86-64-v3 -DMILD_APP=OFF -DMILD_TESTS=OFF -DMILD_PYTHON=OFF \
    >"$work/log" 2>&1 || fail "$(cat "$work/log")"
cmake --build "$work" --target mild_shared >"$work/log" 2>&1 || fail "$(cat "$work/log")"
strip -o "$work/small" "$work/src/libmild.so"
size=$(stat -c %s "$work/small")
echo "libmild.so, stripped, for x86-64-v3: $size B; at most $2"
[ "$size" -le "$2" ] || fail "libmild.so is larger than it may be; see cmake/Ground.cmake"
