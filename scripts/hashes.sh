#!/usr/bin/env bash
# Renews the *.txt that pip installs from, with the hashes of everything in them: scripts/hashes.sh [FILE.in ...], all without a FILE.
# Change a version in a *.in first; add --upgrade to take newer versions of what is only needed by others. Python 3.11.
set -euo pipefail
cd "$(dirname "$0")/.."
upgrade=()
[ "${1:-}" != --upgrade ] || { upgrade=(--upgrade); shift; }
if ! [ -x build/pip-tools/bin/pip-compile ]; then
    python3 -m venv build/pip-tools
    build/pip-tools/bin/pip install --quiet --disable-pip-version-check --require-hashes -r scripts/pip-tools.txt
fi
[ $# -gt 0 ] || set -- scripts/{requirements,pip-tools,site,wheel,learners}.in scripts/paper/requirements.in tests/export/requirements.in
for file; do
    CUSTOM_COMPILE_COMMAND="scripts/hashes.sh $file" build/pip-tools/bin/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras \
        --no-emit-index-url --no-emit-trusted-host --no-emit-find-links "${upgrade[@]}" --output-file "${file%.in}.txt" "$file"
    echo "hashes: ${file%.in}.txt"
done
