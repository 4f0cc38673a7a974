#!/usr/bin/env bash
# Makes policies/mild.safetensors again, from nothing, in about 45 minutes on two cores; the same numbers each time (same
# machine, same build). First a walk; then, from the same run, speed worth twice as much; last, short steps to end on.
set -euo pipefail
cd "$(dirname "$0")/.."
run=${1:-runs/ship}
speed=(--reward.linear_velocity=4 --reward.yaw_rate=1.5)
build/mild train --config configs/quick.ini --out "$run" --train.minutes=0 --train.iterations=628
build/mild train --out "$run" --resume --train.minutes=0 --train.iterations=1500 "${speed[@]}" --ppo.kl_target=0.015
build/mild train --out "$run" --resume --train.minutes=0 --train.iterations=1660 "${speed[@]}" --ppo.kl_target=0.003 \
    --ppo.learning_rate_max=0.0001
cp "$run/policy.safetensors" policies/mild.safetensors
