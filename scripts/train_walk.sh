#!/usr/bin/env bash
# Trains the shipped policy from nothing on one GPU, 29 minutes on an H100: configs/walk.ini is the last of four stages. Each
# goes on from the one before. docs/training-log.md says why there are four.
# Usage: scripts/train_walk.sh FOLDER
set -euo pipefail
if [ $# -ne 1 ]; then
    echo 'train_walk: usage: scripts/train_walk.sh FOLDER' >&2
    exit 2
fi
out=$1
mild=${MILD:-build/mild}
config="$(dirname "$0")/../configs/walk.ini"

level=(--terrain.kind=flat --randomize.push_linear=0.3 --randomize.push_angular=0.3 --task.wz="-1 1"
    --reward.linear_velocity=5 --reward.yaw_rate=1.5 --reward.reference_motion=2.2 --reward.torque=-1e-10)

# 1: a gait, led by the reference motion
"$mild" train --config "$config" --out "$out" "${level[@]}" --train.iterations=2600 --ppo.anneal="2000 2600" \
    --ppo.std_max="10 0.12" --reward.tracking_sharpness=5
# 2: speeds far from the present one: a wider tracking term
"$mild" train --config "$config" --out "$out" --resume "${level[@]}" --train.iterations=5200 --ppo.anneal="4600 5200" \
    --ppo.std_max="10 0.12"
# 3: less of the reference motion, a price on torque, gentle terrain, more noise
"$mild" train --config "$config" --out "$out" --resume --train.iterations=9900 --ppo.anneal="0 0" --ppo.std_min=0.2 \
    --ppo.std_max="10 0.2" --reward.yaw_rate=1.5 --reward.torque=-3e-4 --terrain.slope=0.12 --terrain.amplitude=0.03 \
    --randomize.push_linear=0.4 --randomize.push_angular=0.4 --task.wz="-1 1"
# 4: walk.ini as it is: twice the price, the whole terrain, strong pushes
"$mild" train --config "$config" --out "$out" --resume
