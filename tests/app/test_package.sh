#!/usr/bin/env bash
# Commands that are other programs. mild-NAME, as git has it. `mild judge` becomes the Python that MILD_PYTHON names, with the arguments
# as they are, and says how it is run where there is none. Usage: test_package.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$root/tests/kit.sh" "$1"

# a Python that says what it got, one argument a line, and has an exit code of its own
printf '#!/bin/sh\nprintf "<%%s>\\n" "$@" >got.txt\necho "$MILD" >program.txt\nexit 7\n' >python
chmod +x python
MILD_PYTHON=$work/python "$mild" judge --out 'a b' '$(touch shell)' "'" '' -- '*'
[ $? = 7 ] || fail "not the exit code of Python"
[ "$(tail -n 7 got.txt)" = "$(printf '<%s>\n' judge --out 'a b' '$(touch shell)' "'" '' -- '*' | tail -n 7)" ] || fail "arguments: $(cat got.txt)"
grep -qx '<judge>' got.txt || fail "no command: $(cat got.txt)"
[ ! -e shell ] || fail "a shell read the arguments"
[ "$(head -n 1 got.txt)" = '<-c>' ] || fail "not by -c: $(cat got.txt)"

# no Python, or none with the package: one line, as for the command that is not started
for none in "$work/none" "$work" /dev/null; do
    bad "python -m mild judge" env "MILD_PYTHON=$none" "$mild" judge --out out
done
bad "python -m mild trial" env MILD_PYTHON=$work/python "$mild" trial robot.xml walk.onnx
cp "$mild" alone # without the package beside it
bad "python -m mild judge" env MILD_PYTHON= PATH=/nowhere MILD_HOME=/nowhere ./alone judge
printf '#!/bin/sh\nexec python3 -S -E "$@"\n' >bare # without installed packages
chmod +x bare
bad "python -m mild judge" env MILD_PYTHON=$work/bare ./alone judge --out out

# mild-NAME, beside the program first, then on PATH; an option and a path are no such names
mkdir bin
printf '#!/bin/sh\nprintf "<%%s>\\n" "$0" "$MILD" "$@" >other.txt\nexit 8\n' | tee mild-other >bin/mild-other
printf '#!/bin/sh\ntouch wrong\n' | tee bin/mild-eval >bin/mild---other
chmod +x mild-other bin/*
PATH=$work/bin:$PATH "$mild" other 'a b' --help ''
[ $? = 8 ] || fail "not the exit code of mild-other"
[ "$(cat other.txt)" = "$(printf '<%s>\n' "$work/bin/mild-other" "$mild" 'a b' --help '')" ] || fail "mild-other: $(cat other.txt)"
PATH=$work/bin:$PATH ./alone other
grep -qx "<$work/mild-other>" other.txt || fail "not the one beside the program: $(cat other.txt)"
PATH=$work/bin:$PATH "$mild" eval --help >/dev/null || fail "a program in the place of a row"
bad "unknown --other" env "PATH=$work/bin:$PATH" "$mild" --other
bad "unknown bin/../other" env "PATH=$work/bin:$PATH" "$mild" bin/../other
bad "unknown othr" "$mild" othr
[ ! -e wrong ] || fail "another program was run"

# files of the working directory are no packages
mkdir mild
touch mild/__init__.py
echo 'open("ran", "w")' | tee mild/__main__.py numpy.py >json.py
bad "python -m mild judge" env MILD_PYTHON=$work/bare ./alone judge
MILD_PYTHON=$work/bare "$mild" judge --help >/dev/null 2>&1 # whatever it finds
[ ! -e ran ] || fail "a file of the working directory was run"

# the package as installed, with no repository around it
mkdir -p installed/mild
touch installed/mild/__init__.py
cp "$root"/python/mild/{__main__,_processor,report,repository}.py installed/mild
mkdir -p installed/mild/data/configs installed/run
cp "$root/configs/default.ini" installed/mild/data/configs
printf 'iteration,a\n1,2\n' >installed/run/log.csv
printf '[train]\nenvs = 7\n' >installed/run/config.ini
cd installed
export PYTHONDONTWRITEBYTECODE=1 MILD_HOME=
bad "mild judge: lab/grains/judge.py MILD_HOME" python3 -m mild judge --out out
bad "mild bench record: lab/bench/record.py MILD_HOME" python3 -m mild bench record out
bad "mild report: none/log.csv" python3 -m mild report none
expect 0 '^report run/report.html$' python3 -m mild report run
grep -q '<td>train.envs<td>7<td>[0-9]' run/report.html || fail "no default of train.envs in the page of the package"
bad "this installation has no program" python3 -m mild bench step # a command of the program

# and with one: the script has the rest of the line
export MILD_HOME=$root
expect 0 '^walk  *mild  *ready$' python3 -m mild bench record --list
bad "record.py: --wrong --help" python3 -m mild bench record out --wrong
bad "record.py: --rounds none" python3 -m mild bench record out --rounds none
finish "package: judge and mild-NAME are started with their arguments, or their line is said"
