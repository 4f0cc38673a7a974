#!/usr/bin/env bash
# The effect of each deviation from the paper: configs/models.ini with one choice set back to the paper's, half a minute each on one GPU,
# then measured by walks in MuJoCo: FOLDER/NAME-SEED.json. What is there is kept. lab/paper/deviations.py FOLDER writes the table.
# Usage: lab/paper/deviations.sh FOLDER [SEEDS [NAME ...]]
set -euo pipefail
out=${1:?usage: lab/paper/deviations.sh FOLDER [SEEDS [NAME ...]]}
seeds=${2:-1}
shift $(($# < 2 ? $# : 2))
# shellcheck source=lab/paper/changes.sh
source "$(dirname "$0")/changes.sh"
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

measure() { # RUN NAME-SEED
    "$mild" eval --policy "$1/policy.safetensors" --config "$1/config.ini" --train.device=cpu --train.robots=mujoco \
        --ground rigid,rubber,foam45,sand_loose --speed 0.3,0.6 --trials 10 --threads 4 --json "$2.part" >/dev/null
    mv "$2.part" "$2.json"
    rm -rf "$1"
}

train_changes "$out" "$seeds" json "$@"
