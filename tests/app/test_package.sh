#!/usr/bin/env bash
# Commands of the Python package: `mild judge` becomes the Python that MILD_PYTHON names, with the arguments as they are, and says
# how it is run where there is none. Usage: test_package.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

# a Python that says what it got, one argument a line, and has an exit code of its own
printf '#!/bin/sh\nprintf "<%%s>\\n" "$@" >got.txt\nexit 7\n' >python
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

# files of the working directory are no packages
mkdir mild
touch mild/__init__.py
echo 'open("ran", "w")' | tee mild/__main__.py numpy.py >json.py
bad "python -m mild judge" env MILD_PYTHON=$work/bare ./alone judge
MILD_PYTHON=$work/bare "$mild" judge --help >/dev/null 2>&1 # whatever it finds
[ ! -e ran ] || fail "a file of the working directory was run"
finish "package: judge is started with its arguments, or its line is said"
