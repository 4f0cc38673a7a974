# What the tests of the program share: an empty folder to work in, failures counted, bad input checked. To be sourced with the
# program's path: source kit.sh PATH_TO_MILD
set -u
mild=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
failures=0

# Whether only the beginning of a repetition is run: MILD_TEST_SHORT, as in kit.h.
short() {
    [ -n "${MILD_TEST_SHORT:-}" ]
}

fail() {
    echo "FAIL: $*" >&2
    failures=$((failures + 1))
}

# finish TEXT: says it when nothing failed, and exits.
finish() {
    [ "$failures" = 0 ] && echo "$1"
    exit $((failures > 0))
}

# expect CODE PATTERN COMMAND...: exit code, and a pattern in what it prints (both streams).
expect() {
    local code=$1 pattern=$2 output
    shift 2
    output=$("$@" 2>&1 </dev/null)
    local got=$?
    [ "$got" = "$code" ] || fail "exit $got instead of $code: $* -> $output"
    grep -q -- "$pattern" <<<"$output" || fail "no '$pattern' in the output of: $* -> $output"
}

# named TEXT NAMES: whether each word of NAMES (a flag, a key, a file, a value) stands in the text as a whole, as in kit.h.
named() {
    local word before='(^|[^A-Za-z0-9_.-])' after='($|[^A-Za-z0-9_.-]|[.-]($|[^A-Za-z0-9_]))'
    for word in $2; do
        [[ $1 =~ $before"$word"$after ]] || return 1
    done
}

# bad NAMES COMMAND...: exit code 2, one line of error (progress apart) that names what is wrong, no file made or lost.
bad() {
    local names=$1 errors before line kept=()
    shift
    before=$(find .)
    errors=$("$@" 2>&1 >/dev/null </dev/null)
    local got=$?
    while IFS= read -r line; do
        [[ $line = 'training '* ]] || kept+=("$line")
    done <<<"$errors"
    [ "$got" = 2 ] || fail "exit $got instead of 2: $* -> $errors"
    [ "${#kept[@]}" = 1 ] || fail "not one line of error: $* -> $errors"
    named "${kept[*]}" "$names" || fail "not all of '$names' in the error of: $* -> $errors"
    [ "$(find .)" = "$before" ] || fail "files came or went: $*"
}

# good COMMAND...: exit code 0; what it prints is in $output.
good() {
    output=$("$@" 2>&1 </dev/null) || fail "exit $?: $* -> $output"
}

# near NAME VALUE TRUTH PERCENT
near() {
    awk -v v="$2" -v t="$3" -v p="$4" -v n="$1" 'BEGIN { e = 100 * (v / t - 1); printf "%-36s %6.2f %%\n", n, e
        exit !(v != "" && e < p && e > -p) }' || fail "$1: '$2' is not within $4 % of $3"
}

# ---- trainings ----

small_nets=(--policy.actor_hidden=32,0,0,0 --policy.critic_hidden=32,0,0,0 --policy.encoder_hidden=32,0,0,0
    --policy.decoder_hidden=32,0,0,0)

# All but the header of a safetensors file, whose note names the command.
numbers() {
    tail -c +$(($(od -An -t u8 -N 8 "$1") + 9)) "$1"
}

same_numbers() {
    cmp <(numbers "$1") <(numbers "$2") || fail "$1 and $2 differ"
}

# log_numbers FOLDER FORMAT: the log without the columns with the time it took.
log_numbers() {
    awk -F, -v format="$2," 'NR == 1 { for (i = 1; i <= NF; i++) timed[i] = $i ~ /^rate\// }
        { for (i = 1; i <= NF; i++) if (!timed[i]) printf format, $i; print "" }' "$1/log.csv"
}
