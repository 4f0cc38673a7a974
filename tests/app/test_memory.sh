#!/usr/bin/env bash
# Memory runs out at the n-th allocation of the whole program, MuJoCo's included: one line that says so, exit 2, no file left,
# no MUJOCO_LOG.TXT. Usage: test_memory.sh PATH_TO_MILD PATH_TO_FAIL_ALLOCATION
source "$(dirname "$0")/../kit.sh" "$1"
shim=$(realpath "$2")

# count COMMAND...: how many allocations it makes.
count() {
    LD_PRELOAD=$shim "$@" 2>&1 >/dev/null </dev/null | sed -n 's/^\([0-9]*\) allocations$/\1/p'
}

# starved N ON COMMAND...: fine or one good line.
starved() {
    local n=$1 on=$2 errors before
    shift 2
    before=$(find .)
    # the outer braces take the shell's own word on a program that aborts
    { errors=$(env ${on:+FAIL_ON=1} FAIL_AT="$n" LD_PRELOAD="$shim" "$@" 2>&1 >/dev/null </dev/null); } 2>/dev/null
    local got=$?
    tried=$((tried + 1))
    if [ "$got" = 0 ]; then
        [ -z "$errors" ] || fail "allocation $n: exit 0 and $errors"
        return
    fi
    refused=$((refused + 1))
    [ "$got" = 2 ] || fail "allocation $n: exit $got: $* -> $errors"
    [ "$(wc -l <<<"$errors")" = 1 ] || fail "allocation $n: not one line: $* -> $errors"
    grep -qi 'memory' <<<"$errors" || fail "allocation $n: '$errors' does not say that memory ran out"
    [ "$(find .)" = "$before" ] || fail "allocation $n: files came or went: $(find . -newer "$0")"
}

tried=0 refused=0
# what the loader and the libraries allocate before main() is theirs
first=$(($(count "$mild" --version) + 1))

press=("$mild" press --ground sand_loose --plate sole --depth 0.002)
total=$(count "${press[@]}")
[ "$total" -gt "$first" ] || fail "no allocations counted"
for share in {0..60}; do
    starved $((first + (total - first) * share / 60)) "" "${press[@]}"
    starved $((first + (total - first) * share / 60)) on "${press[@]}"
done
for n in $(seq $((total - 60)) 2 "$total"); do starved "$n" "" "${press[@]}"; done

"$mild" press --ground sand_loose --csv press.csv >/dev/null || fail "no record"
fit=("$mild" fit press.csv --plate 0.2,0.1)
total=$(count "${fit[@]}")
for n in $(seq "$first" 2 "$total"); do starved "$n" "" "${fit[@]}"; done

# what is written stays as it was; a folder is made whole or not at all
"$mild" export --c made >/dev/null || fail "no export"
if "$mild" export --onnx policy.onnx >/dev/null 2>&1; then # built with it
    onnx=("$mild" export --onnx policy.onnx)
    total=$(count "${onnx[@]}")
    for n in $(seq $((total - 60)) "$total"); do starved "$n" "" "${onnx[@]}"; done
fi
total=$(count "$mild" export --c counted)
for n in $(seq $((total - 40)) 2 "$total"); do
    starved "$n" "" "$mild" export --c new
    [ ! -e new ] || { diff -r made new >/dev/null || fail "allocation $n: a folder that is not whole"; rm -r new; }
done

# a training, whose matrix products are a C++ library's: no abort
tiny=(--train.envs=4 --train.minutes=0 --train.threads=1 --train.iterations=1 --ppo.steps=4)
train=("$mild" train --out trained "${tiny[@]}" "${small_nets[@]}")
total=$(count "${train[@]}")
for share in {1..40}; do # the networks work in the last tenth of its allocations
    for on in '' 1; do
        rm -rf trained
        { errors=$(env ${on:+FAIL_ON=1} FAIL_AT=$((total - total * share / 400)) LD_PRELOAD="$shim" "${train[@]}" 2>&1 >/dev/null </dev/null); } 2>/dev/null
        got=$?
        [ "$got" = 2 ] || fail "training, allocation $((total - total * share / 400)): exit $got: $errors"
        grep -qi memory <<<"$errors" || fail "training: '$errors' does not say that memory ran out"
    done
done
rm -rf trained

finish "memory: $tried allocations failed, $refused of them refused in one line each"
