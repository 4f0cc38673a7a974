#!/usr/bin/env bash
# Every JSON that the program writes fits its schema in docs/schema.
# Usage: test_schema.sh PATH_TO_MILD SOURCE_FOLDER
source=$(realpath "$2")
source "$(dirname "$0")/../kit.sh" "$1"
check=(python3 "$source/tests/app/schema.py")

fit() {
    "${check[@]}" "$source/docs/schema/$1.json" "${@:2}" || fail "$1: ${*:2}"
}

eval=("$mild" eval --trials 1)
short=("${eval[@]}" --seconds 0.3)
"${short[@]}" --ground rigid,rubber+foam45 --speed 0,0.6 --json walk.json >/dev/null || fail "eval"
"${short[@]}" --ground grass --ablate z --turn 0.4 --json ablate.json >/dev/null || fail "eval --ablate"
"${eval[@]}" --ground grass --controller stand --speed 0 --seconds 3 --json stand.json >/dev/null || fail "eval --controller"
"${short[@]}" --ground grass --train.robots=batch --json batch.json >/dev/null || fail "eval in the batch engine"
"${short[@]}" --robot go1 --ground rigid,grass --start back --json back.json >/dev/null || fail "eval --start"
fit eval walk.json ablate.json stand.json batch.json back.json
# what the table shows as "-" is null: of trials of 0.3 s all that needs 1 or 2.5 s, and without a step the swing
for key in target_jump action_jerk tilt_rate yaw_rate joint_speed velocity velocity_low velocity_high velocity_deviation velocity_sideways velocity_turn cot cot_deviation torque_deviation base_oscillation; do
    grep -c "\"$key\":[[:space:]]*null" walk.json | grep -qx 4 || fail "$key of a trial that is too short: $(grep "\"$key\"" walk.json)"
done
grep -q '"clearance":[[:space:]]*null' stand.json || fail "clearance without a swing: $(grep clearance stand.json)"
grep -q '"cot":[[:space:]]*null' stand.json || fail "cost of transport of a robot that stands"

"$mild" press --ground foam45 --plate 0.2,0.1 --depth 0.03 --csv foam.csv >/dev/null || fail "press"
"$mild" press --ground sand_loose --plate 0.1,0.1 --csv sand.csv >/dev/null || fail "press"
"$mild" fit foam.csv --plate 0.2,0.1 --json foam.json >/dev/null || fail "fit"
"$mild" fit sand.csv --plate 0.1,0.1 --hold alpha=1.05 --json sand.json >/dev/null || fail "fit --hold"
"$mild" fit sand.csv --plate 0.1,0.1 --model bekker --json bekker.json >/dev/null || fail "fit --model"
"$mild" press --ground sand_loose --ground.slip_length=0.004 --ground.grip=0.2 --plate 0.1,0.1 --depth 0.02 --drag 0.02 --csv drag.csv >/dev/null
"$mild" fit drag.csv --plate 0.1,0.1 --hold-from sand_loose --json drag.json >/dev/null || fail "fit of a slide"
grep -q '"slides"' drag.json || fail "no slides in the JSON"
fit fit foam.json sand.json bekker.json drag.json

"$mild" eval --ground grass --trials 1 --seconds 6 --actions walk.csv >/dev/null || fail "eval --actions"
"$mild" fit walk.csv --json fit_walk.json >/dev/null || fail "fit of a walk"
fit fit_walk fit_walk.json

# its numbers are those that the table, the stances and the track give, each under its own name
side=("$mild" eval --ground grass --speed 0.5 --sideways 0.1 --seconds 8 --seed 2 --task.action_clip=1.5)
"${side[@]}" --trials 2 --json two.json --stances stances.csv --track track.csv --actions actions.csv >two.txt || fail "eval of two trials"
"${side[@]}" --trials 3 --json three.json >/dev/null || fail "eval of three trials"
"$mild" eval --ground grass --turn 0.3 --trials 1 --seconds 4 --json turn.json >turn.txt || fail "eval --turn"
python3 "$source/tests/app/eval_numbers.py" two.txt two.json stances.csv track.csv actions.csv three.json turn.txt turn.json || fail "numbers of eval --json"

finish "every JSON fits its schema"
