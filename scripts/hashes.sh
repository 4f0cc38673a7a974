#!/usr/bin/env bash
# Renews the *.txt that pip installs from, with the hashes of everything in them, for all platforms: scripts/hashes.sh [--upgrade] [FILE.in ...],
# all without a FILE. Change a version in a *.in first; --upgrade takes newer versions of what is only needed by others.
set -euo pipefail
cd "$(dirname "$0")/.."
upgrade=()
[ "${1:-}" != --upgrade ] || { upgrade=(--upgrade); shift; }
if ! [ -x build/uv/bin/uv ]; then
    python3 -m venv build/uv
    build/uv/bin/pip install --quiet --disable-pip-version-check --require-hashes -r scripts/uv.txt
fi
[ $# -gt 0 ] || set -- scripts/{requirements,uv,site,wheel,wheels,cuda,learners,mjlab,newton,isaaclab,jax,notebooks}.in lab/drive/dds.in lab/paper/requirements.in tests/export/requirements.in
for file; do
    version=3.11
    [[ $file != *isaaclab.in ]] || version=3.12 # the only one that it is for
    build/uv/bin/uv pip compile --quiet --generate-hashes --python-version $version --no-emit-index-url --no-emit-find-links \
        --custom-compile-command "scripts/hashes.sh $file" "${upgrade[@]}" --output-file "${file%.in}.txt" "$file"
    echo "hashes: ${file%.in}.txt"
done
