#!/usr/bin/env bash
# Runs a command with its output in a log file. Shows one line instead: the title, the time, and how far the command is. When it
# fails, the last lines of the log follow, and its exit code is kept. VERBOSE=1: the output itself, and no log.
# Usage: scripts/quietly.sh LOG TITLE COMMAND [ARGUMENT ...]
set -uo pipefail
log=$1 title=$2
shift 2
[ -z "${VERBOSE:-}" ] || exec "$@"
mkdir -p "$(dirname "$log")"
terminal=
[ ! -t 1 ] || terminal=1

# The last "[ 42%]" of a build, else the last line.
progress() {
    local done
    done=$(tail -n 50 "$log" | grep -o '^\[ *[0-9]*%\]' | tail -n 1)
    [ -n "$done" ] || done=$(tail -n 1 "$log" | tr -cd '[:print:]')
    local line="$title, $SECONDS s  $done"
    printf '\r%s\e[K' "${line:0:${COLUMNS:-80}-1}"
}

[ -n "$terminal" ] || echo "$title (log: $log)"
"$@" >"$log" 2>&1 </dev/null &
job=$!
trap 'kill "$job" 2>/dev/null; wait "$job"; exit 130' INT TERM
while kill -0 "$job" 2>/dev/null; do
    [ -z "$terminal" ] || progress
    sleep 0.2
done
wait "$job"
code=$?
[ -z "$terminal" ] || printf '\r\e[K'
if [ "$code" != 0 ]; then
    echo "$title: failed with code $code; the last lines of $log:" >&2
    tail -n 20 "$log" >&2
elif [ -n "$terminal" ] && ((SECONDS > 1)); then
    echo "$title, $SECONDS s (log: $log)"
fi
exit "$code"
