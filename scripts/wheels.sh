#!/usr/bin/env bash
# Makes the wheel, build/dist/mildground-VERSION-cp311-abi3-manylinux_*.whl, and tries it in bare environments, one for each CPython
# 3.11 or newer that is found. Usage: [MARCH=x86-64-v3] scripts/wheels.sh [--plain | WHEEL] [--untried | --chroot [SUITE ...] | PYTHON ...]
# --plain     without the second copy for AVX-512: half the time to compile. WHEEL: not made, but this one looked at and tried.
# --untried   made and looked at alone. PYTHON: tried with these interpreters instead.
# --chroot    tried in bare Debians with their own Python instead (bookworm has 3.11, trixie 3.13, forky 3.14): root, debootstrap, 400 MB
#             of disk.
set -euo pipefail
shopt -s extglob nullglob
cd "$(dirname "$0")/.."
root=$PWD/build/dist march=${MARCH:-x86-64-v3} second=x86-64-v4 most=40 # [MB]
[ "$march" != native ] || march=x86-64-v3
wheel='' made=''
case ${1:-} in
--plain) second='' && shift ;;
*.whl) wheel=$(realpath "$1") && shift ;;
esac

fail() { echo "wheels: $*" >&2; exit 1; }
said() { echo "wheels: $*"; }
# quiet COMMAND...: what it prints is shown when it fails.
quiet() {
    "$@" >"$root/log" 2>&1 || { tail -40 "$root/log" >&2; fail "failed: $*"; }
}

make_wheel() {
    local begin=$SECONDS
    if command -v ccache >/dev/null; then
        export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
    fi
    if command -v emcc >/dev/null; then # as `make web`; cmake/Wheel.cmake takes build/web
        quiet cmake -S . -B build -DCMAKE_BUILD_TYPE=Release -DMILD_LAB=ON --log-level=WARNING
        quiet scripts/web.sh
    fi
    rm -rf "$root"/raw "$root"/mildground-*.whl
    quiet .venv/bin/python -m pip wheel --disable-pip-version-check --no-deps --no-build-isolation -w "$root/raw" . \
        --config-settings=cmake.define.MILD_MARCH="$march" --config-settings=cmake.define.MILD_SECOND_MARCH=$second
    # Libraries that not every Linux has come along, in mildground.libs. MuJoCo is a neighbour, or the program's own.
    quiet auditwheel repair --exclude 'libmujoco.so.*' --wheel-dir "$root" "$root"/raw/mildground-*.whl
    wheel=$(echo "$root"/mildground-*.whl) made=yes
    said "$(basename "$wheel") for $march${second:+ and $second}, made in $((SECONDS - begin)) s"
}

look_at_wheel() {
    local size platform library inside=$root/inside
    size=$(stat -c %s "$wheel")
    said "$(((size + 500000) / 1000000)) MB, at most $most"
    ((size <= most * 1000000)) || fail "larger than $most MB"
    quiet auditwheel show "$wheel"
    platform=$(tr '\n' ' ' <"$root/log" | sed -n 's/.*constrains the platform tag to "\([a-z0-9_]*\)".*/\1/p') # MuJoCo apart
    [[ $wheel = *-abi3-"${platform:-?}".whl ]] || fail "$(basename "$wheel") is of the platform $platform"
    quiet abi3audit --strict "$wheel"
    # What each file links is in mildground.libs, MuJoCo's, or on every Linux (PEP 600); of the library of windows, X11.
    rm -rf "$inside"
    .venv/bin/python -m zipfile -e "$wheel" "$inside"
    for library in $(find "$inside" -type f -exec readelf -d {} \; 2>/dev/null | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' | sort -u); do
        case $library in
        lib[cm].so.6 | lib@(dl|rt|pthread).so.[0-9] | ld-linux-x86-64.so.2 | libgcc_s.so.1 | libstdc++.so.6 | libz.so.1 | libX11.so.6) ;;
        libmujoco.so.*) ;;
        *) [ -e "$inside/mildground.libs/$library" ] || fail "$library is neither in the wheel nor on every Linux" ;;
        esac
    done
    ! grep -rlF "$PWD" "$inside" || fail "these name a folder of this machine"
    # The page of `mild web`: whole where it could be made.
    if [ -n "$made" ] && [ -d build/web ]; then
        diff -r build/web "$inside/mild/data/build/web" >"$root/log" 2>&1 || fail "not the page of build/web: $(head -3 "$root/log")"
        said "has the page of mild web"
    elif [ ! -e "$inside/mild/data/build/web/index.html" ]; then
        said "without the page of mild web: emcc was missing; \`scripts/setup.sh web\` installs it"
    fi
    rm -rf "$inside"
    said "links what every Linux of $platform has; abi3audit finds nothing"
}

# Interpreters on the PATH and of pyenv, one of each version.
interpreters() {
    local version python
    for version in 3.11 3.12 3.13 3.14 3.15; do
        for python in /usr/bin/python$version "$(command -v python$version)" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/$version*/bin/python$version; do
            if [ -x "$python" ] && "$python" -c 'import venv, ensurepip' 2>/dev/null; then
                echo "$python"
                break
            fi
        done
    done
}

# try_wheel PYTHON: as a user who has nothing: no display, no tree beside, nothing on the PATH but the system's.
try_wheel() {
    local begin python=$1 version folder tree=$PWD
    version=$("$python" -c 'import sys; print("%d.%d.%d" % sys.version_info[:3])')
    folder=$root/try-$version
    rm -rf "$folder"
    "$python" -m venv "$folder"
    mkdir "$folder/empty"
    begin=$(date +%s%N)
    quiet "$folder/bin/pip" install --disable-pip-version-check --require-hashes -r scripts/wheel.txt
    quiet "$folder/bin/pip" install --disable-pip-version-check --no-deps "$wheel"
    bare "$folder" play --seconds 1 >"$folder/walk.txt" 2>&1 || { cat "$folder/walk.txt" >&2; fail "play"; }
    grep -q '0.0 s  x .* m/s' "$folder/walk.txt" && grep -q '^sand_loose .* yes ' "$folder/walk.txt" || fail "play: $(cat "$folder/walk.txt")"
    local seconds=$((($(date +%s%N) - begin) / 1000000))
    quiet "$folder/bin/pip" check # scripts/wheel.txt has all that the wheel asks for
    (cd "$folder/empty" && "$tree/tests/install/use_wheel.sh" "$folder/bin")
    said "Python $version: $((seconds / 1000)).$((seconds % 1000 / 100)) s from pip install to a picture of a walk"
    rm -rf "$folder"
}
# The tutorials' set-up, word for word; the wheel is made.
try_setup() {
    [[ $wheel = "$root"/* ]] || return 0 # it is a wheel from elsewhere
    .venv/bin/python tests/install/test_tutorials.py .
}
# try_chroot SUITE: in a bare Debian, where nothing but its Python is installed, as a user without root. What pip would fetch lies there already.
try_chroot() {
    local chroot=$root/chroot fetched=$root/chroot/tmp/fetched begin seconds version
    source scripts/chroot.sh
    make_chroot "$chroot" "$root/log" "$1"
    mount -t proc proc "$chroot/proc" # programs find themselves by it
    trap 'umount "$root/chroot/proc"' EXIT
    quiet chroot "$chroot" env DEBIAN_FRONTEND=noninteractive apt-get -qq install --no-install-recommends -y python3-venv
    version=$(chroot "$chroot" python3 -c 'import sys; print("%d.%d.%d" % sys.version_info[:3])')
    quiet .venv/bin/python -m pip download --disable-pip-version-check --require-hashes --only-binary=:all: --python-version "$version" \
        -d "$fetched" -r scripts/wheel.txt
    cp "$wheel" "$fetched"
    cp --parents -rt "$chroot/tmp" tests/install tests/python/check_wheel.py examples/python robots policies # what use_wheel.sh runs
    chmod -R a+rX "$chroot/tmp"/*
    inside() { chroot "$chroot" su -s /bin/bash nobody -c "cd /var/tmp && export HOME=/var/tmp && $1"; }
    quiet inside 'python3 -m venv mine'
    begin=$(date +%s%N)
    quiet inside 'mine/bin/pip install --no-index --find-links /tmp/fetched mildground && mine/bin/mild play --seconds 1 >walk.txt'
    seconds=$((($(date +%s%N) - begin) / 1000000))
    grep -q '0.0 s  x .* m/s' "$chroot/var/tmp/walk.txt" && grep -q '^sand_loose .* yes ' "$chroot/var/tmp/walk.txt" ||
        fail "play: $(cat "$chroot/var/tmp/walk.txt")"
    ((seconds < 60000)) || fail "a bare Debian $1: $seconds ms"
    quiet inside 'mine/bin/pip install --no-index --find-links /tmp/fetched gymnasium'
    inside 'mkdir empty && cd empty && /tmp/tests/install/use_wheel.sh /var/tmp/mine/bin'
    said "a bare Debian $1, Python $version: $((seconds / 1000)).$((seconds % 1000 / 100)) s from pip install to a picture of a walk"
    umount "$chroot/proc"
    trap - EXIT
    rm -rf --one-file-system "$chroot"
}
# bare VENV ARGUMENTS...: its program.
bare() {
    (cd "$1/empty" && env -i PATH=/usr/bin:/bin "$1/bin/mild" "${@:2}" </dev/null)
}

mkdir -p "$root"
tools=$root/tools
cmp -s scripts/wheels.txt "$tools/installed" || {
    .venv/bin/python -m venv --clear "$tools"
    quiet "$tools/bin/pip" install --disable-pip-version-check --require-hashes -r scripts/wheels.txt
    cp scripts/wheels.txt "$tools/installed"
}
export PATH=$tools/bin:$PATH
[ -n "$wheel" ] || make_wheel
look_at_wheel
case ${1:-} in
--untried) exit 0 ;;
--chroot)
    shift
    for suite in "${@:-bookworm}"; do
        try_chroot "$suite"
    done
    exit 0
    ;;
esac
[ $# -gt 0 ] || mapfile -t found < <(interpreters)
try_setup
for python in "${@:-${found[@]}}"; do
    try_wheel "$python"
done
