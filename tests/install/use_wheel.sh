#!/usr/bin/env bash
# Uses an installed wheel as somebody who has nothing else does: evaluates, presses, trains, reports, carries a foot, steps environments, serves the
# page, runs three examples; in the folder where it is started, which is empty. Needs what scripts/wheel.txt lists. scripts/wheels.sh
# Usage: use_wheel.sh BIN_FOLDER_OF_THE_ENVIRONMENT
set -euo pipefail
bin=$1 tree=$(realpath "$(dirname "$0")/../..")
fail() { echo "wheels: $*" >&2; exit 1; }
mild() { env -i PATH=/usr/bin:/bin "$bin/mild" "$@" </dev/null; }
python() { env -i "$bin/python" "$@"; }

mild eval --robot sa01 --ground rubber --speed 0.5 --trials 1 --seconds 2 >eval.txt
grep -q '^rubber .* 1/1 ' eval.txt || fail "eval: $(cat eval.txt)"
mild press --ground foam45 --plate 0.1,0.1 --csv press.csv >/dev/null
mild train --out run --train.envs=16 --train.minutes=0 --train.iterations=2 --ppo.steps=4 --ppo.minibatches=2 >/dev/null 2>&1 || fail "train"
mild report run | grep -qx 'report run/report.html' || fail "report"
if mild train --out gpu --train.device=cuda 2>gpu.txt; then fail "a GPU without mildground_cuda"; fi
grep -q 'install the wheel mildground_cuda' gpu.txt || fail "train.device: $(cat gpu.txt)"
[ "$(mild --version)" = "$(python -m mild --version)" ] || fail "python -m mild"
python "$tree/tests/python/check_wheel.py"
MILD_PROCESSOR=x86-64-v3 "$bin/python" "$tree/tests/python/check_wheel.py" >/dev/null
env -i PATH=/usr/bin:/bin "$bin/python" "$tree/tests/install/check_page.py" "$bin/mild" \
    "$(echo "$bin"/../lib/python3*/site-packages/mild)/data/build/web"
for example in plate gym_random walk; do
    python "$tree/examples/python/$example.py" >/dev/null
done
