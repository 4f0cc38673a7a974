#!/usr/bin/env bash
# A walk of the shipped policy with task.contact_float: another walk by its last digits, the same by its speed, and errors of the key.
# Usage: test_float.sh PATH_TO_MILD SOURCE
source "$(dirname "$0")/../kit.sh" "$1"
policy=$2/policies/mild.safetensors

# walk NAME OPTION...: its speed and how many stayed up, into NAME.
walk() {
    local name=$1
    shift
    "$mild" eval --policy "$policy" --ground sand_loose,foam45 --speed 0.6 --trials 5 "$@" >"$name" || fail "$*"
    "$mild" eval --policy "$policy" --ground sand_loose --speed 0.6 --trials 2 --seconds 4 "$@" --json "$name.json" >/dev/null || fail "$*"
}
walk double
walk float --task.contact_float=true
cmp -s double.json float.json && fail "task.contact_float changes nothing"
rows() {
    tail -n 2 "$1" | awk '{ print $1, $3, $4 }' # ground, upright, m/s
}
paste <(rows double) <(rows float) | awk '{ print; d = $3 - $6; if ($1 != $4 || $2 != $5 || d > 0.01 || d < -0.01) bad = 1 }
    END { exit bad || NR != 2 }' || fail "not the same walk"
for wrong in --task.contact_tolerance=1e-6 --task.solver=gauss_seidel; do
    "$mild" eval --policy "$policy" --trials 1 --task.contact_float=true $wrong 2>error && fail "$wrong is accepted"
    grep -q "task.contact_float: .* give task.solver = newton" error || fail "$wrong: $(cat error)"
done
finish "float: all as expected"
