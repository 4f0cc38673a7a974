#!/usr/bin/env bash
# Every number that a user may give, given wrongly: one clear line with its name, exit 2, nothing made. And files that cannot be
# written or read are found out before the work begins. Usage: test_inputs.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

# every key of the config: not a number, too many numbers. All keys are read by one function: a sanitizer sees some of them
keys=0
section=
while read -r key _; do
    case $key in
    \[*) section=${key:1:-1} ;;
    '' | \#*) ;;
    *)
        name=$section.$key
        keys=$((keys + 1))
        ! short || ((keys % 8 == 0)) || continue
        bad "$name" "$mild" train --out run "--$name=nan"
        bad "$name" "$mild" train --out run "--$name=1 2 3 4 5 6 7 8 9 10 11 12 13"
        ;;
    esac
done < <("$mild" info config)
[ "$keys" -gt 80 ] || fail "only $keys keys"
bad "--train.envs=-1 train.envs" "$mild" train --out run --train.envs=-1
bad "--task.physics_dt=inf task.physics_dt" "$mild" train --out run --task.physics_dt=inf
bad "--policy.actor_hidden=32,-1,0,0 policy.actor_hidden" "$mild" train --out run --policy.actor_hidden=32,-1,0,0

# every parameter of a ground
parameters=0
for key in $("$mild" info grounds | awk '$2 == "foam60" { table = 1; next } table && NF == 0 { exit } table { print $1 }'); do
    parameters=$((parameters + 1))
    ! short || ((parameters % 8 == 0)) || continue
    for value in nan -1e9 1e400 seven ''; do
        bad "ground.$key" "$mild" press --ground sand_loose "--ground.$key=$value"
    done
done
[ "$parameters" -gt 12 ] || fail "only $parameters parameters of a ground"

# every numeric option
for option in plate depth speed tilt force cycles drag drag-speed mass seconds step; do
    bad "--$option" "$mild" press --ground sand_loose "--$option" nan
    bad "--$option" "$mild" press --ground sand_loose "--$option" -1e9
done
for option in speed trials seconds patch seed threads; do bad "--$option" "$mild" eval "--$option" nan; done
for option in patch speed seconds seed width height; do bad "--$option" "$mild" play --video x.mp4 "--$option" -1e9; done
for option in trials seconds threads; do bad "--$option" "$mild" eval "--$option" -1; done

# a text that a config file could not hold would be lost in the run folder
for value in ' x.png' 'x.png ' 'a #1.png' 'a ;1.png' "$(printf '%0199d' 0)"; do
    bad "terrain.image" "$mild" train --out run "--terrain.image=$value"
done
bad "--terrain.image=a" "$mild" train --out run $'--terrain.image=a\nb.png'

# terrain: pictures that are none, patterns that do not fit
head -c 2000 "$mild" >binary.png
printf '\x89PNG\r\n\x1a\n' >cut.png
for file in binary.png cut.png missing.png zeros folder; do
    mkdir -p folder
    [ "$file" != zeros ] || head -c 100 /dev/zero >zeros
    for command in press eval; do
        bad "terrain.image $file" "$mild" "$command" --ground sand_loose --terrain.kind=image "--terrain.image=$file"
        bad "terrain.labels $file" "$mild" "$command" --ground sand_loose --terrain.patches=image "--terrain.labels=$file"
    done
done
rm -r folder
bad "terrain.cell" "$mild" press --ground sand_loose --terrain.kind=rough --terrain.cell=0.001 --terrain.size=1000
bad "terrain.border" "$mild" press --ground sand_loose --terrain.patches=stripes --terrain.border=9
bad "--terrain.patches" "$mild" eval --ground rigid --terrain.kind=waves --terrain.patches=checker

# a policy or a config that is none
printf 'no policy' >text.safetensors
head -c 4096 "$mild" >binary.safetensors
head -c 300 /dev/zero >zeros.ini
for file in text binary; do
    bad "$file.safetensors" "$mild" eval --policy "$file.safetensors"
    bad "$file.safetensors" "$mild" play --policy "$file.safetensors" --video walk.mp4
done
bad "zeros.ini" "$mild" train --config zeros.ini --out run
bad "zeros.ini" "$mild" eval --config zeros.ini
bad "zeros.ini:1" "$mild" fit zeros.ini --plate 0.2,0.1
bad "binary.safetensors:1" "$mild" fit binary.safetensors --plate 0.2,0.1
bad "text.safetensors:1" "$mild" train --config text.safetensors --out run

# outputs that cannot be written, before an evaluation of hours
touch file
mkdir folder
for target in no/such/folder/out file/out folder ''; do
    bad "--json" timeout 60 "$mild" eval --trials 10000 --seconds 3600 --json "$target"
    bad "--csv" "$mild" press --ground sand_loose --csv "$target"
    bad "--figure" "$mild" press --ground sand_loose --figure "$target"
done
bad "--video file/walk.mp4" timeout 60 "$mild" play --seconds 3600 --video file/walk.mp4
bad "--video" timeout 60 "$mild" play --seconds 3600 --video folder
bad "--pressure file/pressure.png" timeout 60 "$mild" play --seconds 3600 --pressure file/pressure.png
bad "--pressure" timeout 60 "$mild" play --seconds 3600 --pressure folder

finish "bad input: $keys config keys, $parameters parameters of a ground, every numeric option refused"
