#!/usr/bin/env bash
# Does a modulation act? What theta sees and what the actor sees, one choice at a time, SEEDS each, by configs/models.ini on one GPU (half a
# minute a run). Measures each policy on the processor meanwhile, whole, with theta1 and theta2 at their means, and with z at its mean:
# FOLDER/NAME-SEED.txt. What is there is kept. Usage: lab/paper/modulation.sh FOLDER SEEDS [NAME ...]
set -euo pipefail
out=${1:?usage: lab/paper/modulation.sh FOLDER SEEDS [NAME ...]}
seeds=${2:?usage: lab/paper/modulation.sh FOLDER SEEDS [NAME ...]}
shift 2
# shellcheck source=lab/paper/changes.sh
source "$(dirname "$0")/changes.sh"
target="--ppo.decoder_target=both --ppo.target_noise=false" # changes within a stride
phase="--policy.modulation_input=feet_phase" hidden="--policy.actor_phase=false" each="--policy.modulation_per_dimension=true"
# the actor sees the clock, in the first four; in the others the modulation alone or nobody does
change=(
    [none]="$target --ppo.modulation=false"
    [feet]="$target"
    [phase]="$target $phase"
    [phase_each]="$target $phase $each"
    [hidden_none]="$target $hidden --ppo.modulation=false"
    [hidden_feet]="$target $hidden"
    [hidden_phase]="$target $hidden $phase"
    [hidden_phase_each]="$target $hidden $phase $each"
)

# measure RUN NAME-SEED: walks with and without the modulation and z.
measure() {
    local policy=(eval --policy "$1/policy.safetensors" --config "$1/config.ini") grounds=rigid,rubber,foam60,foam45,foam28,foam25,grass,sand_loose,sand_dense
    local walks=(--ground "$grounds" --speed "0.3,0.6,0.8" --trials 6 --threads 4)
    {
        echo "== whole"
        "$mild" "${policy[@]}" "${walks[@]}"
        echo "== without the modulation"
        "$mild" "${policy[@]}" "${walks[@]}" --ablate modulation
        echo "== without z"
        "$mild" "${policy[@]}" "${walks[@]}" --ablate z
    } >"$2.part" 2>&1
    mv "$2.part" "$2.txt"
    cp "$1/policy.safetensors" "$2.safetensors"
    rm -rf "$1"
}

train_changes "$out" "$seeds" txt "$@"
