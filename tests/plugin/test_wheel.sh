#!/usr/bin/env bash
# A wheel beside every MuJoCo that it supports, in environments as users make them (needs the network): the plugin that mild loads by
# itself lets a leg fall as in .venv, and the environments of 4.x are the same to the last bit.
# Usage: test_wheel.sh WHEEL BUILD_FOLDER [VERSION ...]; without a VERSION: all of scripts/mujoco.txt.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
wheel=$(realpath "$1") build=$(realpath "$2")
folder=$build/wheel-check
shift 2
export PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=
unset MILD_PLUGIN
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" # not the tree's own package
fail() { echo "test_wheel.sh: $*" >&2; exit 1; }

cat >own.py <<'END'
"""The file that mild.attach loads here, after a soft step that it made."""
import mujoco
import mild
from mild import _mujoco
spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="foot"><freejoint/><geom type="box" size=".1 .1 .1" mass="9"/></body>'
                                 '</worldbody></mujoco>')
mild.attach(spec, "foot", sensor="feet")
model = spec.compile()
data = mujoco.MjData(model)
data.qpos[2] = 0.09
mujoco.mj_step(model, data)
assert data.sensor("feet").data[2] > 1, "the ground carries nothing"
print(_mujoco.folder("libmild_plugin.so", "plugin") / "libmild_plugin.so")
END
cat >envs.py <<'END'
"""A digest of a hundred steps of environments, or the line that says what they need."""
import hashlib
import numpy as np
from mild import envs
try:
    task = envs.open_envs(4, threads=2)
except ImportError as error:
    print(error)
    raise SystemExit
history, reward = np.empty((4, task.frames, task.observation), "f4"), np.empty(4, "f4")
buffers = task.buffers(history=history, reward=reward, **{name: np.empty(4, bool) for name in ("done", "timeout", "valid")})
task.reset(buffers)
digest = hashlib.sha256()
for step in range(100):
    task.step(np.sin(0.3 * step + np.arange(4 * task.actions, dtype="f4")).reshape(4, -1), buffers)
    digest.update(history.tobytes() + reward.tobytes())
print(digest.hexdigest())
END
# try_it VENV: a soft step, the leg's falls, and the environments, which 3.x has not.
try_it() {
    local version here
    version=$("$1/bin/python" -c 'import mujoco; print(mujoco.mj_versionString())')
    here=$("$1/bin/python" own.py)
    [[ $here = */mild/mujoco/$version/libmild_plugin.so ]] || fail "MuJoCo $version got $here"
    "$1/bin/python" "$root/tests/plugin/version.py" "$here" falls.json
    "$1/bin/python" envs.py >digest
    case $version in
    3.*) grep -q "^environments: this package has none for MuJoCo $version, but for 4.0.0.*pip install" digest || fail "$(cat digest)" ;;
    *) [ -e envs.txt ] || cp digest envs.txt
       cmp digest envs.txt || fail "environments of MuJoCo $version are others" ;;
    esac
}
pip() { "$1/bin/python" -m pip --quiet --disable-pip-version-check "${@:2}"; }

"$root/.venv/bin/python" "$root/tests/plugin/version.py" "$build/mujoco_plugin/libmild_plugin.so" >falls.json

# as users do: the wheel, then MuJoCo or Gymnasium with it; and beside a MuJoCo that is there, which stays
for after in mujoco 'gymnasium[mujoco]'; do
    echo "wheel, then $after"
    rm -rf user
    python3 -m venv user
    pip user install "$wheel"
    pip user install "$after"
    pip user check
    try_it user
done
echo "MuJoCo 3.11.0, then the wheel"
rm -rf user
python3 -m venv user
pip user install mujoco==3.11.0
pip user install "$wheel"
pip user check
[ "$(user/bin/python -c 'import mujoco; print(mujoco.mj_versionString())')" = 3.11.0 ] || fail "the wheel changed the MuJoCo that was there"
try_it user

lines=$(sed 's/ .*//' "$root/scripts/mujoco.txt")
pip user uninstall --yes mujoco
for line in $lines; do
    [ $# = 0 ] || [[ " $* " = *" ${line#*==} "* ]] || continue
    pip user install --no-deps "$line"
    try_it user
    pip user uninstall --yes "${line%==*}" # two of them share a folder
done
echo "the wheel beside all of them"
