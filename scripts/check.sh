#!/usr/bin/env bash
# Runs the stages of `make check` and `make nightly` (docs/testing.md). Each has its own folder under build/check.
# Usage: scripts/check.sh [STAGE ...]; without a STAGE it runs those of a landing, the first six:
#   format    clang-format 14 has nothing to change, 100 columns, braces
#   tidy      clang-tidy 14 over src/, without its analyzer
#   sanitize  clang, warnings as errors, address and undefined-behaviour sanitizers: the core in C, and what fuzzing found
#   aarch64   the library for another processor, run under qemu
#   wheel     the Python package with the program: made, looked at, and used where nothing else is
#   site      the documentation as a site: every link; in Chromium, where there is one, every page and a search
# and those of a night:
#   long      the tests that `make test` leaves out: labels lab and nightly
#   analyzer  clang-tidy 14 over src/, with its analyzer
#   sanitize_all  as sanitize, every test, the long ones begun
#   thread    gcc, thread sanitizer: pool, task, evaluation, training
#   vectors   the layers with loops over vectors, for AVX2 and for AVX-512 with vectors of 512 bits: their tests (256: make test)
#   notebooks the notebook of each tutorial, in Jupyter's kernel, from a wheel that is made for it
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
    CXX=clang++-14 configure sanitize -DMILD_LAB=ON -DCMAKE_C_COMPILER=clang-14 -DMILD_SANITIZE=ON -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_FIND_PACKAGE_OpenMP=ON
}

# sanitize [LAYER ...]: the tests of these or of all, but those of `without`.
sanitize() {
    configure_sanitize
    build sanitize "${@/%/_tests}"
    MILD_TEST_SHORT=1 MILD_TEST_DRAWS=0.1 UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=detect_stack_use_after_return=1 \
        ctest --test-dir "$root/sanitize" --output-on-failure --parallel $((jobs + 1)) --timeout 900 \
        -R "^($(IFS='|'; echo "$*"))${1:+/}" -E "^(${without:-none})$"
}

# Of the core in C, without tests that measure for long what others go over too; and what fuzzing found.
stage_sanitize() {
    local without='ground/test_(accuracy|merged|prints|refinement|rim|step|surface_step|thrown)|batch/test_(batch|bodies|contact|points)|env/test_(batch|shells)'
    sanitize base ground soil batch learn control task env fuzz
}

stage_sanitize_all() {
    sanitize
}

# tidy WITHOUT OPTION...: the files of the build with clang but WITHOUT. clang-tidy needs no objects, only sources that are generated.
tidy() {
    local without=$1
    shift
    configure_sanitize
    build sanitize version onnx_messages
    sed -nE "s#^ *\"file\": \"$PWD/((src|lab)/.*\.c)\".*#\1#p" "$root/sanitize/compile_commands.json" | sort -u | grep -v "$without" |
        xargs -P "$jobs" -I{} clang-tidy-14 -p "$root/sanitize" --quiet "$@" {} 2>/dev/null
}

stage_tidy() {
    tidy '^$' --checks='-clang-analyzer-*'
}

# It looks at one file at a time, and so cannot see that mild_fail returns the status it is given, which is never MILD_OK. Not for error.c,
# which defines it.
stage_analyzer() {
    mkdir -p "$root"
    echo '#include "mild/error.h"
#define mild_fail(error, status, ...) (mild_fail(error, status, __VA_ARGS__), (status))' >"$root/analyzer.h"
    tidy /error.c --extra-arg=-include --extra-arg="$(realpath "$root/analyzer.h")"
}

# Tests that `make test` leaves out, of the build that it makes.
stage_long() {
    make --no-print-directory build
    ctest --test-dir build --output-on-failure --parallel $((jobs + 1)) --timeout 900 -L '^(lab|nightly)$'
}

# Tests of what starts threads. That gcc has no warnings is seen by `.ci/run`, whose `make test` takes them for errors.
stage_thread() {
    configure thread -DCMAKE_C_COMPILER=gcc -DMILD_SANITIZE=thread -DCMAKE_BUILD_TYPE=Release -DMILD_WERROR=OFF
    build thread mild base_test_pool eval_test_batch eval_test_eval task_test_envs task_test_task
    # this runtime fails on unusual memory layouts; disable address randomisation if the container allows it
    local fixed=()
    ! setarch -R true 2>/dev/null || fixed=(setarch -R)
    MILD_TEST_SHORT=1 TSAN_OPTIONS=halt_on_error=1 "${fixed[@]}" ctest --test-dir "$root/thread" --output-on-failure \
        --parallel "$jobs" --timeout 900 -R '^(base/test_pool|task/test_(envs|task)$|eval/test_(batch|eval)|app/train)'
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
    build "$name" "${@/%/_tests}"
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

stage_notebooks() {
    make --no-print-directory notebook-check
}

stage_site() {
    make --no-print-directory site
    if command -v chromium >/dev/null; then # scripts/setup.sh web
        tests/install/test_site.py .
    fi
}

for stage in ${*:-format tidy sanitize aarch64 wheel site}; do
    begin=$SECONDS
    echo "check: $stage"
    "stage_$stage"
    echo "check: $stage passed ($((SECONDS - begin)) s)"
done
