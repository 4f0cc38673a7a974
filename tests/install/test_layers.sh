#!/usr/bin/env bash
# Includes go one way between layers, between headers and between files, where NAME.c and NAME.h are one file. In the
# layers base and ground so do calls. The environments' library has no learner. ENVS: it, or empty where it is not built.
# Usage: test_layers.sh SOURCE_FOLDER ENVS LAYER=ARCHIVE...
set -eu
source=$(realpath "$1") envs=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() {
    echo "FAIL: $*" >&2
    exit 1
}

# includes PATTERN FOLDER...: lines "layer/file layer/included" of the files in FOLDER that PATTERN names, without endings. Of layers in a
# room only the ground's wings: elsewhere a struct's header serves the files that its own file calls.
includes() {
    local folder
    for folder in "${@:2}"; do
        (cd "$folder" && grep -HoE --include="$1" -r '^#include "[a-z]+(/(law|terrain|sole|step|models))?/[a-z_0-9]+\.h"' . || true)
    done |
        sed -nE 's|^\./([^:]*)\.[a-z]+:#include "([^"]*)\.h"|\1 \2|p' | grep -v ' mild/' || true
}

# calls LAYER=ARCHIVE...: the same of the functions that an object uses and another object defines.
calls() {
    for layer in "$@"; do
        nm "${layer#*=}" | sed "s|^\([a-z0-9_]*\.c\)\.o:|${layer%%=*}/\1.o:|"
    done | awk '
        /\.o:$/ { sub(/\.c\.o:$/, ""); file = $0 }
        NF == 3 && $2 ~ /[TDBR]/ { owner[$3] = file }
        NF == 2 && $1 == "U" { uses[++n] = $2; user[n] = file }
        END { for (i = 1; i <= n; i++) if (uses[i] in owner) print user[i], owner[uses[i]] }'
}

# one_way WHAT: fails when the lines of standard input have a circle.
one_way() {
    sort -u >"$work/lines"
    tsort "$work/lines" >/dev/null 2>"$work/circle" || {
        echo "$1 need each other: $(sed 's/^tsort: //' "$work/circle" | grep -v loop | tr '\n' ' ')"
        return 1
    }
}

# check FOLDER...: of the sources in it, with the calls in $work/calls
check() {
    includes '*.[chi]*' "$@" | sed -E 's,/[^/ ]*( |$),\1,g' | awk '$1 != $2' | one_way layers || return 1
    includes '*.h' "$@" | one_way headers || return 1
    { includes '*.[ch]' "$@" | awk '$1 != $2'; cat "$work/calls"; } | one_way files || return 1
}

calls "$@" >"$work/calls"
[ "$(grep -c ground/ "$work/calls")" -gt 20 ] || fail "no calls found in $*"
[ "$(includes '*.[ch]' "$source/src" | wc -l)" -gt 200 ] || fail "no includes found in $source/src"
check "$source/src" "$source/lab" || fail "see above"

# The check sees what it is for.
mkdir -p "$work/wrong/base" "$work/wrong/ground" "$work/wrong/robot"
sees() {
    ! check "$work/wrong" >"$work/said" || fail "the check does not see: $1"
    grep -q "^$1 need" "$work/said" || fail "the check says $(cat "$work/said") of: $1"
    rm -f "$work"/wrong/*/*
}
echo '#include "ground/a.h"' >"$work/wrong/base/up.c"
echo '#include "base/up.h"' >"$work/wrong/ground/a.h"
sees layers
echo '#include "robot/b.h"' >"$work/wrong/robot/a.h"
echo '#include "robot/a.h"' >"$work/wrong/robot/b.h"
sees headers
echo '#include "ground/b.h"' >"$work/wrong/ground/a.h"
echo '#include "ground/a.h"' >"$work/wrong/ground/b.c"
sees files
echo 'ground/b ground/a' >>"$work/calls"
echo '#include "ground/b.h"' >"$work/wrong/ground/a.h"
sees files

# No policy and no PPO but their numbers, because a wheel is built without them (cmake/Python.cmake).
if [ -n "$envs" ]; then
    [ "$(nm "$envs" | grep -cE ' [tT] [a-z]')" -gt 100 ] || fail "no functions found in $envs"
    ! nm "$envs" | grep -E ' [tT] (policy|ppo|network)_' | grep -vE '_def_|ppo_set_decoder$' ||
        fail "the environments need the learner for the functions above"
fi
echo "$(includes '*.[ch]' "$source/src" "$source/lab" | sort -u | wc -l) includes, $(sort -u "$work/calls" | wc -l) calls: all one way"
