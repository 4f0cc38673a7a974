#!/usr/bin/env bash
# What makes the latent name the ground: one change at a time, SEEDS each, by configs/models.ini on one GPU (half a minute a run). Measures
# each policy on the processor meanwhile: FOLDER/NAME-SEED.txt. What is there is kept. Usage: lab/paper/latent.sh FOLDER SEEDS [NAME ...]
set -euo pipefail
out=${1:?usage: lab/paper/latent.sh FOLDER SEEDS [NAME ...]}
seeds=${2:?usage: lab/paper/latent.sh FOLDER SEEDS [NAME ...]}
shift 2
# shellcheck source=lab/paper/changes.sh
source "$(dirname "$0")/changes.sh"
change=(
    [none]="--ppo.kl_weight=10"
    [newest]="--ppo.decoder_target=newest"
    [next]=""
    [clean]="--ppo.target_noise=false"
    [ground]="--ppo.decoder_target=ground"
    [both]="--ppo.decoder_target=both --ppo.target_noise=false"
    [sampled]="--ppo.decoder_target=ground --ppo.sample_latent=true"
    [dimensions]="--ppo.decoder_target=ground --policy.modulation_per_dimension=true"
    [window]="--ppo.decoder_target=ground --task.history_stride=16"
    [free]="--ppo.decoder_target=ground --ppo.kl_weight=0.01 --ppo.free_bits=0.25"
)

# measure RUN NAME-SEED: walks with and without z, and what z knows.
measure() {
    local policy=(eval --policy "$1/policy.safetensors" --config "$1/config.ini") grounds=rigid,rubber,foam60,foam45,foam28,foam25,grass,sand_loose,sand_dense
    {
        echo "== whole"
        "$mild" "${policy[@]}" --ground "$grounds" --speed 0.3,0.6,0.8 --trials 6 --threads 4
        echo "== without z"
        "$mild" "${policy[@]}" --ground "$grounds" --speed 0.3,0.6,0.8 --trials 6 --threads 4 --ablate z
        "$mild" "${policy[@]}" --ground "$grounds" --speed 0.6 --trials 9 --seconds 14.2 --threads 4 --latent "$1/latent.csv" >/dev/null
        echo "== nine grounds"
        "$here/latent.py" "$1/latent.csv" | grep windows || true # who falls has none
        grep -v -E '^[0-9]+,(foam25|sand_dense),' "$1/latent.csv" >"$1/seven.csv"
        echo "== seven grounds"
        "$here/latent.py" "$1/seven.csv" | grep windows || true
    } >"$2.part" 2>&1
    mv "$2.part" "$2.txt"
    cp "$1/policy.safetensors" "$2.safetensors"
    rm -rf "$1"
}

train_changes "$out" "$seeds" txt "$@"
