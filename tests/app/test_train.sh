#!/usr/bin/env bash
# Training and evaluation as a user runs them, on tiny networks: a resumed run equals one left alone, a full disk loses
# nothing, a run folder cannot be taken twice. Usage: test_train.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

tiny=(--train.envs=16 --train.minutes=0 --train.threads=2 --train.checkpoint_every=1 --ppo.steps=12 "${small_nets[@]}")
last=checkpoint_000000004.safetensors

# left alone, and stopped after two iterations
good "$mild" train --out whole "${tiny[@]}" --train.iterations=4
good "$mild" train --out part "${tiny[@]}" --train.iterations=2
cp -r part full
cp -r part torn

# bit for bit, checkpoint and log, with another number of threads and nothing but the folder's own config
good "$mild" train --out part --resume --train.iterations=4 --train.threads=1
same_numbers whole/$last part/$last
same_numbers whole/policy.safetensors part/policy.safetensors
[ "$(log_numbers whole %s)" = "$(log_numbers part %s)" ] || fail "the logs of the whole and of the resumed run differ"
grep -aq '"mild train [^"]*--train.iterations=2, seed [^"]*; resumed: mild train [^"]*--train.iterations=4[^"]*"' part/policy.safetensors ||
    fail "the note of a resumed policy: $(sed -n 2p part/version.txt)"
[ "$(ls part/checkpoint_* | wc -l)" = 3 ] || fail "not the last three checkpoints are kept"

# a full disk (here: no file above 64 KiB) while saving
policy_before=$(cksum <full/policy.safetensors)
(
    failures=0
    trap '' XFSZ
    ulimit -f 64
    expect 2 "cannot be written" "$mild" train --out full "${tiny[@]}" --train.iterations=4 --resume
    exit $failures
) || fail "full disk"
[ "$(cksum <full/policy.safetensors)" = "$policy_before" ] || fail "a full disk changed the policy"
[ -z "$(find full -name '*.tmp')" ] || fail "a full disk left a temporary file"
good "$mild" train --out full "${tiny[@]}" --train.iterations=4 --resume
# a run that begins with a policy goes on without it
cp full/policy.safetensors begin.safetensors
good "$mild" train --out begun "${tiny[@]}" --train.start=begin.safetensors --train.iterations=1
rm begin.safetensors
good "$mild" train --out begun --resume --train.iterations=2
# a policy that sees as many points elsewhere is no start
good "$mild" train --out sees "${tiny[@]}" --task.scan=3 --task.scan_ahead="0 0.3" --train.iterations=1
bad "train.start scan_ahead" "$mild" train --out other "${tiny[@]}" --train.iterations=1 --task.scan=3 --task.scan_ahead="0.1 0.4" \
    --train.start=sees/policy.safetensors
good "$mild" eval --policy full/checkpoint_000000002.safetensors --ground rigid --trials 1 --seconds 0.1
same_numbers whole/$last full/$last

# a torn checkpoint is passed over for the one before it
truncate -s 1000 torn/checkpoint_000000002.safetensors
good "$mild" train --out torn "${tiny[@]}" --train.iterations=4 --resume
same_numbers whole/$last torn/$last

# the config is in the event file too, as TensorBoard's hyperparameters
for word in _hparams_/session_start_info train.checkpoint_every; do
    grep -qa "$word" whole/events.out.tfevents.* || fail "no $word in the event file"
done

# mistakes
bad "3 --out" "$mild" train --out whole
bad "whole/checkpoint_000000004.safetensors train.envs" "$mild" train --out whole --resume --train.envs=8
bad "--resume --out" "$mild" train --out nowhere --resume
[ ! -e nowhere ] || fail "a refused resume left a folder"
printf 'X' | dd of=torn/policy.safetensors bs=1 seek=20000 conv=notrunc 2>/dev/null
bad "torn/policy.safetensors" "$mild" eval --policy torn/policy.safetensors
bad "nowhere.safetensors" "$mild" eval --policy nowhere.safetensors
bad "foam54 foam60" "$mild" eval --policy whole/policy.safetensors --ground rigid,foam54
bad "rigidd rigid" "$mild" eval --policy whole/policy.safetensors --ground rubber+rigidd

# the same rows with another number of threads; test_schema.sh has what is in them
good "$mild" eval --policy whole/policy.safetensors --ground rigid,rubber+sand_loose --speed 0,0.6 --trials 2 --seconds 3 \
    --json eval.json
good "$mild" eval --policy whole/policy.safetensors --ground rigid,rubber+sand_loose --speed 0,0.6 --trials 2 --seconds 3 \
    --threads 1 --json again.json
cmp eval.json again.json || fail "another number of threads, other rows"
"$mild" eval --policy whole/policy.safetensors --ground rigid --trials 1 --seconds 0.1 --json - 2>/dev/null | head -c 1 |
    grep -q '{' || fail "--json -: standard output is not the JSON alone"

finish "training and evaluation: all as expected"
