#!/usr/bin/env bash
# Training by several processes: the same numbers whatever the split, from checkpoint to checkpoint too; a process that
# fails or dies is one line, and the last checkpoint is whole.
# Usage: test_ranks.sh PATH_TO_MILD PATH_TO_RANKS_PY TEST_FOR_MPIRUN...
source "$(dirname "$0")/../kit.sh" "$1"
ranks_py=$(realpath "$2")
for_mpirun=()
for test in "${@:3}"; do
    for_mpirun+=("$(realpath "$test")")
done
# no network; a short path for its sockets; as many processes as wanted, which leave the processor when they wait; as root too
# products whose last bits depend on the rows beside a row, on any processor
export DNNL_MAX_CPU_ISA=AVX2
export TMPDIR=$work OMPI_MCA_btl=self,vader OMPI_MCA_btl_vader_single_copy_mechanism=none \
    OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 \
    OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

tiny=(--train.envs=20 --train.minutes=0 --train.checkpoint_every=1 --ppo.steps=24 "${small_nets[@]}")
last=checkpoint_000000004.safetensors

# The reward on the last progress line of good's command.
reward() {
    grep -o 'reward [-0-9.]*/s' <<<"$output" | tail -1
}

# the calls of ranks.h, and the learner on GPUs (a stand-in for them) by parts
for n in 2 16; do
    for test in "${for_mpirun[@]}"; do
        good mpirun -n $n "$test"
    done
done

# the split changes nothing: parameters, moments, environments, log; one process may be alone or rank 0 of 1
good "$mild" train --out alone "${tiny[@]}" --train.iterations=4 --train.threads=2
reward_alone=$(reward)
[ -n "$reward_alone" ] || fail "no reward in: $output"
for n in 1 2 8; do
    good mpirun -n $n "$mild" train --out by$n "${tiny[@]}" --train.iterations=4
    [ "$(reward)" = "$reward_alone" ] || fail "$reward_alone alone, $(reward) by $n processes"
    same_numbers alone/$last by$n/$last
    same_numbers alone/policy.safetensors by$n/policy.safetensors
    [ "$(log_numbers alone %.5g)" = "$(log_numbers by$n %.5g)" ] || fail "the logs of 1 and $n processes differ"
    # rank 0 alone writes
    [ "$(ls alone | sed 's/tfevents.*/tfevents/')" = "$(ls by$n | sed 's/tfevents.*/tfevents/')" ] ||
        fail "files of $n processes: $(ls by$n)"
done

# more than eight, with as many shards: the bits of one process with these shards, which are not those of eight
many=("${tiny[@]}" --train.envs=40 --ppo.shards=32 --train.iterations=3)
good "$mild" train --out many "${many[@]}"
good mpirun -n 16 "$mild" train --out many16 "${many[@]}"
same_numbers many/checkpoint_000000003.safetensors many16/checkpoint_000000003.safetensors
[ "$(log_numbers many %.5g)" = "$(log_numbers many16 %.5g)" ] || fail "the logs of 1 and 16 processes differ"
good "$mild" train --out eight "${tiny[@]}" --train.envs=40 --train.iterations=3
cmp -s <(numbers many/policy.safetensors) <(numbers eight/policy.safetensors) && fail "ppo.shards changes nothing"
bad "ppo.shards 8 16" "$ranks_py" -n 16 "$mild" train --out wrong "${tiny[@]}"

# Muon, whose matrices lie between two hidden layers
muon=("${tiny[@]}" --policy.actor_hidden=32,16,0,0 --policy.critic_hidden=16,32,0,0 --ppo.optimizer=muon --train.iterations=2)
good "$mild" train --out muon "${muon[@]}"
good "$ranks_py" -n 4 "$mild" train --out muon4 "${muon[@]}"
same_numbers muon/checkpoint_000000002.safetensors muon4/checkpoint_000000002.safetensors

# on with another number: 2, alone, 4
good "$ranks_py" -n 2 "$mild" train --out on "${tiny[@]}" --train.iterations=1
good "$mild" train --out on --resume --train.iterations=2
good "$ranks_py" -n 4 "$mild" train --out on --resume --train.iterations=4
same_numbers alone/$last on/$last

# the same with the batch engine, whose checkpoint has the learner and the help of each robot
batch=("${tiny[@]}" --train.robots=batch --train.grounds=16)
good "$mild" train --out batch "${batch[@]}" --train.iterations=3
reward_alone=$(reward)
for n in 2 4; do
    good "$ranks_py" -n $n "$mild" train --out batch$n "${batch[@]}" --train.iterations=3
    [ "$(reward)" = "$reward_alone" ] || fail "batch: $reward_alone alone, $(reward) by $n processes"
    same_numbers batch/checkpoint_000000003.safetensors batch$n/checkpoint_000000003.safetensors
    [ "$(log_numbers batch %.5g)" = "$(log_numbers batch$n %.5g)" ] || fail "batch: the logs of 1 and $n processes differ"
done
good "$ranks_py" -n 2 "$mild" train --out batch4 --resume --train.iterations=4
good "$ranks_py" -n 8 "$mild" train --out batch2 --resume --train.iterations=4
same_numbers batch2/$last batch4/$last

# on with MuJoCo from there
rm -r batch2
cp -r batch batch2
good "$mild" train --out batch --resume --train.robots=mujoco --train.iterations=4
good "$ranks_py" -n 2 "$mild" train --out batch2 --resume --train.robots=mujoco --train.iterations=4
same_numbers batch/$last batch2/$last

# mistakes: one line, exit 2, nothing left
bad "--ot --out" "$ranks_py" -n 2 "$mild" train --ot on
bad "train.env train.envs --train.env=4" "$ranks_py" -n 2 "$mild" train --out wrong --train.env=4
bad "3 1 2 4 8" "$ranks_py" -n 3 "$mild" train --out wrong
bad "train.envs 3 4" "$ranks_py" -n 4 "$mild" train --out wrong "${tiny[@]}" --train.envs=3
bad "train.device" "$ranks_py" -n 2 "$mild" train --out wrong "${tiny[@]}" --train.device=cuda
bad "train.device cuda:1 2" "$ranks_py" -n 2 "$mild" train --out wrong "${tiny[@]}" --train.device=cuda:1
bad "/dev/null/wrong" "$ranks_py" -n 2 "$mild" train --out /dev/null/wrong "${tiny[@]}"
bad "3 --out" "$ranks_py" -n 2 "$mild" train --out on
# 20000 robots need 300 MB, and the second process may not have them
large=("$mild" train --out wrong "${tiny[@]}" --train.envs=20000 --train.iterations=1)
bad "2 train.envs ppo.steps" "$ranks_py" -n 1 "${large[@]}" : -n 1 bash -c 'ulimit -v 400000; exec "$@"' - "${large[@]}"
expect 0 'usage: mild train' "$ranks_py" -n 2 "$mild" train --help

# a torn checkpoint is passed over, with one word about it
cp -r by2 torn
truncate -s 1000 torn/$last
[ "$("$ranks_py" -n 2 "$mild" train --out torn --resume 2>&1 >/dev/null | grep -c 'trying the checkpoint before')" = 1 ] ||
    fail "torn checkpoint"
same_numbers alone/$last torn/$last

# endless FOLDER: starts training without an end in the background, waits for its first checkpoint; $launcher is its process
endless() {
    "$ranks_py" -n 2 "$mild" train --out "$1" "${tiny[@]}" --train.iterations=0 >"$1.out" 2>"$1.err" &
    launcher=$!
    for _ in {1..200}; do
        [ -z "$(ls "$1"/checkpoint_* 2>/dev/null)" ] || return
        sleep 0.1
    done
    fail "no checkpoint of $1: $(cat "$1.err")"
}

# ended FOLDER CODE: it ends with that code
ended() {
    wait $launcher
    local got=$?
    [ $got = "$2" ] || fail "$1: exit $got instead of $2: $(cat "$1.err")"
}

# a process that is killed ends the run with one line; the run goes on from the last checkpoint as if nothing had happened
endless killed
mpirun=$(pgrep -P $launcher)
victims=($(pgrep -P "$mpirun" mild))
[ ${#victims[@]} = 2 ] || fail "processes of mpirun: ${victims[*]}"
kill -KILL "${victims[1]}"
ended killed 137
[ "$(grep -vc '^training ' killed.err)" = 1 ] || fail "not one line: $(cat killed.err)"
grep -q 'exited on signal 9' killed.err || fail "killed: $(cat killed.err)"
[ -z "$(find killed -name '*.tmp')" ] || fail "temporary files in killed"
number=$((10#$(ls killed | sed -n 's/checkpoint_\(.*\)\.safetensors/\1/p' | tail -1)))
good "$mild" train --out killed --resume --train.iterations=$((number + 1))
good "$mild" train --out whole "${tiny[@]}" --train.iterations=$((number + 1))
same_numbers whole/checkpoint_$(printf %09d $((number + 1))).safetensors killed/checkpoint_$(printf %09d $((number + 1))).safetensors

# signals save the run and end it
for signal in INT TERM; do
    endless stopped$signal
    kill -$signal $launcher
    ended stopped$signal 0
    rows=$(($(wc -l <stopped$signal/log.csv) - 1))
    [ -s stopped$signal/checkpoint_$(printf %09d $rows).safetensors ] || fail "SIG$signal: the last iteration is not saved"
    [ ! -e stopped$signal/lock ] || fail "SIG$signal: the lock is still there"
done

finish "training by several processes: all as expected"
