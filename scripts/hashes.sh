#!/usr/bin/env bash
# Renews the *.txt that pip installs from, with the hashes of everything in them, for all platforms: scripts/hashes.sh [--upgrade] [GROUP ...],
# all without a GROUP. Change a version in [dependency-groups] of pyproject.toml first; --upgrade takes newer versions of what is only needed
# by others.
set -euo pipefail
cd "$(dirname "$0")/.."
upgrade=()
[ "${1:-}" != --upgrade ] || { upgrade=(--upgrade); shift; }
if ! [ -x build/uv/bin/uv ]; then
    python3 -m venv build/uv
    build/uv/bin/pip install --quiet --disable-pip-version-check --require-hashes -r scripts/uv.txt
fi
[ $# -gt 0 ] || set -- requirements uv site wheel wheels cuda learners mjlab newton isaaclab jax notebooks dds paper export
for group; do
    version=3.11 file=scripts/$group.txt more=()
    case $group in
    isaaclab) version=3.12 ;; # the only one that it is for
    dds) file=lab/drive/dds.txt ;;
    paper) file=lab/paper/requirements.txt more=(--constraints scripts/requirements.txt) ;; # into the same environment
    export) file=tests/export/requirements.txt ;;
    esac
    build/uv/bin/uv pip compile --quiet --generate-hashes --python-version $version --no-emit-index-url --no-emit-find-links \
        --custom-compile-command "scripts/hashes.sh $group" "${upgrade[@]}" "${more[@]}" --output-file "$file" --group "$group"
    echo "hashes: $file"
done
