#!/usr/bin/env bash
# The table of two evaluations, and long commands in one line. Usage: test_scripts.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$(dirname "$0")/../kit.sh" "$1"
python=$root/.venv/bin/python
[ -x "$python" ] || python=python3

row='"trials": 2, "torque_max": 9, "clearance": 0.1, "penetration": 0.2'
printf '{"rows": [{"ground": "snow", "speed": 0.6, "success": 0, "velocity": 0, "cot": 0, "measured": 0, %s}]}' "$row" >fell.json
printf '{"rows": [{"ground": "snow", "speed": 0.6, "success": 2, "velocity": 0.5, "cot": 0.7, "measured": 2, %s}]}' "$row" >went.json
expect 0 '0.60  *fell  *0 of 2  *-  *-  *9 ' "$python" "$root/scripts/compare.py" fell=fell.json went=went.json
expect 0 '0.60  *went  *2 of 2  *0.50  *0.70  *9 ' "$python" "$root/scripts/compare.py" fell=fell.json went=went.json

# a long command in one line, with a log; of a failure the last lines and the exit code
quietly() { "$root/scripts/quietly.sh" "$@"; }
said=$(quietly logs/fine.log "counting" seq 1000 2>&1) || fail "quietly fails"
[ "$said" = "counting (log: logs/fine.log)" ] && [ "$(wc -l <logs/fine.log)" = 1000 ] || fail "quietly says: $said"
said=$(quietly logs/bad.log "breaking" bash -c 'seq 1000; echo "error: no such thing" >&2; exit 3' 2>&1)
[ $? = 3 ] || fail "quietly loses the exit code"
[ "$(wc -l <<<"$said")" = 22 ] && grep -q '^error: no such thing$' <<<"$said" && grep -q 'code 3; the last lines of logs/bad.log' <<<"$said" ||
    fail "quietly hides a failure: $said"
[ "$(VERBOSE=1 quietly logs/none.log "counting" seq 3 | tr '\n' ' ')" = "1 2 3 " ] && [ ! -e logs/none.log ] || fail "VERBOSE"

finish "scripts: a table, a command with its log"
