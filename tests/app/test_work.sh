#!/usr/bin/env bash
# Finished work: no command writes over what it was not asked to. Run folders with and without checkpoints, links, pipes and
# other people's files in them; outputs that are read without being named on the command line.
# Usage: test_work.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"
home=$(realpath "$(dirname "$mild")/..")
[ -d "$home/robots" ] || home=$(realpath "$(dirname "$0")/../..")

tiny=(--train.envs=4 --train.minutes=0 --train.threads=1 --train.checkpoint_every=1 --train.iterations=1 --ppo.steps=4 "${small_nets[@]}")

# sums FOLDER...: what the folders hold, links and pipes as such
sums() {
    find "$@" -printf '%p %y %l\n' | sort
    find "$@" -type f -exec cksum {} + | sort
}
# whole FOLDER NAMES COMMAND...: refused in one line that names these, nothing in the folder (or beside it) changed
whole() {
    local folder=$1 names=$2 before
    shift 2
    before=$(sums .)
    bad "$names" timeout 60 "$@"
    [ "$(sums .)" = "$before" ] || fail "$folder is not as before: $* -> $(diff <(echo "$before") <(sums .))"
}

"$mild" train --out first "${tiny[@]}" >/dev/null 2>&1 || fail "no run"

# ---- a new run writes over nothing ----

for name in policy.safetensors log.csv config.ini version.txt; do
    rm -rf o
    mkdir o
    cp "first/$name" o/
    whole o "o/$name --out" "$mild" train --out o "${tiny[@]}"
    ln -sf nowhere o/$name
    whole o "o/$name" "$mild" train --out o "${tiny[@]}"
done
rm -rf o
mkdir o
cp first/policy.safetensors o/
whole o "o/policy.safetensors --out" "$mild" train --out o --train.start=o/policy.safetensors "${tiny[@]}"
whole o "--resume --out" "$mild" train --out o --resume

# ---- links and pipes in a run folder are not followed ----

for name in policy.safetensors log.csv config.ini version.txt; do
    rm -rf o
    cp -r first o
    mv o/$name outside
    ln -s ../outside o/$name
    whole o "o/$name" "$mild" train --out o --resume --train.iterations=2
    whole o "o/$name" "$mild" train --out o --resume --train.iterations=2 --config first/config.ini
    rm outside
done
for number in 1 2; do
    rm -rf o
    cp -r first o
    rm -f o/checkpoint_00000000$number.safetensors
    mkfifo o/checkpoint_00000000$number.safetensors
    whole o "checkpoint_00000000$number.safetensors" "$mild" train --out o --resume --train.iterations=2
done
rm -rf o
cp -r first o
echo "iteration,mine" >o/log.csv
whole o "o/log.csv" "$mild" train --out o --resume --train.iterations=2
rm -rf o
cp -r first o
ln o/log.csv outside
whole o "o/log.csv" "$mild" train --out o --resume --train.iterations=2
rm -rf o outside
cp -rl first o # a copy by hard links: what is replaced by renaming leaves the other whole
rm o/log.csv
cp first/log.csv o/
before=$(sums first)
expect 0 resumed "$mild" train --out o --resume --train.iterations=2
[ "$(sums first)" = "$before" ] || fail "a resumed copy changed the first run"

# ---- only our own files go ----

rm -rf o
mkdir o
for name in policy.safetensors.2026-11.tmp checkpoint_1.2-3.tmp config.ini.1-2-0123456789abcdef.tmp version.txt.tmp; do
    echo mine >o/$name
done
"$mild" train --out o "${tiny[@]}" >/dev/null 2>&1 || fail "no run beside somebody's files"
for name in policy.safetensors.2026-11.tmp checkpoint_1.2-3.tmp config.ini.1-2-0123456789abcdef.tmp version.txt.tmp; do
    [ "$(cat o/$name)" = mine ] || fail "o/$name is gone"
done
rm -rf o
mkdir o
echo mine >o/lock
whole o "o/lock --out" "$mild" train --out o "${tiny[@]}"

# ---- no output is an input that the command line does not name ----

cp -r "$home/robots/sa01" robot
chmod -R u+w robot
xml=$(sed -n 's/^model *= *\([^ ;]*\).*/\1/p' robot/robot.ini)
[ -f "robot/$xml" ] || fail "no MJCF in the robot's folder: '$xml'"
mkdir robot/parts
printf '<mujocoinclude><asset><mesh name="m" file="parts/m.obj"/></asset></mujocoinclude>' >robot/parts/more.xml
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' >robot/parts/m.obj
sed -i '0,/<worldbody>/s||<include file="parts/more.xml"/>\n  <worldbody>|' "robot/$xml"
eval_robot=("$mild" eval --robot ./robot --controller stand --speed 0 --ground rigid --trials 1 --seconds 0.1)
expect 0 rigid "${eval_robot[@]}"
for name in robot.ini "$xml" parts/more.xml parts/m.obj; do
    whole robot "--json robot/$name" "${eval_robot[@]}" --json "robot/$name"
done
ln robot/parts/m.obj alias.csv
whole robot "--track alias.csv" "${eval_robot[@]}" --track alias.csv
rm alias.csv
"$mild" export --c deploy >/dev/null || fail "no export"
whole deploy "deploy folder" "$mild" export --c deploy

# ---- numbers beside a picture, which nobody named ----

echo mine >lab.csv
whole lab.csv "lab.csv" "$mild" press --ground grass --depth 0.002 --figure lab.png
whole lab.csv "lab.csv" "$mild" play --ground grass --seconds 1 --pressure lab.png
whole lab.csv "--video --pressure walk.csv" "$mild" play --ground grass --seconds 1 --video walk.csv --pressure walk.png

# ---- reports ----

report=("$mild" report o)
for name in log.csv config.ini version.txt eval.json a.mp4; do
    rm -rf o
    mkdir o
    cp first/log.csv first/config.ini o/
    rm -f o/$name
    echo secret >secret
    ln -s ../secret o/$name
    whole o "o/$name" "${report[@]}"
done
rm o/a.mp4
echo mine >o/report.html
whole o "o/report.html" "${report[@]}"
rm o/report.html
expect 0 report "${report[@]}"
expect 0 report "${report[@]}"
head -c 5000000 /dev/zero >o/big.mp4
for name in log.csv config.ini big.mp4; do
    whole o "--out o/$name" "${report[@]}" --out o/$name
done

# ---- a pipe where MuJoCo would read ----

for name in "$xml" parts/more.xml parts/m.obj; do
    mv robot/$name kept.file
    mkfifo robot/$name
    whole robot "$(basename $name)" "${eval_robot[@]}"
    rm robot/$name
    mv kept.file robot/$name
done
mkfifo robot/parts/t.png
sed -i 's|<asset>|<asset><texture name="t" type="2d" file="parts/t.png"/>|' robot/parts/more.xml
whole robot "t.png" "${eval_robot[@]}"
whole robot "t.png" "$mild" play --robot ./robot --controller stand --video film.mp4

# ---- very many shapes ----

many() { # many NUMBER ELEMENT: a robot with so many more of them
    rm -rf many
    cp -r "$home/robots/sa01" many
    chmod -R u+w many
    awk -v n="$1" -v e="$2" '{ print } /<worldbody>/ { for (i = 0; i < n; i++) print e }' "$home/robots/sa01/$xml" >many/$xml
}
many 1 '<geom name="corner_0_0" size=".01" contype="0" conaffinity="0"/>'
expect 0 peak "$mild" press --robot ./many --ground grass --plate sole --depth 0.002
many 20000 '<geom size=".01" pos="0 0 9" contype="0" conaffinity="0"/>'
expect 0 peak timeout 100 "$mild" press --robot ./many --ground grass --plate sole --depth 0.002
many 20000 '<site/>'
whole many "./many/sa01.xml" timeout 100 "$mild" press --robot ./many --ground grass --plate sole --depth 0.002

finish "finished work: kept"
