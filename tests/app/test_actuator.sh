#!/usr/bin/env bash
# mild actuator, and what uses its file. Usage: test_actuator.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$(dirname "$0")/../kit.sh" "$1"

expect 0 'usage: mild actuator fit' "$mild" actuator --help
bad "--no-such" "$mild" actuator --no-such
bad "fit log" "$mild" actuator
bad "fti" "$mild" actuator fti
for what in fit log; do
    expect 0 "usage: mild actuator $what" "$mild" actuator $what --help
    bad "--no-such" "$mild" actuator $what --no-such
    bad "--out" "$mild" actuator $what
done

# logs
expect 0 '12 s, 0 falls, written: motor.csv' "$mild" actuator log --out motor.csv --seconds 12
expect 0 '6 s, .* falls' "$mild" actuator log --out go1.csv --seconds 6 --robot go1 --controller zero --seed 2
[ "$(wc -l <motor.csv)" = 4801 ] && [ "$(head -1 motor.csv | tr ',' '\n' | wc -l)" = 37 ] || fail "rows or columns of motor.csv"
"$mild" actuator log --out - --seconds 12 2>/dev/null | cmp -s - motor.csv || fail "the same seed, another log"
for option in '' --shake --delay --coulomb --viscous; do # each does something, and something else than the others
    "$mild" actuator log --out - --seconds 1 ${option:+$option 0.015} 2>/dev/null | md5sum
done | sort -u | wc -l | grep -x 5 >/dev/null || fail "an option of log does what another does, or nothing"
bad "--peak" "$mild" actuator log --out x.csv --peak 0
# a policy of another robot walks by its own clock, from which it does not fall
"$mild" actuator log --robot go1 --out go1.csv --seconds 8 | grep -q '8 s, 0 falls' || fail "the Go1 does not walk"
bad "sa01 go1 --robot --policy" "$mild" actuator log --out x.csv --robot go1 --policy "$root/policies/mild.safetensors"
bad "--out none/x.csv" "$mild" actuator log --out none/x.csv

# fits
expect 0 'leg_l5_joint .* kp ' "$mild" actuator fit motor.csv --out motor.safetensors --spacing 0.005 --steps 300 --figure torque.png
[ -s torque.png ] && [ "$(head -1 torque_held.csv)" = "joint,time_s,measured_nm,network_nm,pd_fit_nm,pd_nm" ] ||
    fail "figure or its numbers"
if ! short; then
    expect 0 'leg_l5_joint' "$mild" actuator fit motor.csv --out again.safetensors --spacing 0.005 --steps 300 --threads 1
    cmp -s motor.safetensors again.safetensors || fail "another number of threads, another network"
    expect 0 'leg_l5_joint' "$mild" actuator fit motor.csv --out again.safetensors --spacing 0.005 --steps 300 --seed 2
    ! cmp -s motor.safetensors again.safetensors || fail "--seed does nothing"
fi
expect 0 'FL_hip_joint' "$mild" actuator fit go1.csv --robot go1 --out go1.safetensors --steps 50
# of a motor that is the PD of robot.ini: that PD is found and leaves nothing, a network of few steps leaves a part
if ! short; then
    "$mild" actuator log --out ideal.csv --seconds 12 --delay 0 --coulomb 0 --viscous 0 --peak 1 >/dev/null || fail "the log of an ideal motor"
    "$mild" actuator fit ideal.csv --out ideal.safetensors --spacing 0.005 --steps 300 >ideal.txt || fail "the fit of an ideal motor"
    awk '/^leg_l1_joint/ { kp = 50; kd = 5; rows++ } /^leg_l3_joint/ { kp = 70; kd = 7; rows++ }
        /^leg_l[13]_joint/ && !($4 > 5 && $4 < 30 && $5 < 1e-3 && $6 < 1e-3 && $7 > 0.05 && $7 < $4 / 2 && $9 == kp && $11 == kd) { bad = 1 }
        END { exit bad || rows != 2 }' ideal.txt || fail "the scores of an ideal motor: $(cat ideal.txt)"
fi
bad "--out" "$mild" actuator fit --out x.safetensors
bad "none.csv" "$mild" actuator fit none.csv --out x.safetensors
bad "go1.csv:1 sa01" "$mild" actuator fit go1.csv --out x.safetensors
bad "--spacing" "$mild" actuator fit motor.csv --out x.safetensors --spacing 0.007
head -60 motor.csv >short.csv && head -61 motor.csv | tail -1 | cut -d, -f1-16 >>short.csv
bad "leg_l6_joint.error_rad" "$mild" actuator fit short.csv --out x.safetensors
head -200 motor.csv >short.csv
bad "100" "$mild" actuator fit short.csv --out x.safetensors
bad "--out" "$mild" actuator fit motor.csv --out -
bad "--out motor.csv" "$mild" actuator fit motor.csv --out motor.csv

# the key; on grass, because after so short a fit the robot falls in loose sand (8 of 10 trials), after a whole one it does not (0 of 10)
eval_row() { "$mild" eval --ground grass --trials 1 --seconds 3 "$@" | tail -1; }
[ "$(eval_row)" != "$(eval_row --task.actuator=motor.safetensors)" ] || fail "task.actuator does nothing in eval"
expect 0 'grass .* 1/1 ' eval_row --task.actuator=motor.safetensors
expect 0 'sole pressure' "$mild" play --ground sand_loose --seconds 3 --pressure p.csv --task.actuator=motor.safetensors
train() { # the last override wins
    "$mild" train --train.envs=2 --train.iterations=2 --ppo.steps=4 --ppo.minibatches=2 "$@"
}
expect 0 iteration train --out plain
expect 0 iteration train --out with --task.actuator=motor.safetensors
! cmp -s <(tail -c 4096 plain/policy.safetensors) <(tail -c 4096 with/policy.safetensors) || fail "task.actuator does nothing in train"
grep -q '^actuator = motor.safetensors$' with/config.ini || fail "task.actuator is not in config.ini"
expect 0 iteration "$mild" train --out with --resume --train.iterations=4
expect 0 iteration train --out whole --task.actuator=motor.safetensors --train.iterations=4
same_numbers whole/policy.safetensors with/policy.safetensors
for command in eval "play --pressure p.csv" "train --out x"; do
    bad "task.actuator go1.safetensors go1 sa01" "$mild" $command --task.actuator=go1.safetensors
    bad "task.actuator none.safetensors" "$mild" $command --task.actuator=none.safetensors
    bad "task.actuator" "$mild" $command "--task.actuator=$root/policies/mild.safetensors"
    bad "task.actuator motor.safetensors task.physics_dt 0.002" "$mild" $command --task.actuator=motor.safetensors --task.physics_dt=0.002
    bad "task.actuator motor.safetensors task.kp" "$mild" $command --task.actuator=motor.safetensors --task.kp=60
done
head -c 3000 motor.safetensors >cut.safetensors
bad "task.actuator cut.safetensors" "$mild" eval --task.actuator=cut.safetensors
bad "task.actuator train.robots" "$mild" eval --task.actuator=motor.safetensors --train.robots=batch
bad "task.actuator train.robots" "$mild" train --out x --task.actuator=motor.safetensors --train.robots=batch \
    --randomize.patch_share=0 --train.envs=2
bad "task.actuator" "$mild" eval --controller stand --speed 0 --task.actuator=motor.safetensors
finish "actuator: logs, fits, the key"
