#!/usr/bin/env bash
# Installs what building, running and testing need, except what is already installed. Safe to repeat.
# Usage: scripts/setup.sh [check|web|cuda]; with `check` also what `make check` needs, with `web` what the page does, with `cuda` the
# headers of CUTLASS for the learner on a Hopper.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
    build-essential cmake
    libdnnl-dev libinih-dev libcjson-dev libpng-dev libsodium-dev zlib1g-dev
    libopenmpi-dev openmpi-bin
    libprotobuf-c-dev protobuf-c-compiler libonnx-dev
    libcmocka-dev
    libglfw3-dev libgl-dev libosmesa6-dev libegl-dev libegl1 libgl1-mesa-dri
    ffmpeg
    python3-venv python3-dev
)
if [ "${1:-}" = check ]; then
    packages+=(
        clang-14 clang-format-14 clang-tidy-14 libclang-rt-14-dev llvm-14
        gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user
    )
fi
if [ "${1:-}" = web ]; then
    packages+=(emscripten chromium)
fi

if ! command -v dpkg-query >/dev/null; then
    echo "setup: this script installs Debian packages, and dpkg-query is not here." >&2
    echo "setup: install the equivalents of: ${packages[*]}" >&2
    echo "setup: then build with: cmake -S . -B build -DMUJOCO_ROOT=FOLDER -DDAQP_ROOT=FOLDER && cmake --build build" >&2
    exit 1
fi

installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null || true)
missing=()
for package in "${packages[@]}"; do
    grep -qx "$package installed" <<<"$installed" || missing+=("$package")
done

if ((${#missing[@]})); then
    if (($(id -u) != 0)); then
        echo "setup: Debian packages are missing. Ask an administrator to run this one command, then repeat yours:" >&2
        echo >&2
        echo "    apt-get update && apt-get install --no-install-recommends -y ${missing[*]}" >&2
        echo >&2
        exit 1
    fi
    echo "setup: installing ${#missing[@]} Debian packages: ${missing[*]}"
    export DEBIAN_FRONTEND=noninteractive
    scripts/quietly.sh build/log/update.log "setup: lists of packages" apt-get -q update
    scripts/quietly.sh build/log/packages.log "setup: Debian packages" \
        apt-get -q install --no-install-recommends -y "${missing[@]}"
fi

cutlass= # bool: also where it was before .venv is made anew
if [ "${1:-}" = cuda ] || [ -e .venv/cutlass.installed ]; then
    cutlass=1
fi

# The private environment holds the MuJoCo wheel (library and headers), matplotlib (figures), and what the Python package
# is built and tested with. The copy of the requirements inside it is written last, so that an interrupted installation is repeated.
pinned() { sed '/^ *#/d' "$1" 2>/dev/null; } # without remarks, which change nothing that is installed
if ! cmp -s <(pinned scripts/requirements.txt) <(pinned .venv/requirements.installed); then
    python=/usr/bin/python3
    [ -x "$python" ] || python=python3
    "$python" -m venv --clear .venv # from nothing: two MuJoCo wheels side by side would be ambiguous
    scripts/quietly.sh build/log/venv.log "setup: .venv, the private Python environment" \
        .venv/bin/python -m pip install --progress-bar off --disable-pip-version-check --require-hashes -r scripts/requirements.txt
    cp scripts/requirements.txt .venv/requirements.installed
fi

# Sources that are built with ours: the archives of the package index, unpacked into .venv. source_of NAME: its line.
source_of() { grep "^$1==" scripts/sources.txt; }
if ! cmp -s <(source_of daqp) .venv/sources.installed; then
    rm -rf .venv/sources .venv/daqp-*
    scripts/quietly.sh build/log/sources.log "setup: sources of $(source_of daqp | cut -d' ' -f1)" \
        .venv/bin/python -m pip download --progress-bar off --disable-pip-version-check --no-deps --no-binary daqp --require-hashes \
        -d .venv/sources -r <(source_of daqp)
    tar -xzf .venv/sources/daqp-*.tar.gz -C .venv
    source_of daqp >.venv/sources.installed
fi

if [ -n "$cutlass" ] && ! cmp -s <(source_of nvidia-cutlass) .venv/cutlass.installed; then
    rm -rf .venv/cutlass* .venv/sources/nvidia_cutlass*
    scripts/quietly.sh build/log/cutlass.log "setup: headers of CUTLASS" \
        .venv/bin/python -m pip download --progress-bar off --disable-pip-version-check --no-deps --require-hashes \
        -d .venv/sources -r <(source_of nvidia-cutlass)
    .venv/bin/python -m zipfile -e .venv/sources/nvidia_cutlass-*.whl .venv/cutlass.unpacked
    mkdir .venv/cutlass
    mv .venv/cutlass.unpacked/cutlass_library/source/include .venv/cutlass.unpacked/*.dist-info/licenses .venv/cutlass/
    rm -rf .venv/cutlass.unpacked
    source_of nvidia-cutlass >.venv/cutlass.installed
fi
