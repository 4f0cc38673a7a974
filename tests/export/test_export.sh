#!/usr/bin/env bash
# What `mild export` writes, C and ONNX, does what `mild eval` did; faults in the C are noticed; bad input leaves nothing.
# Usage: test_export.sh PATH_TO_MILD PYTHON ONNX, ONNX: ON when the program was built with it
tests=$(realpath "$(dirname "$0")")
source "$tests/../kit.sh" "$1"
root=$(realpath "$tests/../..")
python=$2
onnx=$3

printf '[task]\nphysics_dt = 0.005\nobserve_noise = false\n[randomize]\nlatency = 0 0\n' >exact.ini
"$mild" eval --config exact.ini --ground sand_loose --trials 2 --seconds 2 --stop 1.2 --sideways 0.1 --seed 3 \
    --actions exact.csv >/dev/null || fail "eval without noise"
"$mild" eval --ground foam45 --trials 2 --seconds 1 --actions noisy.csv --latent latent.csv >/dev/null || fail "eval with noise"

# another policy: other widths, one theta for each dimension of z, which sees the clock in the place of the actor, another task; every
# tensor random, so that nothing else is 0 or 1
"$python" "$tests/make_policy.py" "$root/policies/mild.safetensors" other.safetensors || fail "make_policy.py"
other=(--task.history_stride=3 --task.gait_period=0.7 --task.action_clip=0.6 --task.action_scale=0.3 --task.standing_below=0.5 --task.gait_slowing=0.4
    --task.gait_slow_below=0.9)
"$mild" eval --policy other.safetensors "${other[@]}" --config exact.ini --ground foam45 --trials 2 --seconds 1 --stop 0.2 \
    --actions other.csv >/dev/null || fail "eval of another policy"

# near OUTPUT NAME: the error that the example prints for NAME is below 1e-5
near() {
    local error
    error=$(sed -n "s/.*$2 within \([0-9.e+-]*\|-*nan\).*/\1/p" <<<"$1")
    awk -v e="$error" 'BEGIN { exit !(e ~ /^[0-9]/ && e < 1e-5) }'
}

# ---- C ----
"$mild" export --c walk || fail "export --c"
"$mild" export --policy other.safetensors "${other[@]}" --c other || fail "export --c of another policy"
"$python" "$tests/metadata.py" "$root" walk || fail "joints of the C"
if ! short; then # no code of ours runs here: the C that was written, by a compiler of its own
    flags=(-O3 -march=native -Wall -Wextra -Wconversion -pedantic -Werror)
    (cd walk && "${CC:-cc}" -std=c99 "${flags[@]}" policy.c example.c -lm -o run) || fail "C99"
    (cd other && "${CC:-cc}" -std=c17 "${flags[@]}" policy.c example.c -lm -o run) || fail "C17"
    (cd other && "${CXX:-c++}" -x c++ "${flags[@]}" policy.c example.c -lm -o run_cpp) || fail "C++"
    exact=$(walk/run exact.csv) && echo "$exact"
    near "$exact" actions && near "$exact" frames || fail "C on a record without noise: $exact"
    noisy=$(walk/run noisy.csv)
    near "$noisy" actions || fail "C on a record with noise: $noisy"
    for program in run run_cpp; do
        output=$("other/$program" other.csv)
        near "$output" actions && near "$output" frames || fail "C of another policy, $program: $output"
    done
    [ "$(nm walk/run | grep -c -w -e malloc -e calloc -e realloc)" = 0 ] || fail "the C allocates"

    "${CC:-cc}" -O1 -shared -fPIC -Iwalk walk/policy.c "$tests/estimates.c" -lm -o estimates.so || fail "a library of the C"
    "$python" "$tests/estimates.py" noisy.csv latent.csv 0.5 estimates.so || fail "estimates of the C"

    # fault NAME OLD NEW: the C with NEW for OLD, of the other policy, must be noticed
    fault() {
        local output
        rm -rf broken && cp -r other broken
        "$python" -c 'import sys; path, old, new = sys.argv[1:]; text = open(path).read(); assert text.count(old) == 1, old; \
            open(path, "w").write(text.replace(old, new))' "broken/$4" "$2" "$3" || fail "no such text: $2"
        (cd broken && "${CC:-cc}" -O0 -w policy.c example.c -lm -o run) || fail "does not compile: $1"
        output=$(broken/run other.csv)
        ! near "$output" actions || ! near "$output" frames || fail "not noticed: $1"
    }
    fault "order of the heads" '*mu = heads + POLICY_ESTIMATES' '*mu = heads + POLICY_LATENT' policy.c
    fault "no modulation" 'theta[one] * mu[j] + theta[POLICY_THETA / 2 + one]' 'mu[j]' policy.c
    fault "other estimates" 'heads + POLICY_FEET_VELOCITIES' 'heads' policy.c
    fault "no clock" 'frame + POLICY_OBSERVATION - POLICY_CLOCK_INPUT' 'frame' policy.c
    fault "ReLU" 'expf(x) - 1' '0' policy.c
    fault "no last action" 'last[i] = state->action[i]' 'last[i] = 0' policy.c
    fault "no clip" 'a > clip ? clip : a;' 'a;' policy.c
    fault "other pose" 'readings->angle[i] - policy_pose[i]' 'readings->angle[i]' policy.c
    fault "gait period" 'return POLICY_GAIT_PERIOD' 'return 0.8' policy.c
    fault "slow clock" 'POLICY_GAIT_SLOWING * (slow' '0 * (slow' policy.c
    fault "its speed" 'v / POLICY_GAIT_SLOW_BELOW' 'v / 1.2' policy.c
    fault "the frame's command" '0.5 * fabs(observation[3])' 'fabs(observation[3])' policy.c
    fault "stride" '#define POLICY_STRIDE 3' '#define POLICY_STRIDE 2' policy.h
    fault "standing" 'fabsf(command[1]) < below' 'fabsf(command[1]) < 0' policy.c
fi

bad "walk folder" "$mild" export --c walk
bad "--onnx --c" "$mild" export
bad "--double" "$mild" export --c new --double
bad "no_such.safetensors" "$mild" export --policy no_such.safetensors --c new
bad "g1_jump.safetensors task.jump" "$mild" export --robot g1 --policy "$root/policies/g1_jump.safetensors" --c new
bad "g1_steps.safetensors task.scan" "$mild" export --robot g1 --policy "$root/policies/g1_steps.safetensors" --c new
bad "sa01 go1 --robot --policy" "$mild" export --robot go1 --policy "$root/policies/mild.safetensors" --c new
bad "task.gait_perod task.gait_period --task.gait_perod=0.7" "$mild" export --c new --task.gait_perod=0.7
bad "train task --train.envs=7" "$mild" export --c new --train.envs=7
bad "--task.gait_period=9 task.gait_period" "$mild" export --c new --task.gait_period=9
bad "exact.csv" "$mild" export --c exact.csv
bad "exact.csv/new" "$mild" export --c exact.csv/new
bad "--onnx other.safetensors" "$mild" export --policy other.safetensors --onnx other.safetensors

# ---- ONNX ----
if [ "$onnx" != ON ]; then
    bad "built without ONNX" "$mild" export --onnx walk.onnx
    finish "the C that is written does what eval did; no ONNX here"
fi
"$mild" export --onnx walk.onnx || fail "export --onnx"
"$mild" export --policy other.safetensors "${other[@]}" --onnx other.onnx || fail "export --onnx of another policy"
"$mild" export --onnx walk_double.onnx --double || fail "export --onnx --double"
"$mild" export --policy other.safetensors "${other[@]}" --onnx other_double.onnx --double || fail "--double of another policy"
if ! short; then # numpy does what is written
    "$python" "$tests/test_onnx.py" walk.onnx exact.csv noisy.csv || fail "walk.onnx"
    "$python" "$tests/test_onnx.py" other.onnx other.csv policy_period=0.01 history_stride=3 gait_period=0.7 action_clip=0.6 \
        action_scale=0.3 standing_below=0.5 clock=1 gait_slowing=0.4 gait_slow_below=0.9 || fail "other.onnx"
    # a robot with driven joints, of which the actions are fewer than the joints
    "$mild" eval --robot g1_29 --ground foam45 --trials 2 --seconds 1 --actions arms.csv >/dev/null || fail "eval of g1_29"
    "$mild" export --robot g1_29 --onnx arms.onnx || fail "export --onnx of g1_29"
    "$python" "$tests/test_onnx.py" arms.onnx arms.csv || fail "arms.onnx"
    "$python" "$tests/estimates.py" noisy.csv latent.csv 0.5 estimates.so walk.onnx || fail "estimates of the ONNX"
    "$python" "$tests/metadata.py" "$root" walk walk.onnx noisy.csv || fail "metadata of walk.onnx"
    "$python" "$tests/test_onnx.py" --double walk_double.onnx exact.csv noisy.csv || fail "walk_double.onnx"
    "$python" "$tests/test_onnx.py" --double other_double.onnx other.csv || fail "other_double.onnx"
    # of the wrong policy: noticed
    ! "$python" "$tests/test_onnx.py" other.onnx noisy.csv >/dev/null 2>&1 || fail "another policy passes for the shipped one"
fi
if [ "${RUNTIME:-}" ]; then # make export-check
    "$python" "$tests/test_onnx.py" --runtime --double walk_double.onnx exact.csv noisy.csv ||
        fail "walk_double.onnx in ONNX Runtime"
    "$python" "$tests/test_onnx.py" --runtime --double other_double.onnx other.csv || fail "other_double.onnx in ONNX Runtime"
    "$python" "$tests/test_onnx.py" --runtime walk.onnx exact.csv noisy.csv || fail "walk.onnx in ONNX Runtime"
    "$python" "$tests/test_onnx.py" --runtime other.onnx other.csv || fail "other.onnx in ONNX Runtime"
fi
bad "--onnx" "$mild" export --onnx -
bad "/dev/full" "$mild" export --onnx /dev/full
bad "--onnx no_such_folder/walk.onnx no_such_folder" "$mild" export --onnx no_such_folder/walk.onnx --c new
finish "what is written does what eval did"
