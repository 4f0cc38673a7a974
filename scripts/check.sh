#!/usr/bin/env bash
# Runs the stages of `make check` (docs/testing.md). Each stage has its own folder under build/check.
# Usage: scripts/check.sh [STAGE ...]; without a STAGE it runs all of them:
#   format    clang-format 14 has nothing to change, 100 columns, braces
#   sanitize  clang, warnings as errors, address and undefined-behaviour sanitizers: every test of our own code, the long ones begun
#   tidy      clang-tidy 14 over src/, only files that changed since they last passed
#   thread    gcc, thread sanitizer: pool, task, evaluation, training
#   vectors   the layers with loops over vectors, for AVX2 and for AVX-512 with vectors of 512 bits: their tests (256: make test)
#   aarch64   the library for another processor, run under qemu
#   wheel     the Python package with the program: made, looked at, and used where nothing else is
#   site      the documentation as a site: every link; in Chromium, where there is one, every page and a search
#   recipes   what CONTRIBUTING.md says, done in a copy of the tree: a reward, a task, a model, a terrain, a controller, a command
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)} root=$PWD/build/check

sources() {
    if git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
        git ls-files -co --exclude-standard '*.c' '*.h' '*.inc' '*.cu' '*.cpp'
    else # an archive without git
        find include src lab tests examples -name '*.[ch]' -o -name '*.inc' -o -name '*.cu' -o -name '*.cpp'
    fi
}

# configure FOLDER OPTION...: uses ccache if it is installed.
configure() {
    local folder=$root/$1 launcher=()
    shift
    ! command -v ccache >/dev/null || launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache)
    cmake -S . -B "$folder" -DMILD_WERROR=ON --log-level=WARNING "${launcher[@]}" "$@" >/dev/null
}

# build FOLDER [TARGET ...]: quiet unless it fails.
build() {
    local folder=$root/$1
    shift
    cmake --build "$folder" --parallel "$jobs" ${*:+--target "$@"} >"$folder/build.log" 2>&1 ||
        { grep -E -A5 '(error|warning):' "$folder/build.log" | head -60 >&2; return 1; }
}

stage_format() {
    mapfile -t files < <(sources)
    clang-format-14 --dry-run -Werror "${files[@]}"
    scripts/house.py "${files[@]}"
}

# C++ by clang too: its sanitizers take a third of the time of gcc's. In the environment, because cmake forgets all other options of
# a folder made before when one names another compiler. No OpenMP: its threads would wait in loops for processors that other tests have.
configure_sanitize() {
    CXX=clang++-14 configure sanitize -DCMAKE_C_COMPILER=clang-14 -DMILD_SANITIZE=ON -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_FIND_PACKAGE_OpenMP=ON
}

stage_sanitize() {
    configure_sanitize
    build sanitize
    MILD_TEST_SHORT=1 MILD_TEST_DRAWS=0.1 UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=detect_stack_use_after_return=1 \
        ctest --test-dir "$root/sanitize" --output-on-failure --parallel $((jobs + 1)) --timeout 900
}

# Files that are newer than their stamp, or include a header that is, by the compiler's dependency lists.
changed() {
    local file stamp list dependency
    for file in $(sources | grep -E '^(src|lab)/.*\.c$'); do
        stamp=$root/tidy/${file//\//_}
        list=$(find "$root/sanitize" -path "*/${file#*/}.o.d" | head -1)
        [ -n "$list" ] || continue # not part of this build, such as the learner on a GPU
        for dependency in $(sed 's/^[^:]*://; s/\\$//' "$list") .clang-tidy; do
            case $dependency in /usr/*) continue ;; esac
            if ! [ "$stamp" -nt "$dependency" ]; then
                echo "$file"
                break
            fi
        done
    done
}

# analyzer.h would redefine what error.c defines
tidy_file() {
    local first=(--extra-arg=-include --extra-arg="$PWD/scripts/analyzer.h")
    [[ $1 != */error.c ]] || first=()
    clang-tidy-14 -p build/check/sanitize --quiet "${first[@]}" "$1" 2>/dev/null || return 1
    touch "build/check/tidy/${1//\//_}"
}
export -f tidy_file

stage_tidy() {
    configure_sanitize
    build sanitize # the generated header, and what each file reads
    mkdir -p "$root/tidy"
    changed | xargs -r -P "$jobs" -I{} bash -c 'tidy_file {}'
}

# Tests of what starts threads. That gcc has no warnings is seen by `.ci/run`, whose `make test` takes them for errors.
stage_thread() {
    configure thread -DCMAKE_C_COMPILER=gcc -DMILD_SANITIZE=thread -DCMAKE_BUILD_TYPE=Release -DMILD_WERROR=OFF
    build thread mild base_test_pool eval_test_batch eval_test_eval task_test_envs task_test_task task_test_terrain
    # this runtime fails on unusual memory layouts; disable address randomisation if the container allows it
    local fixed=()
    ! setarch -R true 2>/dev/null || fixed=(setarch -R)
    MILD_TEST_SHORT=1 TSAN_OPTIONS=halt_on_error=1 "${fixed[@]}" ctest --test-dir "$root/thread" --output-on-failure \
        --parallel "$jobs" --timeout 900 -R '^(base/test_pool|task/test_(envs|task|terrain)$|eval/test_(batch|eval)|app/train)'
}

# tests_of LAYER...: the targets of their tests.
tests_of() {
    local layer source
    for layer in "$@"; do
        for source in tests/"$layer"/test_*.c; do
            source=${source##*/}
            echo "${layer}_${source%.c}"
        done
    done
}

# vectors PROCESSOR BITS LAYER...: the layers' tests, compiled for that processor with vectors of that many bits. Fewer random
# draws, because it is the compiler that is tested. Skipped where glibc says that the processor here is another.
vectors() {
    local processor=$1 bits=$2 name=vectors-$1-$2
    shift 2
    if ! /lib64/ld-linux-x86-64.so.2 --help 2>/dev/null | grep "$processor (supported" >/dev/null; then
        echo "check: vectors: $processor with $bits bits skipped, this processor cannot run it"
        return
    fi
    configure "$name" -DMILD_MARCH="$processor" -DCMAKE_C_FLAGS="-mprefer-vector-width=$bits" \
        -DCMAKE_BUILD_TYPE=Release -DMILD_VIEW=OFF -DMILD_PYTHON=OFF
    build "$name" $(tests_of "$@")
    MILD_TEST_SHORT=1 MILD_TEST_DRAWS=0.1 ctest --test-dir "$root/$name" --output-on-failure --parallel "$jobs" --timeout 900 \
        -R "^($(IFS='|'; echo "$*"))/test_"
}

# The layers whose loops say `omp simd`. The widest vectors are what `make test` runs on no processor by itself. The lanes of
# batch and engine, which take as long to compile as all the rest, are tried with these alone.
stage_vectors() {
    vectors x86-64-v4 512 ground learn robot batch engine
    vectors x86-64-v3 256 ground learn robot
}

# Replays the fuzzers' corpus, because those programs need only a C library for that processor.
stage_aarch64() {
    local target
    configure aarch64 -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 -DMILD_APP=OFF \
        -DCMAKE_C_COMPILER=aarch64-linux-gnu-gcc -DMILD_MARCH=armv8-a -DCMAKE_BUILD_TYPE=Release
    build aarch64 mild_shared mild_static fuzz_field fuzz_sole fuzz_map fuzz_solve
    for target in field sole map solve; do
        qemu-aarch64 -L /usr/aarch64-linux-gnu "$root/aarch64/tests/fuzz_$target" "$root/aarch64/tests/corpus/$target"
    done
}

stage_wheel() {
    scripts/wheels.sh --plain .venv/bin/python
}

stage_recipes() {
    tests/install/test_contributing.py . --run --jobs "$jobs"
}

stage_site() {
    make --no-print-directory site
    if command -v chromium >/dev/null; then # scripts/setup.sh web
        tests/install/test_site.py .
    fi
}

for stage in ${*:-format sanitize tidy thread vectors aarch64 wheel recipes site}; do
    begin=$SECONDS
    echo "check: $stage"
    "stage_$stage"
    echo "check: $stage passed ($((SECONDS - begin)) s)"
done
