#!/usr/bin/env bash
# The library as another project meets it: installed elsewhere, found by pkg-config and by CMake, linked by the examples,
# whose numbers must make sense. Usage: test_install.sh BUILD_FOLDER SOURCE_FOLDER
set -eu
build=$(realpath "$1")
examples=$(realpath "$2")/examples
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cc=${CC:-cc}
flags=(-std=c17 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Werror)
programs=(dropped_plate hopper jump two_link)

fail() {
    echo "FAIL: $*" >&2
    exit 1
}

# Moved after its installation, so that no path of the installation may be written into what is installed.
cmake --install "$build" --component library --prefix "$work/first" >install.log || fail "install: $(cat install.log)"
mv first prefix
lib=$(dirname "$(find prefix -name libmild.so)")
export PKG_CONFIG_PATH="$work/$lib/pkgconfig"
[ -f "$lib/libmild.a" ] || fail "no static library"

# names FILE: what it exports.
names() {
    nm -g --defined-only $([[ $1 != *.so ]] || echo -D) "$1" | awk 'NF == 3 { print $3 }' | sort -u
}
# Only the interface is visible, and of an archive's members what carries the library's name.
for library in mild mild_batch; do
    for file in "$lib/lib$library.so" "$lib/lib$library.a"; do
        foreign=$(names "$file" | grep -v '^mild_' || true)
        [ -z "$foreign" ] || fail "$file exports $foreign"
        names "$file" | grep -v '^mild_\(batch_\)\?inside_' >"${file##*.}.names"
    done
    cmp so.names a.names || fail "lib$library.so and lib$library.a export different functions"
done
# The ground is a library of its own: no batch in it, nothing but libc and libm behind it.
batch=$(names "$lib/libmild.so" | grep '^mild_batch' || true)
[ -z "$batch" ] || fail "libmild.so exports $batch"
foreign=$(names "$lib/libmild_batch.so" | grep -v '^mild_batch_' || true)
[ -z "$foreign" ] || fail "libmild_batch.so exports $foreign"
foreign=$(readelf -d "$lib/libmild.so" | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p' | grep -vE '^lib[cm]\.so|^ld-linux' || true)
[ -z "$foreign" ] || fail "libmild.so needs $foreign"
# A static link takes what it calls: the files that hold it, and with --gc-sections the functions.
cat >material.c <<'END'
#include <mild/ground.h>
int main(void) {
    MildError error = {0};
    const MildMaterial sand = mild_material_default();
    return mild_material_check(&sand, &error) != MILD_OK;
}
END
cat >sole.c <<'END'
#include <mild/ground.h>
int main(void) {
    static const double outline[] = {-0.1, -0.05, 0.1, -0.05, 0.1, 0.05, -0.1, 0.05};
    const MildSoleDef plate = {.outline = outline, .points = 4, .pitch = 0.02};
    MildError error = {0};
    MildSole *sole = mild_sole_create(&plate, &error);
    const int made = sole != NULL;
    mild_sole_destroy(sole);
    return !made;
}
END
# takes PROGRAM MOST_BYTES FLAGS...: links it, runs it, and bounds its code
takes() {
    "$cc" "${flags[@]}" "$1.c" -Iprefix/include "$lib/libmild.a" -lm "${@:3}" -o "$1" || fail "$1 ${*:3}"
    "./$1" || fail "$1 ${*:3}: exits $?"
    size=$(size "$1" | awk 'NR == 2 { print $1 }')
    echo "a program with a $1 has $size B of code ${*:3}; at most $2"
    [ "$size" -le "$2" ] || fail "a static link takes more than it calls"
}
takes material 40000
takes sole 13000
if grep -q '^CMAKE_BUILD_TYPE:[A-Z]*=Release' "$build/CMakeCache.txt"; then # functions have sections of their own
    takes material 9000 -Wl,--gc-sections
    takes sole 10000 -Wl,--gc-sections
fi

# Every header compiles alone, in C and in C++, and C++ finds the functions.
for header in prefix/include/mild/*.h; do
    printf "#include <mild/%s>\nextern int filled;\n" "$(basename "$header")" >header.c
    "$cc" "${flags[@]}" -Wpedantic -Iprefix/include -fsyntax-only header.c || fail "$header in C"
    if command -v c++ >/dev/null; then
        c++ -Wall -Wextra -Wpedantic -Werror -x c++ -Iprefix/include -fsyntax-only header.c || fail "$header in C++"
    fi
done
if command -v c++ >/dev/null; then
    cat >cpp.cc <<'END'
#include <mild/ground.h>
int main() {
    MildError error = {};
    MildMaterial sand = mild_material_default();
    sand.mu = -1;
    return mild_material_check(&sand, &error) != MILD_ERROR_RANGE || mild_material_field_count < 10;
}
END
    c++ -Iprefix/include cpp.cc -L"$lib" -lmild -Wl,-rpath,"$work/$lib" -o cpp
    ./cpp || fail "called from C++"
fi

# Linked three ways, the programs must print the same.
cmake -S "$examples" -B cmake -DCMAKE_C_COMPILER="$cc" -DCMAKE_C_FLAGS="${flags[*]}" -DCMAKE_PREFIX_PATH="$work/prefix" \
    >cmake.log 2>&1 || fail "find_package: $(cat cmake.log)"
cmake --build cmake >cmake.log 2>&1 || fail "find_package build: $(cat cmake.log)"
for program in "${programs[@]}"; do
    "cmake/$program" >"$program.txt" || fail "$program exits $?"
    if command -v pkg-config >/dev/null; then
        read -ra found < <(pkg-config --cflags --libs mild)
        "$cc" "${flags[@]}" "$examples/$program.c" "${found[@]}" -lm -o shared
        LD_LIBRARY_PATH="$work/$lib" ./shared | cmp - "$program.txt" || fail "$program by pkg-config"
    fi
    "$cc" "${flags[@]}" "$examples/$program.c" -Iprefix/include "$lib/libmild.a" -lm -o static
    ./static | cmp - "$program.txt" || fail "$program with the static library"
    ! grep -qiE 'nan|inf' "$program.txt" || fail "$program: $(cat "$program.txt")"
done

# The batch, beside the ground: by pkg-config, by CMake and statically.
cat >batch.c <<'END'
#include <mild/batch.h>
#include <stdio.h>
int main(void) {
    MildError error = {0};
    static const double outline[] = {-0.1, -0.05, 0.1, -0.05, 0.1, 0.05, -0.1, 0.05};
    const MildSoleDef plate = {.outline = outline, .points = 4, .pitch = 0.02};
    MildSole *sole = mild_sole_create(&plate, &error);
    const MildSole *soles[] = {sole};
    const MildBatchDef def = {
        .robots = 2, .feet = 1, .soles = soles, .dt = 0.002, .device = MILD_BATCH_HOST};
    MildBatch *batch = sole ? mild_batch_create(&def, &error) : NULL;
    if (!batch) {
        fprintf(stderr, "%s\n", error.text);
        return 1;
    }
    printf("%zu B a robot\n", mild_batch_robot_bytes(batch));
    void *older = NULL;                /* as programs for 0.2.0 have it */
    struct CUstream_st *theirs = NULL; /* CUDA's cudaStream_t */
    if (mild_batch_reset(batch, NULL, older, &error) || mild_batch_reset(batch, NULL, theirs, &error)) {
        return 1;
    }
    mild_batch_destroy(batch);
    mild_sole_destroy(sole);
    return 0;
}
END
mkdir batch
cat >batch/CMakeLists.txt <<'END'
cmake_minimum_required(VERSION 3.20)
project(batch LANGUAGES C)
find_package(mild 0.3 REQUIRED)
add_executable(batch ../batch.c)
target_link_libraries(batch PRIVATE mild::batch)
END
{ cmake -S batch -B batch/build -DCMAKE_C_COMPILER="$cc" -DCMAKE_PREFIX_PATH="$work/prefix" &&
    cmake --build batch/build; } >cmake.log 2>&1 || fail "mild::batch: $(cat cmake.log)"
batch/build/batch >batch.txt || fail "mild::batch exits $?"
if command -v pkg-config >/dev/null; then
    read -ra found < <(pkg-config --cflags --libs mild-batch)
    "$cc" "${flags[@]}" batch.c "${found[@]}" -lm -o shared || fail "pkg-config mild-batch"
    LD_LIBRARY_PATH="$work/$lib" ./shared | cmp - batch.txt || fail "pkg-config mild-batch"
fi
if ! grep -q cudart "$lib"/cmake/mild/*.cmake; then # CUDA's runtime has more to link
    "$cc" "${flags[@]}" batch.c -Iprefix/include "$lib/libmild_batch.a" "$lib/libmild.a" -lm -o static
    ./static | cmp - batch.txt || fail "the static batch"
fi

# check PROGRAM WHAT AWK: the awk program exits 0 when the table is plausible.
check() {
    awk "function near(x, y, share) { return x > y * (1 - share) && x < y * (1 + share) } $3" "$1.txt" ||
        fail "$1: $2: $(cat "$1.txt")"
}
check dropped_plate "rests at the depth of the law, carrying its weight" '
    $1 == 3.000 { force = $4; speed = $3 } /^deepest/ { deepest = $2; rest = $6; law = $11 }
    END { exit !(near(force, 5 * 9.81, 0.002) && speed * speed < 0.01 && near(rest, law, 0.005) && rest > 1 && deepest > rest) }'
check hopper "ten hops, clear of the ground, ever deeper prints" '
    $1 ~ /^[0-9]+$/ { hops++; if ($4 < 0.05 || $5 <= last || $5 > 50 || $6 < 33) bad = 1; last = $5 }
    END { exit !(hops == 10 && !bad) }'
check jump "plans that reach their height, and do so on finer ground, but not plans for hard ground" '
    $1 ~ /^[0-9]+$/ { n++; if ($2 > 10 || !near($3, $1, 0.002) || !near($4, $1, 0.03) || $5 > 0.7 * $1) bad = 1 }
    END { exit !(n == 6 && !bad) }'
check two_link "stands on its weight in the mean, tilts, sinks" '
    NR > 1 && $1 > 1.9 { n++; sum += $4; if ($3 > tilt) tilt = $3; if ($5 <= 0 || $5 > 60) bad = 1 }
    END { exit !(n == 9 && near(sum / n, 12 * 9.81, 0.03) && tilt > 0.05 && tilt < 0.3 && !bad) }'
echo "installed, linked and run: ${programs[*]}"
