#!/usr/bin/env bash
# Trainings by configs/models.ini with one change at a time, SEEDS (or FIRST-LAST) each, on one GPU, half a minute a run. Each run is measured
# on the processor while the next one trains: FOLDER/NAME-SEED.RESULT of all changes, or of those named. What is there is kept.
#   deviations  one choice set back to the paper's; RESULT is json, and lab/paper/deviations.py FOLDER writes the table
#   latent      what makes the latent name the ground; txt: walks with and without z, and what z knows
#   modulation  what theta sees and what the actor sees; txt: walks whole, with theta1 and theta2 at their means, and with z at its mean
# Usage: lab/paper/changes.sh deviations|latent|modulation FOLDER [SEEDS [NAME ...]]
set -euo pipefail
usage="usage: lab/paper/changes.sh deviations|latent|modulation FOLDER [SEEDS [NAME ...]]"
what=${1:?$usage}
out=${2:?$usage}
seeds=${3:-1}
shift $(($# < 3 ? $# : 3))
here=$(dirname "$0")
mild=${MILD:-build/mild}
config=$here/../../configs/models.ini
nine=rigid,rubber,foam60,foam45,foam28,foam25,grass,sand_loose,sand_dense
declare -A change

deviations() {
    result=json
    change=(
        [as_it_is]=""
        [tracking_time]="--reward.tracking_time=0.01"
        [tracking_narrow]="--reward.tracking_narrow=0"
        [linear_velocity]="--reward.linear_velocity=1.4 --reward.yaw_rate=1.1"
        [clearance_form]="--reward.clearance_form=error"
        [gait_form]="--reward.gait_form=sum"
        [double_support]="--task.double_support=0"
        [acceleration_form]="--reward.acceleration_form=linear"
        [own_terms]="--reward.reference_motion=0 --reward.knee_distance=0 --reward.orientation=0 --reward.air_time=0 --reward.base_motion=0 --reward.contact_force=0 --reward.joint_speed=0"
        [clip_sum]="--reward.clip_sum=false"
        [assist]="--task.assist=false"
        [clock]="--task.clock=false"
        [history_stride]="--task.history_stride=1"
        [estimate_scales]="--task.velocity_scale=1 --task.height_scale=1"
        [sample_latent]="--ppo.sample_latent=true"
        [action_scale]="--task.action_scale=1"
        [clips]="--task.action_clip=100 --task.torque_share=1"
        [torque_hold]="--task.torque_hold=true"
        [observe_noise]="--task.observe_noise=false"
        [terminations]="--task.tilt_limit=3 --task.crossing_limit=-1"
        [passive]="--randomize.passive=false"
        [recovery]="--randomize.recovery=1,1"
        [sinkage_max]="--randomize.sinkage_max=1"
        [bed_depth]="--randomize.bed_depth=10,10"
        [kinds_of_ground]="--randomize.rigid_share=0 --randomize.preset_share=0"
        [robots]="--randomize.link_mass=1,1 --randomize.armature=1,1 --randomize.gain=1,1 --randomize.strength=1,1"
        [push_interval]="--randomize.push_interval=0"
        [start]="--randomize.initial_joint=0 --randomize.initial_velocity=0"
        [decoder_target]="--ppo.decoder_target=newest"
        [mirror]="--ppo.mirror_weight=0"
        [anneal]="--ppo.anneal=0,0 --ppo.average=0"
    )
}

measure_deviations() { # RUN NAME-SEED
    "$mild" eval --policy "$1/policy.safetensors" --config "$1/config.ini" --train.device=cpu --train.robots=mujoco \
        --ground rigid,rubber,foam45,sand_loose --speed 0.3,0.6 --trials 10 --threads 4 --json "$2.part" >/dev/null
}

latent() {
    result=txt
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
}

measure_latent() { # RUN NAME-SEED
    local policy=(eval --policy "$1/policy.safetensors" --config "$1/config.ini")
    {
        echo "== whole"
        "$mild" "${policy[@]}" --ground "$nine" --speed 0.3,0.6,0.8 --trials 6 --threads 4
        echo "== without z"
        "$mild" "${policy[@]}" --ground "$nine" --speed 0.3,0.6,0.8 --trials 6 --threads 4 --ablate z
        "$mild" "${policy[@]}" --ground "$nine" --speed 0.6 --trials 9 --seconds 14.2 --threads 4 --latent "$1/latent.csv" >/dev/null
        echo "== nine grounds"
        "$here/latent.py" "$1/latent.csv" | grep windows || true # who falls has none
        grep -v -E '^[0-9]+,(foam25|sand_dense),' "$1/latent.csv" >"$1/seven.csv"
        echo "== seven grounds"
        "$here/latent.py" "$1/seven.csv" | grep windows || true
    } >"$2.part" 2>&1
    cp "$1/policy.safetensors" "$2.safetensors"
}

modulation() {
    local target="--ppo.decoder_target=both --ppo.target_noise=false" # changes within a stride
    local phase="--policy.modulation_input=feet_phase" hidden="--policy.actor_phase=false" each="--policy.modulation_per_dimension=true"
    result=txt
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
}

measure_modulation() { # RUN NAME-SEED
    local policy=(eval --policy "$1/policy.safetensors" --config "$1/config.ini")
    local walks=(--ground "$nine" --speed "0.3,0.6,0.8" --trials 6 --threads 4)
    {
        echo "== whole"
        "$mild" "${policy[@]}" "${walks[@]}"
        echo "== without the modulation"
        "$mild" "${policy[@]}" "${walks[@]}" --ablate modulation
        echo "== without z"
        "$mild" "${policy[@]}" "${walks[@]}" --ablate z
    } >"$2.part" 2>&1
    cp "$1/policy.safetensors" "$2.safetensors"
}

[[ $what =~ ^(deviations|latent|modulation)$ ]] || { echo "$usage" >&2; exit 2; }
"$what"
[[ $seeds == *-* ]] || seeds=1-$seeds
names=("$@")
[ $# -gt 0 ] || mapfile -t names < <(printf '%s\n' "${!change[@]}" | sort)
for name in "${names[@]}"; do
    [ -n "${change[$name]+set}" ] || { echo "changes.sh $what: unknown change '$name'; choose from ${!change[*]}" >&2; exit 2; }
done
runs=$(mktemp -d)
trap 'wait; rm -rf "$runs"' EXIT
mkdir -p "$out"

measure() { # RUN NAME-SEED
    "measure_$what" "$@"
    mv "$2.part" "$2.$result"
    rm -rf "$1"
}

for seed in $(seq "${seeds%-*}" "${seeds#*-}"); do
    for name in "${names[@]}"; do
        [ -e "$out/$name-$seed.$result" ] && continue
        run=$runs/$name-$seed
        # shellcheck disable=SC2086 # several options
        "$mild" train --config "$config" --out "$run" --train.seed="$seed" ${change[$name]} >"$runs/log" 2>&1 ||
            { cat "$runs/log" >&2; exit 1; }
        echo "$name-$seed $(tail -1 "$runs/log")"
        cp "$run/log.csv" "$out/$name-$seed.csv"
        cp "$run/config.ini" "$out/$name-$seed.ini"
        measure "$run" "$out/$name-$seed" &
    done
done
