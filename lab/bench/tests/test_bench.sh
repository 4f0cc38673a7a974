#!/usr/bin/env bash
# mild bench: its words, robots and files. Usage: test_bench.sh PATH_TO_MILD SOURCE_FOLDER
source=$(realpath "$2")
source "$source/tests/kit.sh" "$1"

bad "stepp step" "$mild" bench stepp
bad "recor record" "$mild" bench recor
bad "record first mild bench record OUT" "$mild" bench step record
short || expect 0 'newton_stick' "$mild" bench ground --json bench.json
short || grep -q '"case":.*"newton_stick"' bench.json || fail "bench.json"
# in float, along a walk, forces are those of the step in double
short || expect 0 'force_worst *\(0\.000\|[0-9.]*e-0[4-9]\)' "$mild" bench batch
expect 0 'problems' "$mild" bench batch --robot go1
bad "go2 go1" "$mild" bench step --robot go2
"$mild" actuator log --out motor.csv --seconds 12 >/dev/null && "$mild" actuator fit motor.csv --out motor.safetensors --steps 1 >/dev/null ||
    fail "no network for motors"
bad "task.actuator motor.safetensors" "$mild" bench walk --task.actuator=motor.safetensors
bad "nope/x.png" "$mild" bench step --json nope/x.png

# before a measurement of minutes
touch file
mkdir folder
for target in no/such/folder/out file/out folder ''; do
    bad "--json" timeout 60 "$mild" bench --json "$target"
done

"$mild" bench memory --train.envs=16 --json memory.json >/dev/null || fail "bench memory"
python3 "$source/tests/app/schema.py" "$source/docs/schema/bench.json" memory.json || fail "memory.json does not fit"

# bench record becomes Python, as tests/app/test_package.sh has it of judge
printf '#!/bin/sh\nprintf "<%%s>\\n" "$@" >got.txt\necho "$MILD" >program.txt\nexit 7\n' >python
chmod +x python
MILD=other MILD_PYTHON=$work/python "$mild" bench record 'a b' --list
[ $? = 7 ] || fail "bench record: not the exit code of Python"
[ "$(tail -n 4 got.txt)" = "$(printf '<%s>\n' bench record 'a b' --list)" ] || fail "arguments of bench record: $(cat got.txt)"
[ "$(cat program.txt)" = "$mild" ] || fail "bench record measures $(cat program.txt)"
finish "bench: words, robots, files, record"
