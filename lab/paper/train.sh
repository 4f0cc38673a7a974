#!/usr/bin/env bash
# Trains one policy per ground model and seed, by configs/models.ini with Muon and 250 million steps, on one GPU, two to three minutes
# each: FOLDER/MODEL-SEED.safetensors. What is there is kept. SEEDS: how many, or FIRST-LAST. ITERATIONS=N for fewer or more.
# mild_slips, mild_merged_slips: those models, on grounds where slip sinks as lab/grains/walk/sand learned it (lab/grains/README.md).
# Usage: lab/paper/train.sh FOLDER [SEEDS [MODEL ...]]
set -euo pipefail
out=${1:?usage: lab/paper/train.sh FOLDER [SEEDS [MODEL ...]]}
seeds=${2:-3}
[[ $seeds == *-* ]] || seeds=1-$seeds
shift $(($# < 2 ? $# : 2))
models=("$@")
[ $# -gt 0 ] || models=(mild con_cone con_spring ecc_spring ecc_quasi ecc_quasi_3d mild_merged rigid)
iterations=${ITERATIONS:-2544}
keys=(--ppo.optimizer=muon --ppo.matmul=bf16 --reward.linear_velocity=10 --train.iterations="$iterations"
    --ppo.anneal="$((iterations * 7 / 10)) $iterations")
mild=${MILD:-build/mild}
config="$(dirname "$0")/../../configs/models.ini"
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT
mkdir -p "$out"
for seed in $(seq "${seeds%-*}" "${seeds#*-}"); do
    for model in "${models[@]}"; do
        policy=$out/$model-$seed.safetensors
        [ -e "$policy" ] && continue
        slip=()
        [[ $model != *_slips ]] || slip=(--randomize.slip_share=0.6 "--randomize.slip_length=0.0015 0.01" "--randomize.grip=0.08 0.3")
        "$mild" train --config "$config" --out "$runs/run" "${keys[@]}" --randomize.model="${model%_slips}" "${slip[@]}" --train.seed="$seed" >"$runs/log" 2>&1 ||
            { cat "$runs/log" >&2; exit 1; }
        tail -1 "$runs/log"
        cp "$runs/run/log.csv" "$out/$model-$seed.csv"
        cp "$runs/run/config.ini" "$out/$model-$seed.ini"
        mv "$runs/run/policy.safetensors" "$policy"
        rm -rf "$runs/run"
    done
done
