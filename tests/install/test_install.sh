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
programs=(dropped_plate hopper two_link)

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

# Only the interface is visible.
foreign=$(nm -D --defined-only "$lib/libmild.so" | awk '$3 !~ /^mild_/ { print $3 }')
[ -z "$foreign" ] || fail "libmild.so exports $foreign"
foreign=$(nm -g --defined-only "$lib/libmild.a" | awk 'NF == 3 && $3 !~ /^mild_/ { print $3 }')
[ -z "$foreign" ] || fail "libmild.a exports $foreign"
for library in so a; do
    nm -g --defined-only "$lib/libmild.$library" | awk '$3 ~ /^mild_/ { print $3 }' | sort >"$library.names"
done
cmp so.names a.names || fail "libmild.so and libmild.a export different functions"

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
check two_link "stands on its weight in the mean, tilts, sinks" '
    NR > 1 && $1 > 1.9 { n++; sum += $4; if ($3 > tilt) tilt = $3; if ($5 <= 0 || $5 > 60) bad = 1 }
    END { exit !(n == 9 && near(sum / n, 12 * 9.81, 0.03) && tilt > 0.05 && tilt < 0.3 && !bad) }'
echo "installed, linked and run: ${programs[*]}"
