#!/usr/bin/env bash
# The environments' library has no policy and no PPO in it but their numbers, because a wheel is built without them
# (cmake/Python.cmake). Usage: test_symbols.sh LIBRARY
set -eu
count=$(nm "$1" | grep -cE ' [tT] [a-z]') || true
[ "$count" -gt 100 ] || { echo "FAIL: $count functions in $1" >&2; exit 1; }
if nm "$1" | grep -E ' [tT] (policy|ppo|network)_' | grep -vE '_def_|ppo_set_decoder$'; then
    echo "FAIL: the environments need the learner for the functions above" >&2
    exit 1
fi
