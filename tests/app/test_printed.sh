#!/usr/bin/env bash
# `mild play` where there is no display: the walk is printed, a picture a second into a file, one in the place of the other on a
# terminal. Another ffmpeg. Usage: test_printed.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"
unset DISPLAY WAYLAND_DISPLAY

"$mild" play --ground rubber --seconds 2 >walk.txt 2>errors.txt || fail "exit $?: $(cat errors.txt)"
grep -q 'no window here.*--video walk.mp4' errors.txt || fail "no word of it: $(cat errors.txt)"
[ "$(wc -l <errors.txt)" = 1 ] || fail "more than a line: $(cat errors.txt)"
[ "$(grep -c ' s  x .* m  .* m/s' walk.txt)" = 3 ] || fail "not a picture for 0, 1 and 2 s"
[ "$(LC_ALL=C grep -cP '^\xe2[\xa0-\xa3]' walk.txt)" = 54 ] || fail "not 18 rows each"
grep -q '^rubber .* yes ' walk.txt || fail "no table"
! grep -q $'\033' walk.txt || fail "a file moves the cursor"

# on a terminal the next picture begins where the one before did
if command -v script >/dev/null; then
    script -qec "$mild play --ground rubber --seconds 1" /dev/null >terminal.txt </dev/null || fail "on a terminal: exit $?"
    pictures=$(grep -c ' s  x .* m  .* m/s' terminal.txt)
    ((pictures > 3)) || fail "$pictures pictures in a second on a terminal"
    [ "$(grep -c $'\033\[19A' terminal.txt)" = $((pictures - 1)) ] || fail "the cursor goes elsewhere"
    script -qec "stty rows 12 cols 40; $mild play --ground rubber --seconds 0.1" /dev/null >terminal.txt </dev/null
    grep -q $'\033\\[11A' terminal.txt || fail "12 rows of a terminal get another picture: $(head -3 terminal.txt)"
    row=$(LC_ALL=C grep -aP '^\xe2' terminal.txt | tail -1 | tr -d '\r\n' | wc -c)
    [ "$row" = $((39 * 3)) ] || fail "40 columns of a terminal get $row bytes"
fi

# a walk that ends in a fall says so
"$mild" play --controller zero --ground rigid --seconds 5 >fall.txt 2>&1 || fail "a fall: exit $?"
grep -q ' m/s it fell' fall.txt || fail "no fall: $(grep ' m/s' fall.txt)"

printf '#!/bin/sh\ncat >/dev/null\necho mine >"$(for file; do :; done; echo "$file")"\n' >coder
chmod +x coder
MILD_FFMPEG=$work/coder "$mild" play --seconds 0.1 --width 64 --height 64 --video film.mp4 >/dev/null 2>video.txt
if ! grep -q 'neither EGL nor OSMesa' video.txt; then
    [ "$(cat film.mp4)" = mine ] || fail "MILD_FFMPEG: $(cat video.txt)"
fi
# robots, of which each stands on the ground of its place
MILD_FFMPEG=$work/coder "$mild" play --envs 25 --ground rubber,sand_loose --terrain.patches=checker --terrain.patch_size=4 --seconds 0.3 --width 64 \
    --height 64 --video square.mp4 >square.txt 2>video.txt
if ! grep -q 'neither EGL nor OSMesa' video.txt; then
    grep -qx '25 of 25 robots upright' square.txt || fail "--envs: $(cat video.txt square.txt)"
    awk '/^others/ { on = 1; next } on && $1 == "rubber" && $2 > 5 && $3 == $2 && $4 < 40 { rubber = $2 }
        on && $1 == "sand_loose" && $2 > 5 && $3 == $2 && $4 > 90 { sand = $2 } END { exit rubber + sand != 24 }' square.txt ||
        fail "--envs: robots are not on the ground where they are drawn: $(cat square.txt)"
fi
bad "--envs --video" "$mild" play --envs 9
bad "--envs --controller learned" "$mild" play --envs 9 --video square.mp4 --controller stand
bad "--envs" "$mild" play --envs 0 --video square.mp4
finish "printed: $(wc -l <walk.txt) lines"
