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
