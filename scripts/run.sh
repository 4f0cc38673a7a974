#!/usr/bin/env bash
# The tour of `make run`: watch the shipped policy walk, train one further, compare all on one course. START=none: train one from nothing.
set -euo pipefail
cd "$(dirname "$0")/.."
minutes=${MINUTES:-5}
mild=build/mild
shipped=policies/mild.safetensors
start=${START:-policies/paper/mild_merged_slips-1.safetensors} # two and a half minutes of training on a GPU (lab/paper/train.sh)
# A training of fewer policy steps changes less than the table shows: a minute on two cores (docs/log.md).
least=480000
run=runs/tour # its own folder, a new one each time
for ((n = 2; ; n++)); do
    [ -e "$run" ] || break
    run=runs/tour$n
done
trained=$run/policy.safetensors
course=(--ground rubber,foam45,sand_loose --speed 0.3,0.6 --trials 5 --seconds 20)

if ! [[ $minutes =~ ^[0-9]+(\.[0-9]+)?$ ]]; then
    echo "run: MINUTES=$minutes is not a number of minutes" >&2
    exit 2
fi
mkdir -p out runs

echo "1/3  The shipped policy walks from rubber over foam onto loose sand."
"$mild" play --policy "$shipped" --ground rubber,foam45,sand_loose --video out/walk.mp4 --pressure out/pressure.png

echo
# What it begins with walks, so it learns one thing more: to pay for power (reward.power) at the same speed. Few robots, because
# each must live longer than its first steps in so short a time; little noise and small updates, so that it does not forget.
begin=(--train.start="$start" --train.envs=256 --ppo.steps=24 --ppo.optimizer=adam --ppo.matmul=fp32 --ppo.learning_rate=1e-4 --ppo.kl_target=0.01 --ppo.std_max="0.12 0.12"
    --ppo.anneal="0 0" --reward.linear_velocity=15 --reward.power=-0.004)
if [ "$start" = none ]; then
    begin=()
    echo "2/3  A policy of your own, from nothing, in $minutes minutes. On two cores a walk takes ten."
else
    echo "2/3  A policy of your own, in $minutes minutes, from $start."
fi
echo "     Ctrl-C ends the training early and keeps what it has."
set -m # the training is a job of its own: Ctrl-C reaches it alone, and this script goes on
"$mild" train --config configs/quick.ini --train.minutes="$minutes" --out "$run" "${begin[@]}"
set +m

echo
steps=$(awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "rate/steps") column = i } END { print $column }' "$run/log.csv")
if ((steps < least)); then
    echo "3/3  Not compared: $steps policy steps change less than a table shows. It takes $least; MINUTES=N gives it more time."
    echo "Video out/walk.mp4, sole pressure out/pressure.png, training log $run/log.csv, your policy $trained."
    exit
fi
echo "3/3  The policies on the same course. Look at the cost of transport."
tables=(shipped=out/shipped.json)
if [ "$start" != none ]; then
    "$mild" eval --policy "$start" "${course[@]}" --json out/start.json >out/start.txt
    tables+=(start=out/start.json)
fi
"$mild" eval --policy "$shipped" "${course[@]}" --json out/shipped.json >out/shipped.txt
"$mild" eval --policy "$trained" "${course[@]}" --json out/trained.json >out/trained.txt
.venv/bin/python scripts/compare.py "${tables[@]}" yours=out/trained.json
echo
echo "Video out/walk.mp4, sole pressure out/pressure.png, training log $run/log.csv, your policy $trained."
