#!/usr/bin/env bash
# scripts/plugin_walk.py, position actuators under plain mj_step, walks as in `mild eval` without noise and delay.
# Usage: test_example.sh PATH_TO_MILD PYTHON PLUGIN
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$root/tests/kit.sh" "$1"
python=$2
export MILD_PLUGIN=$3 PYTHONDONTWRITEBYTECODE=1

# same ROBOT POLICY CONFIG GROUND STEP INTEGRATOR BOUND: the share by which the speeds may differ. Euler is eval's own integrator;
# the others damp by the gains kd at the end of the step. plugin_walk.py has ground under the feet alone and no
# speed hold, and so has eval here.
same() {
    { cat "$root/configs/$3.ini"; printf '\n[task]\nobserve_noise = false\n[randomize]\nlatency = 0 0\n'; } >exact.ini
    "$mild" eval --policy "$root/policies/$2.safetensors" --config exact.ini --ground "$4" --speed 0.5 --seconds 10 --trials 2 \
        --task.physics_dt="$5" --task.shells_stand=false --task.speed_hold=0 --json eval.json >/dev/null || fail "eval of $1"
    local plain
    plain=$("$python" "$root/scripts/plugin_walk.py" "$1" --ground "$4" --step "$5" --integrator "$6" --trials 1) ||
        fail "plugin_walk.py $1"
    "$python" - eval.json "$plain" "$7" <<'CHECK' || fail "$plain"
import json, re, sys
row = json.load(open(sys.argv[1]))["rows"][0]
speed = float(re.search(r"1 of 1 upright, (.*) m/s", sys.argv[2])[1])
print(f"{sys.argv[2]}; {row['velocity']:.4f} m/s in eval")
assert row["success"] == 2 and abs(speed - row["velocity"]) < float(sys.argv[3]) * row["velocity"]
CHECK
}
same sa01 mild walk foam45 0.001 Euler 0.004
same go1 go1 go1 grass 0.005 Euler 0.004
same g1 g1 g1 grass 0.002 Euler 0.004
same g1 g1 g1 foam45 0.002 discrete 0.02

# mistakes are one line
walk() { "$python" "$root/scripts/plugin_walk.py" "$@"; }
bad "plugin_walk.py: robots/go1/robot.ini corners" walk go1 --time
bad "plugin_walk.py: --step 0.003 0.01" walk sa01 --step 0.003
bad "plugin_walk.py: none --plugin MILD_PLUGIN" walk sa01 --plugin none
finish "policies walk under plain mj_step"
