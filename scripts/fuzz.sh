#!/usr/bin/env bash
# Runs the fuzz targets of tests/fuzz and lab one after the other, libFuzzer functions fuzz_NAME.c whose first lines say what must hold, with
# clang's address, undefined-behaviour and float-cast checks. What they learn is kept in build/fuzz/learned. An input that fails is printed and
# kept in build/fuzz. Without a limit a run takes 2 to 25 minutes on one core, an hour for model and packet.
# Usage: scripts/fuzz.sh [TARGET ...]; RUNS executions each (default 10 million), at most MINUTES each (default no limit).
#
# The kept inputs, tests/fuzz/corpus.tar.xz, are the smallest that reach everything; found_* once failed. CMake unpacks them, and `make test`
# runs each target with replay.c on its own, without clang. With `merge` as the first word this makes the corpus small again and leaves found_*;
# a new file gets in by `scripts/pack.py tests/fuzz/corpus.tar.xz/NAME found_WHAT`.
set -eu
cd "$(dirname "$0")/.."
runs=${RUNS:-10000000} minutes=${MINUTES:-0} build=build/fuzz
merge=0
if [ "${1:-}" = merge ]; then
    merge=1
    shift
fi
command -v clang >/dev/null || { echo "fuzz: clang is needed: apt-get install clang" >&2; exit 2; }
all=$(grep -oh '^ *mild_fuzz([a-z]*' tests/CMakeLists.txt lab/*/build.cmake | sed 's/.*(//')
targets=${*:-$all}
# it unpacks the corpus, too
cmake -S . -B $build -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER=clang -DMILD_LAB=ON -DMILD_SANITIZE=ON -DMILD_FUZZ=ON --log-level=WARNING
cmake --build $build --parallel "${JOBS:-$(nproc)}" --target $(printf 'fuzz_%s ' $targets) >/dev/null
# without stack traces for allocations, which cost a third of the speed
export ASAN_OPTIONS=malloc_context_size=0:quarantine_size_mb=4:max_malloc_fill_size=0

# Longest input worth trying. The header of a policy alone has 2 kB.
length() {
    case $1 in
    policy | checkpoint) echo 3500 ;;
    actuator) echo 20000 ;;
    config | fit | record | png) echo 512 ;;
    *) echo 256 ;;
    esac
}

fuzz() {
    local target=$1 kept=$build/tests/corpus/$1 dictionary=$build/$1.dict options=()
    if [ "$target" = config ]; then
        grep -oE '^[a-z_0-9]+ =|^\[[a-z]+\]' configs/default.ini | sort -u | sed 's/.*/"&"/' >"$dictionary"
    else
        awk -v of="$target" '/^# / { on = 0; for (i = 2; i <= NF; i++) { on = on || $i == of }; next } on' tests/fuzz/words.dict >"$dictionary"
    fi
    [ ! -s "$dictionary" ] || options+=("-dict=$dictionary")
    mkdir -p $build/learned/"$target"
    $build/tests/fuzz_"$target" -runs="$runs" -max_total_time=$((60 * minutes)) -max_len="$(length "$target")" -timeout=60 \
        -rss_limit_mb=4000 -artifact_prefix=$build/"$target"- -print_final_stats=1 "${options[@]}" $build/learned/"$target" \
        "$kept" >$build/"$target".log 2>&1 || {
        grep -E 'SUMMARY|Test unit written' $build/"$target".log >&2
        return 1
    }
    echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' $build/"$target".log) executions, no finding"
}

# Files named found_* are past findings and are kept.
minimise() {
    local target=$1 kept=$build/tests/corpus/$1 fresh=$build/merge/$1
    rm -rf "$fresh"
    mkdir -p "$fresh" "$kept"
    $build/tests/fuzz_"$target" -set_cover_merge=1 -use_counters=0 "$fresh" $build/learned/"$target" "$kept" >$build/"$target".log 2>&1
    find "$kept" -type f ! -name '*_*' ! -name '*.*' ! -name whole -delete
    cp "$fresh"/* "$kept"/
    echo "$target: $(find "$kept" -type f | wc -l) inputs, $(du -sb "$kept" | cut -f1) bytes"
}

failed=0
for target in $targets; do
    if [ $merge = 1 ]; then minimise "$target"; else fuzz "$target" || failed=1; fi
done
[ $merge = 0 ] || scripts/pack.py --new tests/fuzz/corpus.tar.xz $build/tests/corpus
exit $failed
