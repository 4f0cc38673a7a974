#!/usr/bin/env bash
# The plugin in another version of MuJoCo: a leg falls as in that of .venv. Usage: test_version.sh VERSION BUILD_FOLDER
# Installs MuJoCo VERSION into BUILD_FOLDER/mujoco-VERSION and builds the plugin there.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
[ -n "$1" ] || { echo "test_version.sh: name a version, such as VERSION=3.3.7" >&2; exit 2; }
folder=$(realpath "$2")/mujoco-$1
export PYTHONDONTWRITEBYTECODE=1
"$root/.venv/bin/python" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check "mujoco==$1" # any, so without a hash
mujoco=$("$folder/venv/bin/python" -c 'import mujoco; print(mujoco.__path__[0])')
cmake -S "$root" -B "$folder/plugin" -DCMAKE_BUILD_TYPE=Release --log-level=WARNING -DMILD_APP=OFF -DMILD_TESTS=OFF \
    -DMILD_PLUGIN=ON "-DMUJOCO_ROOT=$mujoco"
cmake --build "$folder/plugin" --parallel 2 --target mild_plugin >/dev/null
"$root/.venv/bin/python" "$root/tests/plugin/version.py" "$2/mujoco_plugin/libmild_plugin.so" >"$folder/falls.json"
"$folder/venv/bin/python" "$root/tests/plugin/version.py" "$folder/plugin/mujoco_plugin/libmild_plugin.so" "$folder/falls.json"
