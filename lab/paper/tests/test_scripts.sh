#!/usr/bin/env bash
# Scripts of the paper with bad input: one line, exit 2; the printed training; the shipped weights. Usage: test_scripts.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../../.." && pwd)
source "$root/tests/kit.sh" "$1"
python=$root/.venv/bin/python
[ -x "$python" ] || python=python3

latent() { "$python" "$root/lab/paper/latent.py" "$@"; }
bad "latent.py csv" latent
bad "none.csv" latent none.csv
bad "latent.py ." latent .
echo hello >foreign
bad "time_s modulated0" latent foreign
bad "--latent" latent "$root/policies/mild.safetensors"
printf 'ground,trial,speed_m_s,time_s,modulated0\nrigid,0,0.6,3,x\n' >words
bad "x" latent words
printf 'ground,trial,speed_m_s,time_s,modulated0\nrigid,0,0.6,3\n' >short
bad "--latent" latent short
printf 'ground,trial,speed_m_s,time_s,modulated0\nrigid,0,0.6,3,1\n' >one
bad "3 2" latent one
deviations() { "$python" "$root/lab/paper/deviations.py" "$@"; }
bad "NAME-SEED.json ." deviations .
echo '{' >torn-1.json
bad "torn-1.json" deviations .
# its figures need what lab/paper/requirements.txt names
"$python" -c 'import sklearn' 2>/dev/null && bad "paper.py: unknown experiment nosuch; there are table2 " "$python" -B "$root/lab/paper/paper.py" nosuch
bad "paper.py make lab/paper/requirements.txt" "$python" -S -B "$root/lab/paper/paper.py" latent # -S: without installed packages

# the printed training, very short: what stands in its configuration, and its evaluation; called again it goes on
bad "printed.sh" "$root/lab/paper/printed.sh"
bad "printed.sh" "$root/lab/paper/printed.sh" --train.envs=4
printed() { MILD=$mild TRIALS=1 "$root/lab/paper/printed.sh" printed --train.device=cpu --train.robots=mujoco --train.envs=4 "$@"; }
printed --train.iterations=1 >table 2>log || fail "printed.sh: $(cat log)"
for key in "physics_dt = 0.005" "matmul = tf32" "iterations = 1" "modulation_per_dimension = false"; do
    grep -q "^$key$" printed/config.ini || fail "printed.sh: no '$key' in its configuration"
done
[ "$(grep -c '/1' table)" = 36 ] && [ -s printed/eval.json ] || fail "printed.sh: nine grounds at four speeds are $(cat table)"
printed --train.iterations=2 >table 2>log || fail "printed.sh goes on: $(cat log)"
grep -q "^resumed" table && [ "$(wc -l <printed/log.csv)" = 3 ] || fail "printed.sh begins again: $(cat log)"
# the weights of the paper's experiments, in half precision
for file in "$root"/policies/paper/*.safetensors; do
    kind=learned
    ! short || [[ ${file##*/} = [chr]* ]] || continue
    case ${file##*/} in ht2*) kind=ht2 ;; clock*) kind=clock ;; esac
    expect 0 '1/1' "$mild" eval --policy "$file" --controller $kind --ground rigid --trials 1 --seconds 0.1
done
finish "scripts of the paper: bad input, the printed training"
