#!/usr/bin/env bash
# Names in files reach the terminal as plain text: no control character of an ini, an MJCF, a CSV, a policy, a run folder or a
# command line is printed. Usage: test_plain.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"
home=$(realpath "$(dirname "$mild")/..")
[ -d "$home/robots" ] || home=$(realpath "$(dirname "$0")/../..")
evil=$'\e[31mred\a\x9b5m\xc2\x9b2J\x7f'

# plain COMMAND...: what it prints, on both streams, has line ends and tabs at most, and is UTF-8
plain() {
    "$@" >said 2>&1 </dev/null
    tr -d '\n\t -~\200-\377' <said | od -c | grep -q . && [ -n "$(tr -d '\n\t -~\200-\377' <said)" ] &&
        fail "control characters: $* -> $(cat -v said)"
    grep -aq $'\xc2\x9b' said && fail "a C1 character: $* -> $(cat -v said)"
    iconv -f utf-8 -t utf-8 said >/dev/null 2>&1 || fail "no UTF-8: $* -> $(cat -v said)"
    grep -aq 'red' said || fail "the name is not shown: $* -> $(cat -v said)"
}

mkdir "$evil"
plain "$mild" "$evil"
plain "$mild" press --ground "$evil"
plain "$mild" press "--$evil"
plain "$mild" eval --policy "$evil"
plain "$mild" train --config "$evil" --out o
plain "$mild" report "$evil"
printf '[%s]\nx = 1\n' "$evil" >a.ini
plain "$mild" train --config a.ini --out o
printf '[train]\n%s = 1\n' "$evil" >a.ini
plain "$mild" train --config a.ini --out o
printf '[train]\nrobot = %s\n' "$evil" >a.ini
plain "$mild" train --config a.ini --out o
printf 'depth_m,force_n\n1,%s\n' "$evil" >a.csv
plain "$mild" fit a.csv --plate 0.2,0.1

robot() { # robot SED_SCRIPT FILE: a robot with a changed file
    rm -rf robot
    cp -r "$home/robots/sa01" robot
    chmod -R u+w robot
    sed -i "$1" "robot/$2"
}
robot "s|^name *=.*|name = $evil|" robot.ini
plain "$mild" press --robot ./robot --ground "$evil"
plain "$mild" eval --robot ./robot --controller stand --speed 0 --ground rigid --trials 1 --seconds 0.1 --config "$evil"
robot "0,/<geom /s|<geom |<red\xc2\x9b |" sa01.xml
plain "$mild" press --robot ./robot --ground grass --plate sole

# a table, printed by a command that succeeds
robot "s|^source *=.*|source = $evil|" robot.ini
mkdir -p home/robots
mv robot home/robots/mine
plain env MILD_HOME="$PWD/home" "$mild" info robots

finish "plain: no control character is printed"
