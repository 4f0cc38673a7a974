#!/usr/bin/env bash
# Scripts with bad input: one line, exit 2. Usage: test_scripts.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$(dirname "$0")/../kit.sh" "$1"
python=$root/.venv/bin/python
[ -x "$python" ] || python=python3

row='"trials": 2, "torque_max": 9, "clearance": 0.1, "penetration": 0.2'
printf '{"rows": [{"ground": "snow", "speed": 0.6, "success": 0, "velocity": 0, "cot": 0, "measured": 0, %s}]}' "$row" >fell.json
printf '{"rows": [{"ground": "snow", "speed": 0.6, "success": 2, "velocity": 0.5, "cot": 0.7, "measured": 2, %s}]}' "$row" >went.json
expect 0 '0.60  *fell  *0 of 2  *-  *-  *9 ' "$python" "$root/scripts/compare.py" fell=fell.json went=went.json
expect 0 '0.60  *went  *2 of 2  *0.50  *0.70  *9 ' "$python" "$root/scripts/compare.py" fell=fell.json went=went.json
# lines of functions and files; a table is one line, main may be long
house() { "$python" "$root/scripts/house.py" "$@"; }
{ echo 'void table(void) {'; echo '    int a[] = {'; yes '        1,' | head -70; echo '    };'; yes '    f(a);' | head -59; echo '}'; } >short.c
expect 0 '^$' house short.c
sed 's/^    };/&\n    f(a);/' short.c >long.c
expect 1 'long.c:1: table has 61 lines, 60 are allowed' house long.c
sed 's/table(void)/CONTACT(newton)(int x)/' long.c >macro.c
expect 1 'macro.c:1: newton has 61 lines' house macro.c
sed 's/void table/int main/' long.c >main.c
mkdir tests && cp long.c tests/
expect 0 '^$' house main.c
expect 1 'tests/long.c:1: table has 61 lines, 60 are allowed' house tests/long.c
yes 'int x;' | head -801 >file.c
expect 1 'file.c:801: 801 lines, 800 are allowed' house file.c
# a test that compares the sentence of an error, whatever the call
for call in 'strstr(error.text, "outside")' 'strcmp(error->text, "x")' 'assert_string_equal(f.error.text, "x")' \
    'assert_memory_equal("x", error.text, 1)' 'strncmp(e.text, "x", 1)'; do
    printf 'int x;\nint y = %s;\n' "$call" >tests/sentence.c
    expect 1 "tests/sentence.c:2: ${call%%(*} of an error's text: take assert_error" house tests/sentence.c
    cp tests/sentence.c sentence.c && cp tests/sentence.c tests/kit.h
    expect 0 '^$' house sentence.c tests/kit.h
done
printf 'assert_error(&error, 1, "x");\nassert_names(error.text, "x");\nstrstr(text, "error");\n' >tests/named.c
expect 0 '^$' house tests/named.c
printf 'x[] = {\n    cmocka_unit_test(a)};\n' >tests/list.c
expect 1 'tests/list.c:2: a case is TEST(name) of kit.h' house tests/list.c

# what counts as named in these tests
named "press: --depth: 7 is outside 0 .. 1.5" "--depth 7 1.5 press" || fail "--depth is not named"
for word in depth --dept -7 1 5 pres outside.; do
    ! named "press: --depth: 7 is outside 0 .. 1.5" "$word" || fail "'$word' is named"
done

# a long command in one line, with a log; of a failure the last lines and the exit code
quietly() { "$root/scripts/quietly.sh" "$@"; }
said=$(quietly logs/fine.log "counting" seq 1000 2>&1) || fail "quietly fails"
[ "$said" = "counting (log: logs/fine.log)" ] && [ "$(wc -l <logs/fine.log)" = 1000 ] || fail "quietly says: $said"
said=$(quietly logs/bad.log "breaking" bash -c 'seq 1000; echo "error: no such thing" >&2; exit 3' 2>&1)
[ $? = 3 ] || fail "quietly loses the exit code"
[ "$(wc -l <<<"$said")" = 22 ] && grep -q '^error: no such thing$' <<<"$said" && grep -q 'code 3; the last lines of logs/bad.log' <<<"$said" ||
    fail "quietly hides a failure: $said"
[ "$(VERBOSE=1 quietly logs/none.log "counting" seq 3 | tr '\n' ' ')" = "1 2 3 " ] && [ ! -e logs/none.log ] || fail "VERBOSE"

finish "scripts: bad input"
