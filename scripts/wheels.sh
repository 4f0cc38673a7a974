#!/usr/bin/env bash
# Makes the wheel that is published, build/wheels/mild-VERSION-cp311-abi3-manylinux_*.whl, and tries it in bare environments, one
# for each CPython 3.11 or newer that is found. Usage: scripts/wheels.sh [--plain] [PYTHON ...]
# --plain   without the second copy for AVX-512: half the time to compile. PYTHON: these interpreters instead.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD/build/wheels second=x86-64-v4 most=40 # [MB]
if [ "${1:-}" = --plain ]; then
    second=
    shift
fi
fail() { echo "wheels: $*" >&2; exit 1; }
said() { echo "wheels: $*"; }
# mutes COMMAND...: what it prints is shown when it fails.
mutes() {
    "$@" >"$root/log" 2>&1 || { tail -40 "$root/log" >&2; fail "failed: $*"; }
}

# ---- make ----

mkdir -p "$root"
tools=$root/tools/bin
cmp -s scripts/wheels.txt "$root/tools/installed" || {
    .venv/bin/python -m venv --clear "$root/tools"
    mutes "$tools/pip" install --disable-pip-version-check --require-hashes -r scripts/wheels.txt
    cp scripts/wheels.txt "$root/tools/installed"
}
rm -rf "$root/raw" "$root"/mild-*.whl "$root"/try-*
begin=$SECONDS
mutes .venv/bin/python -m pip wheel --disable-pip-version-check --no-deps --no-build-isolation -w "$root/raw" . \
    --config-settings=cmake.define.MILD_SECOND_MARCH=$second
raw=$(echo "$root"/raw/mild-*.whl)
# Libraries that are not of every Linux come along, in mild.libs. MuJoCo is a neighbour, or the program's own.
export PATH=$tools:$PATH
mutes auditwheel repair --exclude 'libmujoco.so.*' --wheel-dir "$root" "$raw"
wheel=$(echo "$root"/mild-*.whl)
said "$(basename "$wheel"), compiled in $((SECONDS - begin)) s"

# ---- what it is ----

size=$(stat -c %s "$wheel")
said "$((size / 1000000)) MB, at most $most"
((size <= most * 1000000)) || fail "larger than $most MB"
mutes auditwheel show "$wheel"
tags=$(tr '\n' ' ' <"$root/log" | grep -oE 'manylinux_[0-9]+_[0-9]+_x86_64' | sort -Vu | head -1)
[[ $(basename "$wheel") = *-"$tags".whl || $(basename "$wheel") = *"$tags"* ]] || fail "its name says another platform than $tags"
mutes abi3audit --strict "$wheel"
rm -rf "$root/inside"
"$tools/python" -m zipfile -e "$wheel" "$root/inside"
# Each file finds what it links: in mild.libs, as MuJoCo's neighbour, or on every Linux (PEP 600, plus libX11 of the window's library).
outside=$(find "$root/inside" -type f -exec sh -c 'readelf -d "$1" 2>/dev/null' _ {} \; | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p' | sort -u |
    grep -vE '^(lib(c|m|dl|rt|pthread|gcc_s|z|X11)\.so\.[0-9]|libstdc\+\+\.so\.6|ld-linux-x86-64\.so\.2|libmujoco\.so\.[0-9.]+)$' || true)
for library in $outside; do
    [ -e "$root/inside/mild.libs/$library" ] || fail "$library is not in the wheel"
done
! grep -rlF "$PWD" "$root/inside" || fail "these name a folder of this machine"
said "links nothing that is not on every Linux of $tags; abi3audit found nothing"
