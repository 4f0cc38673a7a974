#!/usr/bin/env bash
# The policy in numpy against `mild eval --actions`. Usage: test_policy.sh PATH_TO_MILD PYTHON
tests=$(realpath "$(dirname "$0")")
source "$tests/../kit.sh" "$1"
root=$(realpath "$tests/../..")
python=$2

printf '[task]\nphysics_dt = 0.005\nobserve_noise = false\n[randomize]\nlatency = 0 0\n' >exact.ini
"$mild" eval --config exact.ini --ground sand_loose --trials 2 --seconds 2 --stop 1.2 --sideways 0.1 --seed 3 \
    --actions exact.csv >/dev/null || fail "eval without noise"
"$mild" eval --ground foam45 --trials 2 --seconds 1 --actions noisy.csv >/dev/null || fail "eval with noise"
"$python" "$tests/make_policy.py" "$root/policies/mild.safetensors" other.safetensors || fail "make_policy.py"
"$mild" eval --policy other.safetensors --config exact.ini --ground foam45 --trials 2 --seconds 1 --actions other.csv >/dev/null ||
    fail "eval of another policy"
"$python" "$tests/test_policy.py" "$root" "$root/policies/mild.safetensors" exact.csv noisy.csv other.safetensors other.csv || fail "examples/python/policy.py"

# the CSV: every step of both trials, columns that docs/policy.md names; the same beside other outputs; a clip that holds
[ "$(wc -l <noisy.csv)" = 201 ] || fail "$(wc -l <noisy.csv) lines for 200 steps"
[ "$(head -1 noisy.csv | tr ',' '\n' | wc -l)" = 98 ] || fail "columns"
"$mild" eval --ground foam45 --trials 2 --seconds 1 --actions again.csv --latent latent.csv --stances stances.csv --json - \
    --threads 1 >/dev/null 2>&1 || fail "eval with all outputs"
cmp noisy.csv again.csv || fail "actions beside other outputs"
"$mild" eval --ground foam45 --trials 1 --seconds 0.5 --task.action_clip=0.2 --actions clipped.csv >/dev/null || fail "clip"
awk -F, 'NR > 1 { for (i = 87; i <= 98; i++) { a = $i < 0 ? -$i : $i; if (a > 0.2000001) exit 1; n += a > 0.1999999 } }
    END { exit !(n > 10) }' clipped.csv || fail "actions beyond their clip"
"$mild" eval --ground foam45 --trials 2 --seconds 1 --ablate z --actions ablated.csv >/dev/null || fail "eval --ablate"
[ "$(wc -l <ablated.csv)" = 201 ] || fail "rows of the trials for the means"
bad "--actions" "$mild" eval --train.robots=batch --actions x.csv
bad "--latent --actions x.csv" "$mild" eval --actions x.csv --latent x.csv
bad "--actions no_such_folder/x.csv no_such_folder" "$mild" eval --actions no_such_folder/x.csv
finish "the policy in numpy walks as here"
