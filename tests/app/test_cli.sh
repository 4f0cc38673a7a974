#!/usr/bin/env bash
# The program as a user meets it: what it says, how it exits, what it writes. Usage: test_cli.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$root/tests/kit.sh" "$1"

expect 0 'usage: mild COMMAND' "$mild" --help
expect 0 'mild [0-9]*\.[0-9]*\.[0-9]*' "$mild" --version
expect 2 'usage: mild COMMAND' "$mild"
bad "pres press" "$mild" pres
bad "trials trial" "$mild" trials
expect 0 '`mild trial`.*`mild judge`' "$mild" --help
bad "mil_merged mild_merged models" "$mild" eval --model mil_merged
commands=$("$mild" --help | sed -n 's/^  \([a-z]*\)   *[a-z].*/\1/p')
[ "$(wc -w <<<"$commands")" -ge 10 ] || fail "commands of mild --help: $commands"
for command in $commands; do
    expect 0 "usage: mild $command" "$mild" "$command" --help
    bad "--no-such" "$mild" "$command" --no-such
done
for command in eval play "actuator log"; do # shellcheck disable=SC2086
    expect 0 '(default learned)' "$mild" $command --help
done

bad "ground" "$mild" press ground

# mistakes in configs and overrides
printf '[train]\nenvs = 4\niteration = 1\n' >bad_key.ini
printf '[train]\nenvs = 0\n' >bad_value.ini
bad "train.iteration train.iterations bad_key.ini:3" "$mild" train --config bad_key.ini --out run
bad "bad_value.ini:2 1 524288" "$mild" train --config bad_value.ini --out run
bad "missing.ini" "$mild" train --config missing.ini --out run
bad "train.env train.envs --train.env=4" "$mild" train --out run --train.env=4
bad "trian train --trian.envs=4" "$mild" train --out run --trian.envs=4
[ ! -e run ] || fail "a refused training left a folder"

# press
bad "sand_lose sand_loose" "$mild" press --ground sand_lose
bad "--ground" "$mild" press
bad "ground.k_pem ground.k_pen --ground.k_pem=500" "$mild" press --ground sand_loose --ground.k_pem=500
bad "fast --speed" "$mild" press --ground sand_loose --speed fast
bad "0.1x --plate" "$mild" press --ground sand_loose --plate 0.1x
bad "ground.model" "$mild" press --ground sand_loose --model rigid
bad "--model con_cone --ground.model=mild" "$mild" press --ground sand_loose --model con_cone --ground.model=mild
bad "ecc_sprin ecc_spring" "$mild" eval --ground sand_loose --ground.model=ecc_sprin
bad "--mass" "$mild" press --ground sand_loose --mass 5
bad "2500000 steps" "$mild" press --ground foam45 --depth 1 --speed 1e-5 --step 1e-7 # more than an int can count
bad "2500000 steps" timeout 60 "$mild" press --ground foam45 --drop 0 --seconds 100 --step 1e-7
bad "--drop --depth" "$mild" press --ground sand_loose --drop 0.1 --depth 0.02
bad "--force 50 100" "$mild" press --ground sand_loose --force 200,100,50
bad "--drag --cycles" "$mild" press --ground sand_loose --drag 0.1 --cycles 2
bad "/dev/full" "$mild" press --ground sand_loose --csv /dev/full
expect 0 'peak .* N' "$mild" press --ground foam45 --plate 0.1,0.1 --csv press.csv
[ "$(head -1 press.csv)" = "time_s,depth_m,force_n,moment_x_nm,moment_y_nm,zmp_x_m,zmp_y_m,area_m2" ] || fail "columns of press.csv"
awk -F, 'NR == 1 { next } NF != 8 || (NR > 2 && $1 <= time) { exit 1 } { time = $1 } $2 > depth { depth = $2 }
    END { exit !(NR > 100 && depth == 0.03) }' press.csv ||
    fail "rows of press.csv"
expect 0 'peak .* N' "$mild" press --ground sand_loose --plate sole --tilt 5
expect 0 'work of the drag' "$mild" press --ground grass --depth 0.01 --drag 0.05 --figure drag.png
[ -s drag.png ] && [ "$(head -1 drag.csv)" = "time_s,depth_m,force_n,moment_x_nm,moment_y_nm,zmp_x_m,zmp_y_m,area_m2,force_x_n,force_y_n,x_m,tilt_rad" ] ||
    fail "figure or columns of a drag"
expect 0 'first stop' "$mild" press --ground sand_dense --drop 0.05 --mass 5
expect 0 '^ *3 .* 300.000 ' "$mild" press --ground foam45 --force 300,50 --cycles 3
peak() { "$mild" press --ground sand_loose "$@" | sed -n 's/^peak \([0-9.]*\) N.*/\1/p'; }
awk "BEGIN { exit !($(peak --ground.k_pen=500) > $(peak) && $(peak --ground.k_pen=237.962) == $(peak)) }" ||
    fail "--ground.k_pen does not change the force"
# another maker's network goes to `mild trial`, which the one line of error spells out
echo "a network of another maker" >walk.onnx
echo "a checkpoint of a learner" >walk.pt
for command in eval play; do
    bad walk.onnx "$mild" $command --policy walk.onnx
    expect 2 "$command: walk.onnx: .*\`mild trial ROBOT.xml walk.onnx --describe LAYOUT\`" "$mild" $command --policy walk.onnx
done
bad walk.pt "$mild" eval --policy walk.pt
expect 2 '`python -m mild.rsl_rl walk.pt --out FILE`.*`mild trial ROBOT.xml FILE --describe LAYOUT`.*the .onnx that mjlab writes' "$mild" eval --policy walk.pt
bad none.onnx "$mild" eval --policy none.onnx
mkdir ran && touch ran/policy.safetensors
bad "ran ran/policy.safetensors" "$mild" eval --policy ran
rm -r ran
# of an option only one counts, so a second is refused; of an override's key the last counts
bad "--speed" "$mild" press --ground foam45 --speed 0.1 --depth 0.01 --speed=0.2
bad "--threads" "$mild" eval --threads 1 --threads 1
expect 0 'randomize' "$mild" eval --randomize --randomize --help
[ "$(peak --ground.k_pen=380 --ground.k_pen=500)" = "$(peak --ground.k_pen=500)" ] || fail "order of overrides"

# ground models: the same by --model and by override; overrides are laid over the matched numbers
[ "$(peak --model ecc_spring)" = "$(peak --ground.model=ecc_spring)" ] || fail "--model and --ground.model differ"
awk "BEGIN { exit !($(peak --model ecc_spring --ground.k_pen=500) > $(peak --model ecc_spring)) }" || fail "matched k_pen kept"
expect 0 'ground model con_spring' "$mild" eval --model con_spring --ground sand_loose --trials 1 --seconds 0.2 --json rival.json
grep -q '"model":.*"con_spring"' rival.json || fail "rival.json"
bad "ecc_spring --model" "$mild" press --ground snow --model ecc_spring
expect 0 'snow' "$mild" press --ground snow --depth 0.1
expect 0 'clay .*1/1 ' "$mild" eval --ground clay --speed 0.3 --trials 1 --seconds 0.2
# evaluation: turning, pushes, courses with rigid ground, what passes inside, parts taken out
expect 0 'turning .* of 0.40 rad/s' "$mild" eval --ground grass --turn 0.4 --speed 0.3 --trials 1 --seconds 3
expect 0 'sideways .* of 0.20 m/s' "$mild" eval --ground grass --sideways 0.2 --trials 1 --seconds 0.2
expect 0 'rubber+rigid .*1/1 ' "$mild" eval --ground rubber+rigid --model con_spring --trials 1 --seconds 0.2
expect 0 '1/1 ' "$mild" eval --ground grass --speed=-1.5,1.5 --sideways=-1.5 --turn=1.5 --push 0.3 --trials 1 --seconds 0.2 --json commanded.json
grep -q '"turn":.*1.5' commanded.json && grep -q '"push":.*0.3' commanded.json || fail "commanded.json: $(cat commanded.json)"
walk() { "$mild" eval --ground grass --trials 2 --seconds 1 "$@" --json - 2>/dev/null | grep -v randomize; }
[ "$(walk)" != "$(walk --randomize)" ] || fail "--randomize changes nothing"
# judged on the robot's own soles, whatever the training had, unless the key is given
printf '[task]\nsole_elements = 10\n' >coarse.ini
[ "$(walk)" = "$(walk --config coarse.ini)" ] && [ "$(walk)" != "$(walk --task.sole_elements=10)" ] || fail "sole_elements in eval"
[ "$(walk)" = "$(walk --task.sole_elements=77)" ] || fail "all elements are not the robot's own"
bad "task.sole_elements 78 foot.left 77" "$mild" eval --ground grass --trials 1 --seconds 0.1 --task.sole_elements=78
bad "task.sole_elements 20 foot.FL" "$mild" eval --robot go1 --ground grass --trials 1 --seconds 0.1 --task.sole_elements=20
# lying, on the engine's own floor too; shells must stand
expect 0 'rigid .* 0/2 .*up after - s' "$mild" eval --robot go1 --start back --ground rigid --trials 2 --seconds 1.5
expect 0 'foam45 .* 0/2 .*up after - s' "$mild" eval --robot go1 --start side --ground foam45 --trials 2 --seconds 1.5 --train.robots=batch
expect 0 'grass .*2/2 ' "$mild" eval --start stand --ground grass --trials 2 --seconds 0.2
bad "bck back task.start" "$mild" eval --start bck
expect 0 'grass .* 0/1 .*up after - s' "$mild" eval --start any --model rigid --ground grass --trials 1 --seconds 0.1
bad "task.may_lie task.shells_stand" "$mild" eval --start any --task.shells_stand=false --ground grass --trials 1 --seconds 0.1
bad "--turn" "$mild" eval --turn 1.6
bad "--push" "$mild" eval --push=-1
bad "histroy history --ablate" "$mild" eval --ablate histroy
bad "zz z --ablate" "$mild" eval --ablate zz
bad "--controller" "$mild" eval --controller stand --latent latent.csv --trials 1 --seconds 0.1
bad "--controller" "$mild" eval --controller zero --ablate z --trials 1 --seconds 0.1
expect 0 '2/2' "$mild" eval --ground rigid,rubber+rigid --trials 2 --seconds 0.2 --latent latent.csv
awk -F, 'NR == 1 { columns = NF; next } NF != columns { exit 1 } { n[$2]++ }
    END { exit !(NR == 81 && columns == 50 && n["rigid"] == 40 && n["rubber"] == 40) }' latent.csv ||
    fail "rows of latent.csv: $(head -2 latent.csv)"
"$mild" eval --ground rigid --trials 1 --seconds 0.1 --latent - 2>/dev/null | head -1 | grep -q '^trial,ground,' ||
    fail "--latent -: standard output is not the CSV alone"
bad "/dev/full" "$mild" eval --ground rigid --trials 1 --seconds 0.1 --latent /dev/full
for robots in mujoco batch; do
    "$mild" eval --ground grass --trials 2 --seconds 2 --train.robots=$robots --stances stances.csv >table || fail "--stances, $robots"
    grep -q '^ground,speed_m_s,trial,foot,start_s,duration_s,depth_m,forward_m,left_m,apex_m,x_m,y_m,torque_n_m$' stances.csv || fail "stances.csv: its names"
    awk -F, -v robots=$robots 'NR > 1 && ($1 != "grass" || $6 < 0.1 || $6 > 2 || $7 < 0.01 || $7 > 0.1 || $10 > 0.3) {bad++}
        END {exit bad || NR < 6}' stances.csv || fail "stances.csv of $robots"
done
expect 0 '^track.csv: [0-9.]* KiB$' "$mild" eval --ground rigid,grass --speed 0,0.3 --trials 2 --seconds 0.2 --track track.csv
awk -F, 'NR == 1 && !/^ground,speed_m_s,trial,time_s,com_x_m/ || NF != 12 {bad = 1} END {exit bad}' track.csv && [ "$(wc -l <track.csv)" = 161 ] ||
    fail "rows of track.csv: $(wc -l <track.csv)"
bad "--track" "$mild" eval --ground grass --trials 1 --seconds 0.1 --train.robots=batch --track track.csv
expect 0 '^feet.csv: [0-9.]* KiB$' "$mild" eval --ground rigid,grass --speed 0,0.3 --trials 2 --seconds 0.2 --feet feet.csv
awk -F, 'NR == 1 && !/^ground,speed_m_s,trial,foot,time_s,ankle_x_m/ || NF != 21 {bad = 1} END {exit bad}' feet.csv && [ "$(wc -l <feet.csv)" = 1281 ] ||
    fail "rows of feet.csv: $(wc -l <feet.csv)"
bad "--feet" "$mild" eval --ground grass --trials 1 --seconds 0.1 --train.robots=batch --feet feet.csv
bad "--program" "$mild" eval --ground grass --trials 1 --seconds 0.1 --train.robots=batch --program true
bad "--led" "$mild" eval --ground grass --trials 1 --seconds 0.1 --train.robots=batch --led
expect 2 '--led: nobody' "$mild" eval --ground grass --trials 1 --seconds 0.1 --led
bad "--led" "$mild" eval --ground grass --trials 1 --seconds 0.1 --led --json -
expect 2 "--led: '11'" bash -c "echo 11 | '$mild' eval --ground grass --trials 1 --seconds 0.1 --led"
expect 2 "--led: 'fast'" bash -c "echo fast | '$mild' eval --ground grass --trials 1 --seconds 0.1 --led"
for speed in 0.6 0.3; do
    "$mild" eval --ground grass --trials 2 --seconds 1 --led --json led.json < <(yes $speed 2>/dev/null) >led.txt 2>/dev/null || fail "--led"
    [ "$(grep -v randomize led.json)" = "$(walk)" ] && led=as || led=other
    [[ "$led $speed" =~ ^(as 0.6|other 0.3)$ ]] || fail "--led at $speed is $led"
    [ "$(wc -lw <led.txt | tr -s ' ')" = " 198 1980" ] || fail "--led tells $(wc -lw <led.txt)"
done
torque() { "$mild" eval --ground grass --trials 2 --seconds 0.3 "$@" --json - 2>/dev/null | sed -n 's/.*"torque_max": *//p'; }
whole=$(torque)
for part in z modulation estimates history; do
    [ -n "$whole" ] && [ "$(torque --ablate $part)" != "$whole" ] || fail "--ablate $part changes nothing"
done

# evaluation by the batch engine: the same whatever the threads, and what it has not is refused with the remedy
batch=("$mild" eval --train.robots=batch --trials 2 --seconds 0.3)
expect 0 'foam45 .*2/2 ' "${batch[@]}" --ground rigid,foam45 --speed 0.3,0.6 --turn 0.2 --threads 1 --json one.json
expect 0 'foam45 .*2/2 ' "${batch[@]}" --ground rigid,foam45 --speed 0.3,0.6 --turn 0.2 --threads 2 --json two.json
cmp -s one.json two.json || fail "rows of the batch engine depend on --threads"
for option in "--controller stand" "--ground rubber+grass" "--terrain.memory=true" "--task.solver=gauss_seidel" \
    "--push 0.5" "--latent latent.csv" "--ablate z"; do
    what=${option%%[ =]*}
    [[ $what != *.* ]] || what=${what#--} # a key
    bad "$what mujoco" "${batch[@]}" $option
done
bad "--trials" "$mild" eval --train.robots=batch --trials 9999 --seconds 0.3 --speed 0.1,0.2,0.3,0.4
bad "train.device" "${batch[@]}" --train.device=gpu
bad "train.device cuda:15" "$mild" train --out no_gpu --train.device=cuda:15 --train.envs=8
bad "train.device --train.robots=batch" "$mild" eval --train.device=cuda --train.robots=mujoco
bad "train.robot train.robots --train.robot=batch" "$mild" eval --train.robot=batch

# terrain
bad "--terrain.patches" "$mild" eval --ground rigid --terrain.patches=stripes
for option in "--ground rigid" "--ground sand_loose --model rigid"; do
    expect 0 ' 1/1 ' "$mild" eval $option --terrain.kind=waves --speed 0.3 --trials 1 --seconds 0.2
done
bad "terrain.image" "$mild" press --ground sand_loose --terrain.kind=image
bad "wave waves --terrain.kind=wave terrain.kind" "$mild" press --ground sand_loose --terrain.kind=wave
awk "BEGIN { exit !($(peak --depth 0.005 --terrain.kind=slope --terrain.slope=0.5) != $(peak --depth 0.005)) }" || fail "--terrain.kind does not change the force"

# info
expect 0 'sand_dense' "$mild" info grounds
expect 0 'newton' "$mild" info models

# a policy walks as it was trained to, from its own file; what --config or an override says goes before
walked() { "$mild" eval --ground rubber --trials 1 --seconds $(short && echo 1 || echo 3) "$@"; } # at 0.6 m/s
go1=$root/policies/go1.safetensors
as=(--robot go1 --policy "$go1" --task.physics_dt=0.005)
own=$(walked "${as[@]}")
[ "$own" = "$(walked --policy "$go1" --config "$root/configs/go1.ini")" ] || fail "not as with its config: $own"
[ "$own" = "$(walked "${as[@]}" --task.gait_period=0.5)" ] && [ "$own" != "$(walked "${as[@]}" --task.gait_period=0.8)" ] || fail "the gait's period"
[ "$own" = "$(walked --policy "$go1" --task.physics_dt=0.005)" ] || fail "the policy's robot"
[ "$own" = "$(walked --robot go1 --task.physics_dt=0.005)" ] || fail "the policy that ships for a robot"
[ "$(walked --robot go1 --controller stand)" = "$(walked --robot go1 --controller stand --task.gait_period=0.8)" ] || fail "a controller without a policy"
printf '[train]\nrobot = go1\n[task]\nphysics_dt = 0.005\n' >few.ini
[ "$own" = "$(walked --policy "$go1" --config few.ini)" ] || fail "a config that says nothing of how it walks"
expect 0 'task.shell_depth has no effect' "$mild" eval --policy "$go1" --ground rigid --speed 0 --trials 1 --seconds 0.1 --task.shell_depth=0.1
printf '[task]\ngait_period = 0.7\n' >gait.ini
"$mild" train --config gait.ini --out gait --train.envs=4 --train.iterations=1 --ppo.steps=4 --ppo.minibatches=1 --task.action_scale=0.3 >/dev/null 2>&1
file=gait/policy.safetensors
[ "$(walked --policy $file)" = "$(walked --policy $file --task.gait_period=0.7 --task.action_scale=0.3)" ] && \
    [ "$(walked --policy $file)" != "$(walked --policy $file --task.action_scale=0.5)" ] || fail "a key of the training's overrides"
expect 0 "" "$mild" export --policy $file --c gait_c
grep -q 'POLICY_GAIT_PERIOD 7.0*e-01' gait_c/policy.h || fail "the gait of an exported policy"

# the G1 runs: no foot is down for a tenth of the time
"$mild" eval --robot g1 --policy "$root/policies/g1_run.safetensors" --ground grass --speed 2.5 --trials 1 --seconds 5 | \
    grep -q '1/1 *2\.[45].*flight 1[0-9] %' || fail "the G1's run"

# robots and controllers
expect 0 'go1: 12 joints, 4 feet, 12.7 kg' "$mild" info robots
bad "go2 go1" "$mild" eval --robot go2
bad "go2 go1 train.robot" "$mild" train --robot go2 --out run
bad "--train.robot= ./x" "$mild" train --robot ' ./x' --out run
bad "--robot" "$mild" train --robot "./$(printf '%600s' | tr ' ' x)" --out run
[ ! -e run ] || fail "a refused robot left a folder"
bad "./nowhere/robot.ini robot.ini" "$mild" eval --robot ./nowhere
bad "sa01 go1 --robot --policy" "$mild" eval --robot go1 \
    --policy "$root/policies/mild.safetensors"
bad "stnad stand" "$mild" eval --controller stnad
expect 0 'foam45 .* 2/2' "$mild" eval --robot go1 --controller stand --ground foam45 --speed 0 --trials 2 --seconds 3 \
    --json go1.json
grep -q '"controller":.*"stand"' go1.json && grep -q '"robot":.*"go1"' go1.json || fail "go1.json: $(cat go1.json)"
expect 0 '' "$mild" train --robot go1 --out go1 --train.envs=4 --train.iterations=1 --ppo.steps=4 --ppo.minibatches=1
grep -qx 'robot = go1' go1/config.ini || fail "config.ini does not keep the robot"
for robot in go1 g1; do # their own trainings begin
    expect 0 '' "$mild" train --config "$root/configs/$robot.ini" --out "own_$robot" --train.envs=4 --train.iterations=1 \
        --ppo.steps=4 --ppo.minibatches=1
    grep -qx "robot = $robot" "own_$robot/config.ini" || fail "configs/$robot.ini trains another robot"
done
bad "go1/policy.safetensors go1 sa01 --robot --policy" "$mild" eval --robot sa01 --policy go1/policy.safetensors --trials 1 --seconds 0.1
expect 0 '' "$mild" eval --config go1/config.ini --policy go1/policy.safetensors --trials 1 --seconds 0.1 --ground foam45
bad "go1 sa01 go1/checkpoint_000000001.safetensors" "$mild" train --resume --robot sa01 --out go1 --train.iterations=2
expect 0 'MuJoCo' "$mild" info build
expect 0 'processor' "$mild" info devices
bad "ground grounds" "$mild" info ground
"$mild" info config >complete.ini
bad "--out" "$mild" train --config complete.ini # the printed config is read back without complaint

# a file is written into a folder that is there; nobody else's folder is made
for option in "eval --track" "export --onnx"; do # others: test_inputs.sh
    bad "nope/x.png" "$mild" $option nope/x.png
done
bad "--video" "$mild" play --video -
bad "--pressure" "$mild" play --pressure -
bad "12" "$mild" play --pressure x.png --ground "$(printf 'foam45,%.0s' {1..12})foam45" # more than a course may have

# a controller that stands follows no command: none is shown as asked, and none is taken
expect 0 'grass *0.00 .* - ' "$mild" eval --controller stand --ground grass --trials 1 --seconds 0.3
bad "--speed 0.5" "$mild" eval --controller stand --speed 0,0.5
bad "--speed 0.3" "$mild" play --controller stand --speed 0.3 --pressure x.png

# the table of play: a robot that stands has a sinkage, but no swing and no cost
expect 2 'sand_loose .* - mm  *[1-9][0-9]*\.[0-9] mm  *-$' "$mild" play --controller stand --ground sand_loose --model mild --seconds 2.2 --pressure stood.csv

# grounds of every model: in the table with the numbers that the model reads, in help and in errors, columns apart
"$mild" info grounds >grounds.txt
for ground in rubber sand_dense running_track fresh_snow dry_sand clay lunar_soil; do
    [ "$(grep -c "\b$ground\b" grounds.txt)" -ge 2 ] || fail "info grounds lacks $ground in one of its two tables"
    "$mild" press --help | grep -q "\b$ground\b" || fail "press --help lacks $ground"
done
awk '/^  [a-z]+_?[a-z]* / && NF > 3 && /[0-9][a-z]*e[+-][0-9]+[0-9.]+e/ { exit 1 }' grounds.txt || fail "columns run together"
[ "$(awk '$1 == "k_phi" { print NF; exit }' grounds.txt)" = 6 ] || fail "the row of k_phi: $(grep k_phi grounds.txt)"
finish "command line: all as expected"
