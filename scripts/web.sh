#!/usr/bin/env bash
# Builds the walk in a browser (docs/web.md) into build/web, which any static host serves. Usage: scripts/web.sh [BUILD]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build}
to=$build/web

command -v emcc >/dev/null || { echo "web: emcc is missing; scripts/setup.sh web installs it" >&2; exit 2; }
cmake --build "$build" --target web_robots
rm -rf "$to"
mkdir -p "$to"

# -ffp-contract=off as everywhere; no malloc of the host's, no file system: the page calls the module alone
exports=web_open,web_start,web_soil,web_text,web_again,web_change,web_step,web_view,web_window,web_hills,web_picture,mild_material_preset_name,mild_material_preset_count,malloc
emcc -O3 -msimd128 -std=c17 -ffp-contract=off -fno-math-errno -fno-trapping-math -fopenmp-simd -D_POSIX_C_SOURCE=200809L \
    -Wno-pass-failed -I. -Isrc -Iinclude --no-entry -sSTANDALONE_WASM=1 -sINITIAL_MEMORY=67108864 -sTOTAL_STACK=1048576 \
    -sEXPORTED_FUNCTIONS="_${exports//,/,_}" \
    web/core.c web/window.c src/identify/belief/belief.c src/control/speed_hold.c src/ground/{law,terrain,sole,step,models}/*.c src/ground/soil/soil.c src/base/error.c src/base/field.c src/base/text.c -o "$to/mild.wasm"
cp "$build"/generated/web/*.bin web/index.html web/style.css web/mild.js web/draw.js "$to"
du -cb "$to"/* | tail -1 | awk '{ printf "web: %s, %.2f MB\n", "'"$to"'", $1 / 1e6 }'
