#!/usr/bin/env bash
# Trains the shipped policy from nothing on one GPU, 82 minutes on an H100 or H200: stages, each from the one before, and three means of
# trainings that share a stage. (The shipped policy had its first four stages before joint limits were mended, the first ten before
# legs touched, and all before shells stood.) docs/training-log.md says why there are so many. They were Adam's: by Muon configs/walk.ini
# walks as well after one stage of four minutes (docs/results.md).
# Usage: scripts/train_walk.sh FOLDER
set -euo pipefail
if [ $# -ne 1 ]; then
    echo 'train_walk: usage: scripts/train_walk.sh FOLDER' >&2
    exit 2
fi
out=$1
mild=${MILD:-build/mild}
here=$(dirname "$0")
config=$here/../configs/walk.ini
mkdir -p "$out"
adam=(--config "$config" --ppo.optimizer=adam --ppo.matmul=tf32 --ppo.std_max="0.25 0.12" --reward.collision=-1)

# ---- a walk: the clock of fast commands for all, no price on power ----
# as these stages were: no bound on the torque beyond the motors', a corner of a shank in soft ground ends an episode
before=("${adam[@]}" --task.torque_share=0.85 --task.shells_stand=false --task.crossing_limit=0 --randomize.patch_share=0.3
    --randomize.push_linear=0.6)
even=("${before[@]}" --task.gait_slowing=0 --reward.power=0)
# as much speed as the price on torque allows; the decoder rebuilds the next frame
slow=("${even[@]}" --out "$out/slow" --ppo.decoder_target=next --task.vx="-1.3 1.3")
level=(--terrain.kind=flat --randomize.push_linear=0.3 --randomize.push_angular=0.3 --task.wz="-1 1"
    --reward.linear_velocity=5 --reward.yaw_rate=1.5 --reward.reference_motion=2.2 --reward.torque=-1e-10)
# 1: a gait, led by the reference motion
"$mild" train "${slow[@]}" "${level[@]}" --train.iterations=2600 --ppo.anneal="2000 2600" --ppo.std_max="10 0.12" \
    --reward.tracking_sharpness=5
# 2: speeds far from the present one: a wider tracking term
"$mild" train "${slow[@]}" --resume "${level[@]}" --train.iterations=5200 --ppo.anneal="4600 5200" --ppo.std_max="10 0.12"
# 3: less of the reference motion, a price on torque, gentle terrain, more noise
"$mild" train "${slow[@]}" --resume --train.iterations=9900 --ppo.anneal="0 0" --ppo.std_min=0.2 --ppo.std_max="10 0.2" \
    --reward.linear_velocity=7 --reward.yaw_rate=1.5 --reward.torque=-3e-4 --terrain.slope=0.12 --terrain.amplitude=0.03 \
    --randomize.push_linear=0.4 --randomize.push_angular=0.4 --task.wz="-1 1"
# 4: twice the price, the whole terrain, strong pushes
dear=(--reward.linear_velocity=7 --reward.torque=-6e-4)
"$mild" train "${slow[@]}" --resume "${dear[@]}" --train.iterations=14540 --ppo.anneal="13200 14000"

# 5: the decoder rebuilds the ground, so that z knows it; a little faster
"$mild" train "${even[@]}" --out "$out/known" --train.start="$out/slow/policy.safetensors" "${dear[@]}" --task.vx="-1.3 1.45" \
    --train.iterations=4800 --ppo.anneal="3900 4600"

# 6: fast on loose sand, which takes gentle terrain, more noise, half of the price and a still wider tracking term
gentle=(--reward.tracking_sharpness=1.5 --terrain.slope=0.1 --terrain.amplitude=0.02 --randomize.push_linear=0.3
    --randomize.push_angular=0.3 --ppo.std_min=0.2)
fast=("${even[@]}" --out "$out/fast" --reward.linear_velocity=8)
"$mild" train "${fast[@]}" --train.start="$out/known/policy.safetensors" "${gentle[@]}" --task.vx="-1.3 1.6" --train.iterations=2300 \
    --ppo.anneal="0 0" --ppo.std_max="10 0.2"
# 7: back to the whole terrain
"$mild" train "${fast[@]}" --resume --train.iterations=5000 --ppo.anneal="4100 4800"
# the torque of stage 5, the speed of stage 7
"$here/average.py" "$out/known/policy.safetensors" "$out/fast/policy.safetensors" 0.35 "$out/fast.safetensors"

# ---- and what it costs: a clock that slows with the command, a price on power ----
# 8: a high price, for which fast walks are given up on soft ground
cheap=("${before[@]}" --reward.linear_velocity=8)
"$mild" train "${cheap[@]}" --out "$out/cheap" --train.start="$out/fast.safetensors" --reward.power=-0.01 --train.iterations=4200 \
    --ppo.anneal="3500 4200"
# 9: speed again, as in 6 and 7, at a half and at a quarter of the price
for power in 0.005 0.0025; do
    "$mild" train "${cheap[@]}" --out "$out/gentle$power" --train.start="$out/cheap/policy.safetensors" "${gentle[@]}" \
        --task.vx="-1.4 1.6" --reward.power=-$power --train.iterations=2500 --ppo.anneal="9000 9900"
    "$mild" train "${cheap[@]}" --out "$out/power$power" --train.start="$out/gentle$power/policy.safetensors" --reward.power=-$power \
        --train.iterations=2100 --ppo.anneal="1400 2100"
done
"$here/average.py" "$out/power0.0025/policy.safetensors" "$out/power0.005/policy.safetensors" 0.5 "$out/cheap.safetensors"
# 10: once more, with more weight on the speed
"$mild" train "${before[@]}" --out "$out/gentle" --train.start="$out/cheap.safetensors" "${gentle[@]}" --task.vx="-1.4 1.6" \
    --train.iterations=1500 --ppo.anneal="9000 9900"
"$mild" train "${before[@]}" --out "$out/last" --train.start="$out/gentle/policy.safetensors" --train.iterations=1150 \
    --ppo.anneal="600 1150"

# ---- from one ground onto another: hips and knees bound to 87 N m, stripes of materials, strong pushes, no end by a shank ----
free=("${adam[@]}" --task.shells_stand=false --task.crossing_limit=0)
# 11: gentle terrain, then the whole
"$mild" train "${free[@]}" --out "$out/gentle_border" --train.start="$out/last/policy.safetensors" "${gentle[@]}" \
    --randomize.push_linear=0.4 --task.vx="-1.4 1.6" --train.iterations=1600 --ppo.anneal="9000 9900"
"$mild" train "${free[@]}" --out "$out/border" --train.start="$out/gentle_border/policy.safetensors" --train.iterations=1600 \
    --ppo.anneal="900 1600"
# 12: softer ground, higher steps; a third of it
"$mild" train "${free[@]}" --out "$out/deep" --train.start="$out/border/policy.safetensors" --randomize.sinkage_max=0.12 \
    --randomize.bed_depth="0.1 0.4" --terrain.amplitude=0.07 --train.iterations=1900 --ppo.anneal="1200 1900"
"$here/average.py" "$out/border/policy.safetensors" "$out/deep/policy.safetensors" 0.35 "$out/policy.safetensors"
