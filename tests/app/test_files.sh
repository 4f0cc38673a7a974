#!/usr/bin/env bash
# What a user may lose: an input that an output would write over, a neighbour's temporary file, a run folder that two trainings
# share, a run whose terminal closes, output to a full disk; and files that never end. Usage: test_files.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"
shipped=$(dirname "$mild")/../policies/mild.safetensors
[ -f "$shipped" ] || shipped=$(dirname "$0")/../../policies/mild.safetensors

# kept FILE COMMAND...: refused in one line that names what is read, and FILE is as before
kept() {
    local file=$1 sum
    shift
    sum=$(cksum <"$file")
    bad "$file" timeout 60 "$@"
    [ "$(cksum <"$file")" = "$sum" ] || fail "$file was written over: $*"
}

"$mild" press --ground sand_loose --csv record.csv >/dev/null || fail "no record"
cp "$shipped" policy.safetensors
printf '[task]\n' >task.ini
ln task.ini hard.ini
ln -s task.ini soft.ini
printf '\x89PNG\r\n\x1a\n' >relief.png
mkdir sub

# no output is an input: by path, by another spelling of it, by a hard or symbolic link
for alias in task.ini ./task.ini sub/../task.ini "$PWD/task.ini" hard.ini soft.ini; do
    kept task.ini "$mild" eval --config task.ini --json "$alias"
done
kept policy.safetensors "$mild" eval --policy policy.safetensors --json policy.safetensors
kept policy.safetensors "$mild" eval --json policy.safetensors --policy sub/../policy.safetensors
kept policy.safetensors "$mild" play --policy policy.safetensors --video policy.safetensors
kept task.ini "$mild" play --config task.ini --pressure task.ini
cp task.ini walk.csv
kept walk.csv "$mild" play --config walk.csv --pressure walk.png # its numbers would go there
kept record.csv "$mild" fit record.csv --plate 0.2,0.1 --json record.csv
kept record.csv "$mild" fit record.csv --plate 0.2,0.1 --figure record.csv
kept relief.png "$mild" press --ground sand_loose --terrain.kind=image --terrain.image=relief.png --figure relief.png
kept relief.png "$mild" eval --ground sand_loose --terrain.kind=image --terrain.image relief.png --json sub/../relief.png
bad "--csv --figure sub/../new.csv" "$mild" press --ground sand_loose --csv new.csv --figure sub/../new.csv
mkdir run
printf '[train]\nenvs = 2 ; mine\n' >run/config.ini
kept run/config.ini "$mild" train --config run/config.ini --out run
rm -r run

# a neighbour's files with the names that temporary files once had
for name in out.json.tmp out.json.part film.csv.part film.csv.tmp; do echo mine >"$name"; done
"$mild" fit record.csv --plate 0.2,0.1 --json out.json >/dev/null || fail "fit --json"
grep -q parameters out.json || fail "out.json"
"$mild" play --ground foam45 --seconds 3 --pressure film.csv >/dev/null || fail "play --pressure film.csv"
for name in out.json.tmp out.json.part film.csv.part film.csv.tmp; do
    [ "$(cat "$name")" = mine ] || fail "$name was written over"
done
[ -z "$(find . -name '*-*.tmp')" ] || fail "temporary files are left: $(find . -name '*-*.tmp')"

# files that never end or never begin: refused at once, in little memory
mkfifo pipe
endless() { yes '1,2,3,' | tr -d '\n' | head -c 200000000; }
endless >line.csv
limit=1500000 # [KiB]
[ -z "${ASAN_OPTIONS:-}" ] || limit=unlimited # the sanitizer's shadow takes terabytes of addresses
for file in /dev/zero pipe line.csv; do
    bad "$file" timeout 20 bash -c "ulimit -v $limit; exec \"\$@\"" - "$mild" fit "$file" --plate 0.2,0.1
done
rm line.csv
for file in /dev/zero pipe sub; do
    bad "$file" timeout 20 "$mild" eval --policy "$file"
    bad "$file" timeout 20 "$mild" eval --config "$file"
    bad "$file" timeout 20 "$mild" train --config "$file" --out run
    bad "$file" timeout 20 "$mild" press --ground grass --terrain.kind=image --terrain.image="$file"
    bad "$file" timeout 20 "$mild" press --ground grass --terrain.patches=image --terrain.labels="$file"
done

# a full disk behind standard output
for command in --help --version "info grounds" "info config" "info build" "press --help" "train --help" "press --ground grass" \
    "fit record.csv --plate 0.2,0.1" "press --ground grass --csv -" "eval --ground rigid --trials 1 --seconds 0.1"; do
    errors=$("$mild" $command 2>&1 >/dev/full)
    code=$?
    [ "$code" = 2 ] || fail "exit $code instead of 2: mild $command >/dev/full"
    [ "$(grep -c 'standard output' <<<"$errors")" = 1 ] || fail "mild $command >/dev/full: $errors"
done

# a run folder has one owner
tiny=(--train.envs=4 --train.minutes=0 --train.threads=1 --ppo.steps=8 "${small_nets[@]}")
wait_for() {
    for ((i = 0; i < 300; i++)); do
        [ -e "$1" ] && return
        sleep 0.1
    done
    fail "no $1"
}
"$mild" train --out shared "${tiny[@]}" --train.checkpoint_every=100000 >/dev/null 2>&1 &
first=$!
wait_for shared/log.csv
bad "shared $first --out" timeout 60 "$mild" train --out shared "${tiny[@]}"

# a terminal that closes: saved, as by Ctrl-C
kill -HUP $first
wait $first || fail "SIGHUP: exit $?"
ls shared/checkpoint_* >/dev/null 2>&1 || fail "SIGHUP lost the run"
[ ! -e shared/lock ] || fail "the lock is left"

# killed: the folder is free again, and what it left behind goes
"$mild" train --out shared "${tiny[@]}" --resume >/dev/null 2>&1 &
killed=$!
wait_for shared/lock
kill -9 $killed
wait $killed 2>/dev/null
# temporary NAME: as the program makes it: process, number, and their FNV-1a hash with the name
temporary() {
    local text=$1.123-0- sum=$((0xcbf29ce484222325)) i c
    for ((i = 0; i < ${#text}; i++)); do
        printf -v c %d "'${text:i:1}"
        sum=$(((sum ^ c) * 1099511628211))
    done
    printf '%s%016x.tmp' "$text" $sum
}
cp shared/config.ini "shared/$(temporary checkpoint_000000009.safetensors)"
cp shared/config.ini "shared/$(temporary policy.safetensors)"
echo mine >shared/notes.tmp
iterations=$(($(ls shared/checkpoint_* | sed -n 's/.*_0*\([0-9]*\)\.safetensors$/\1/p' | sort -n | tail -1) + 1))
expect 0 resumed "$mild" train --out shared "${tiny[@]}" --resume --train.iterations=$iterations
[ "$(find shared -name '*.tmp')" = shared/notes.tmp ] || fail "temporary files: $(find shared -name '*.tmp')"

# under nohup a closed terminal is no reason to stop
(trap '' HUP; exec "$mild" train --out deaf "${tiny[@]}" --train.iterations=40 >/dev/null 2>&1) &
deaf=$!
wait_for deaf/log.csv
kill -HUP $deaf
wait $deaf || fail "nohup: exit $?"
[ -e deaf/checkpoint_000000040.safetensors ] || fail "nohup: SIGHUP ended the run"

finish "files: nothing lost"
