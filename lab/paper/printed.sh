#!/usr/bin/env bash
# Trains configs/paper.ini to the paper's budget, 4096 robots and 20 000 iterations, at 5 ms and with tf32 matrices, on one GPU (17 minutes of
# an H200), and walks it under its own configuration: FOLDER/policy.safetensors, FOLDER/eval.json and the table. A run that was cut goes on.
# TRIALS (10) of each ground and speed. Options go to the training: --train.device=cpu --train.envs=64 --train.iterations=100 needs no GPU.
# Usage: lab/paper/printed.sh FOLDER [--SECTION.KEY=VALUE ...]
set -euo pipefail
[[ $# -gt 0 && $1 != -* ]] || { echo "usage: lab/paper/printed.sh FOLDER [--SECTION.KEY=VALUE ...]" >&2; exit 2; }
out=$1
shift
mild=${MILD:-build/mild}
resume=()
[ ! -e "$out/config.ini" ] || resume=(--resume)
"$mild" train --config "$(dirname "$0")/../../configs/paper.ini" --out "$out" "${resume[@]}" --train.device=cuda --task.physics_dt=0.005 \
    --ppo.matmul=tf32 "$@"
"$mild" eval --policy "$out/policy.safetensors" --config "$out/config.ini" --train.device=cpu --train.robots=mujoco \
    --ground rigid,rubber,foam60,foam45,foam28,foam25,grass,sand_loose,sand_dense --speed 0.3,0.6,0.9,1.2 --trials "${TRIALS:-10}" \
    --json "$out/eval.json"
