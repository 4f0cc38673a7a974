#!/usr/bin/env bash
# Two processes, a runner and a simulated robot: a walk; states that are lost or come late; either side dead; bad input. In
# lockstep, so that a busy machine only makes it slower. Usage: test_drive.sh PATH_TO_MILD PYTHON
tests=$(realpath "$(dirname "$0")")
source "$tests/../../../tests/kit.sh" "$1"
python=$2
config=$(realpath "$tests/../../../configs/walk.ini")

# start NAME OPTIONS...: a runner in the background, $runner, at $address, which writes NAME.json, .out, .err
start() {
    local name=$1 patience=(--damp-after 20)
    shift
    [[ " $* " != *" --damp-after "* ]] || patience=()
    "$mild" drive --config "$config" --listen 127.0.0.1:0 --late 10 "${patience[@]}" --stall-after 20 --json "$name.json" "$@" \
        >"$name.out" 2>"$name.err" </dev/null &
    runner=$!
    for ((i = 0; i < 600; i++)); do
        address=$(sed -n 's/^mild drive: [a-z0-9]* at \([0-9.]*:[0-9]*\);.*/\1/p' "$name.err" 2>/dev/null)
        [ -n "$address" ] && return
        sleep 0.05
    done
    fail "the runner of $name says no address: $(cat "$name.err")"
}

# robot NAME OPTIONS...: a simulated robot, which writes NAME_robot.json
robot() {
    local name=$1
    shift
    timeout 120 "$mild" drive --simulate --lockstep --config "$config" --connect "$address" --json "${name}_robot.json" "$@" >/dev/null
}

# ended CODE: the runner ends so
ended() {
    wait "$runner"
    local got=$?
    [ "$got" = "$1" ] || fail "the runner ended with $got instead of $1"
}

# value FILE KEY
value() {
    sed -n "s/.*\"$2\":[^0-9a-z\"-]*\"*\([^\",]*\).*/\1/p" "$1"
}

# holds FILE KEY CONDITION: of x, the value
holds() {
    awk -v x="$(value "$1" "$2")" "BEGIN { exit !($3) }" || fail "$1: $2 is $(value "$1" "$2"), not $3"
}

# five seconds on loose sand
start walk --command 0.6,0,0
robot walk --ground sand_loose --seconds 5 || fail "the robot of walk"
ended 0
holds walk_robot.json seconds 'x == 5'
holds walk_robot.json way_x_m 'x > 2 && x < 3.2'
holds walk_robot.json fallen 'x == "false"'
holds walk_robot.json damped_s 'x == 0'
holds walk_robot.json sent 'x == 500'
holds walk.json steps 'x >= 500 && x <= 504'
holds walk.json lost 'x == 0'
holds walk.json end 'x == "robot"'
[ "$(value walk.json count | head -1)" -ge 500 ] || fail "wake-ups: $(value walk.json count)"
"$python" - <<'PY' || fail "times: $(cat walk.json)"
import json, re
run = json.load(open("walk.json", encoding="utf-8"))
printed = open("walk.out", encoding="utf-8").read()
names, quantiles = ("wakeup", "compute", "reply", "age"), {"p50_s": 0.5, "p99_s": 0.99, "p999_s": 0.999, "longest_s": 1}
for name in names:
    times = run[name]
    assert 2e-6 < times["p50_s"] <= times["p99_s"] <= times["p999_s"] <= times["longest_s"], name
    assert sum(count for _, _, count in times["bins"]) == times["count"], name
    for key, share in quantiles.items():  # in the bin at which so many times are counted
        seen = 0
        for low, high, count in times["bins"]:
            seen += count
            if seen >= share * times["count"]:
                break
        assert low * 0.999 <= times[key] <= high * 1.001 or high == times["bins"][-1][1] and low * 0.999 <= times[key], (name, key)
    row = re.search(rf"^{'wake-up' if name == 'wakeup' else name} +([\d. ]+)$", printed, re.M).group(1).split()
    assert [abs(float(us) - 1e6 * times[key]) < 0.06 for us, key in zip(row, quantiles)] == [True] * 4, (name, row)
# a reply goes out when the age of its state and the computing are over
mean = {name: sum((low + high) / 2 * count for low, high, count in run[name]["bins"]) / run[name]["count"] for name in names}
assert abs(mean["reply"] - mean["age"] - mean["compute"]) < 0.25 * mean["reply"], mean
assert run["reply"]["longest_s"] <= run["age"]["longest_s"] + run["compute"]["longest_s"] + 1e-3
assert run["reply"]["count"] == run["age"]["count"] == run["steps"]
assert run["wakeup"]["count"] == run["compute"]["count"] == run["ticks"]
counts = dict(ticks=r"(\d+) ticks", missed_ticks=r"(\d+) missed", steps=r"(\d+) steps", holds=r"(\d+) holds", damps=r"(\d+) damped",
              targets_limited=r"limited (\d+)", received=r"states (\d+)", lost=r"lost (\d+)", reordered=r"reordered (\d+)",
              late=r"late (\d+)", ends_ignored=r"ignored (\d+)", seconds=r"([\d.]+) s,")
for key, pattern in counts.items():
    assert abs(float(re.search(pattern, printed).group(1)) - run[key]) < 0.0051, key
ground = {name: one for name, one in run["ground"].items() if isinstance(one, dict)}
scale = {"mm": 1e3, "kN/m^3": 1e-3}
said = re.findall(r"(\w+) ([\d.e+-]+) ?(\S*) \(([\d.e+-]+) \.\. ([\d.e+-]+)\)", printed.replace(" at rest", ""))
assert len(ground) == len(said) > 3, printed
for name, median, unit, low, high in said:  # three digits of what is printed, and its interval of 90 %
    one = [scale.get(unit, 1) * ground[name][key] for key in ("low", "median", "high")]
    assert one[0] < one[1] < one[2] and all(abs(a / float(b) - 1) < 0.006 for a, b in zip(one, (low, median, high))), (name, one)
PY
grep -q '^compute ' walk.out && grep -q 'below .* us .*#' walk.out || fail "no histogram: $(cat walk.out)"

# a state of twenty is lost, two others come 25 ms late, when newer ones have been used: it stays upright
start lossy --command 0.6,0,0
robot lossy --ground foam45 --seconds 3 --drop 0.05 --delay 0.1,0.025 || fail "the robot of lossy"
ended 0
holds lossy_robot.json fallen 'x == "false"'
holds lossy_robot.json way_x_m 'x > 0.9'
holds lossy_robot.json dropped 'x > 5 && x < 22'
holds lossy.json reordered 'x > 5'
holds lossy.json reordered "x <= $(value lossy_robot.json delayed)"
holds lossy_robot.json delayed 'x > 22 && x < 45'
holds lossy.json lost "x >= $(value lossy_robot.json dropped)"
holds lossy.json holds 'x > 10'
holds lossy.json steps "x >= 300 - $(value lossy_robot.json dropped) - $(value lossy_robot.json delayed) && x < 300"

# in real time, where a busy machine may let it fall: it is never faster than the clock, and states come at every physics step
start clock --command 0.3,0,0
timeout 120 "$mild" drive --simulate --config "$config" --connect "$address" --json clock_robot.json --seconds 1 >/dev/null ||
    fail "the robot of clock"
wait "$runner" # with 2 where the robot has fallen
holds clock_robot.json real_time_factor 'x > 0 && x < 1.05'
holds clock_robot.json sent "x >= 199 * $(value clock_robot.json seconds) && x <= 202 * $(value clock_robot.json seconds)"
holds clock.json steps 'x > 0 && x <= 110'

# the robot dies: the runner damps, says so, and ends
start dead --command 0.3,0,0 --damp-after 0.2
"$mild" drive --simulate --lockstep --connect "$address" &
peer=$!
sleep 3
kill -KILL "$peer"
ended 2
grep -q 'mild drive: damped: no state for' dead.err || fail "dead: $(cat dead.err)"
holds dead.json end 'x == "damped"'
holds dead.json damps 'x > 50'

# a robot whose shanks are in the ground walks on: its base alone, or its tilt, is a fall
start go1 --robot go1 --command 0.4,0,0
robot go1 --robot go1 --ground sand_loose --seconds 2 || fail "the robot of go1"
ended 0
holds go1_robot.json fallen 'x == "false"'
holds go1_robot.json way_x_m 'x > 0.5'

# the runner dies: the robot damps itself after 0.1 s of its own time
start silent --command 0.3,0,0
robot silent --seconds 60 --patience 5 &
peer=$!
sleep 3
kill -KILL "$runner"
wait "$runner" 2>/dev/null
wait "$peer" || fail "the robot of silent"
holds silent_robot.json damped_s 'x > 0'
holds silent_robot.json end 'x == "fallen"'
rm -f silent.json

# the same in real time, where the robot has the age of its targets alone to go by
start mute
timeout 120 "$mild" drive --simulate --config "$config" --connect "$address" --json mute_robot.json --seconds 5 >/dev/null &
peer=$!
sleep 3
kill -KILL "$runner"
wait "$runner" 2>/dev/null
wait "$peer" || fail "the robot of mute"
holds mute_robot.json damped_s 'x > 0'
rm -f mute.json

# Ctrl-C ends both; a runner that was held up has missed ticks, and each tick is either made or missed
start stopped --command 0.3,0,0
robot stopped --seconds 60 &
peer=$!
sleep 2
kill -STOP "$runner"
sleep 0.5
kill -CONT "$runner"
sleep 0.5
kill -INT "$runner"
ended 0
wait "$peer" || fail "the robot of stopped"
holds stopped.json end 'x == "signal"'
holds stopped.json missed_ticks 'x > 40'
"$python" - <<'PY' || fail "times of a runner that was held up: $(cat stopped.json)"
import json
run = json.load(open("stopped.json", encoding="utf-8"))
assert run["wakeup"]["longest_s"] > 0.4  # it woke late, and computed no longer for that
assert run["compute"]["longest_s"] < 0.25
PY
holds stopped.json ticks "100 * $(value stopped.json seconds) - x - $(value stopped.json missed_ticks) < 5"
holds stopped.json ticks "100 * $(value stopped.json seconds) - x - $(value stopped.json missed_ticks) > -5"
holds stopped_robot.json end 'x == "runner"'

# a state as lab/drive/README.md makes it in Python: taken, and answered
start snippet --damp-after 2
"$python" - "$address" "$tests/../README.md" "$tests/../../../robots/sa01/robot.ini" <<'PY' || fail "the packet of lab/drive/README.md"
import re, socket, struct, sys, zlib
host, port = sys.argv[1].split(":")
sequence, answers, microseconds = 5, 0, 123456
quaternion, omega = [1, 0, 0, 0], [0, 0, 0]
angles, speeds = [0, 0, -0.24, 0.48, -0.24, 0] * 2, [0] * 12
page = open(sys.argv[2], encoding="utf-8").read()
lines = re.findall(r"^    ((?:robot|head|body|packet) = .*)", page, re.M)
assert len(lines) == 4
code = compile("\n".join(lines), sys.argv[2], "exec")
ini = open(sys.argv[3], encoding="utf-8").read()
names = re.search(r"^names\s*=((?:.*\n)(?:[ \t]+.*\n)*)", ini, re.M).group(1).split()
session, peer = 0x0123456789ABCDEF, 0
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.settimeout(60)
for mode in (0, 1):  # a greeting of five, and the walk
    for k in range(5 if mode == 0 else 1):
        sequence, microseconds = sequence + 1, microseconds + 10000
        exec(code)
        link.sendto(packet, (host, int(port)))
    target = link.recv(4096)
    while target[7] != mode:
        target = link.recv(4096)
    assert len(packet) == 172 and len(target) == 240
    assert target[:4] == b"MILD" and target[4:8] == bytes([2, 2, 12, mode])
    assert struct.unpack("<I", target[12:16])[0] == sequence
    assert struct.unpack("<I", target[-4:])[0] == zlib.crc32(target[:-4])
    assert struct.unpack("<Q", target[32:40])[0] == session
    assert struct.unpack("<I", target[40:44])[0] == zlib.crc32("\n".join(names).encode())
    kp = struct.unpack("<12f", target[44 + 48 : 44 + 96])
    assert kp == ((50, 50, 70, 70, 20, 20) * 2 if mode else (0,) * 12)
    peer = struct.unpack("<Q", target[24:32])[0]
PY
ended 2
holds snippet.json received 'x == 6'

# both with one key; without it, or with another, they do not find each other
(umask 077 && head -c 32 /dev/urandom >key && head -c 32 /dev/urandom >other)
start sealed --command 0.3,0,0 --key key
bad "$address 0.5" "$mild" drive --simulate --connect "$address" --patience 0.5 --json x.json
bad "$address 0.5" "$mild" drive --simulate --connect "$address" --patience 0.5 --json x.json --key other
robot sealed --key key --seconds 1 || fail "the robot of sealed"
ended 0
holds sealed_robot.json fallen 'x == "false"'
holds sealed_robot.json refused 'x == 0'
holds sealed.json steps 'x >= 100'
holds sealed.json key 'x > 20'
[ "$(grep -c 'refused a packet: it is not sealed with the key' sealed.err)" = 1 ] || fail "sealed: $(cat sealed.err)"

# keys of a terminal: x damps
"$python" - "$mild" <<'PY' || fail "keys"
import os, pty, subprocess, sys, time
ours, theirs = pty.openpty()
run = subprocess.Popen(
    [sys.argv[1], "drive", "--listen", "127.0.0.1:0"], stdin=theirs, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
)
assert "w s: 0.1 m/s" in run.stderr.readline()
time.sleep(0.2)
os.write(ours, b"wwa x")
assert run.wait(60) == 2
assert "damped: by key or button" in run.stderr.read()
PY

# all that they wrote fits its schema
"$python" "$tests/../../../tests/app/schema.py" "$tests/../../../docs/schema/drive.json" ./*.json ||
    fail "JSON that does not fit docs/schema/drive.json"

bad "127.0.0.1:9 0.2" "$mild" drive --simulate --connect 127.0.0.1:9 --patience 0.2 --json x.json
bad "9870 --listen" "$mild" drive --listen 9870
bad "127.0.0.1:99999 --listen" "$mild" drive --listen 127.0.0.1:99999
bad ":9870 --connect" "$mild" drive --simulate --connect :9870
bad "--listen no_such.invalid" "$mild" drive --listen no_such.invalid:9870
bad "--listen 192.0.2.1:9870" "$mild" drive --listen 192.0.2.1:9870
start first
bad "--listen $address" "$mild" drive --listen "$address"
kill -INT "$runner"
wait "$runner"
bad "no_such.safetensors" "$mild" drive --policy no_such.safetensors
echo "a network of another maker" >walk.onnx
bad walk.onnx "$mild" drive --policy walk.onnx
expect 2 'drive: walk.onnx: .*`mild trial ROBOT.xml walk.onnx --describe LAYOUT`' "$mild" drive --policy walk.onnx
bad "nosuch.ini" "$mild" drive --simulate --ground nosuch.ini
bad "sa01 go1 --robot --policy" "$mild" drive --robot go1 --policy "$tests/../../../policies/mild.safetensors"
bad "no_such" "$mild" drive --key no_such
bad "drive ." "$mild" drive --key .
bad "127.0.0.1:x --peer" "$mild" drive --peer 127.0.0.1:x
bad "--peer" "$mild" drive --peer 0.0.0.0
bad "--connect 192.0.2.1:9870 --bind" "$mild" drive --simulate --connect 192.0.2.1:9870
bad "--bind 192.0.2.1" "$mild" drive --simulate --bind 192.0.2.1
rm key other
bad "--gamepad ." "$mild" drive --listen 127.0.0.1:0 --gamepad .
for given in --policy=x --listen=x --command=0,0,0 --gamepad=x --no-keys --late=0.02 --damp-after=1 --speed-limit=30 --angle-limit=0.2 \
    --torque-share=1 --peer=127.0.0.1 --turn-limit=1 --glitch=0.1 --stall-after=1; do
    bad "${given%=*} --simulate" "$mild" drive --simulate $given
done
for given in --connect=x --bind=x --ground=foam45 --model=mild --lockstep --patience=1 --drop=0 --delay=0,0 --seed=1; do
    bad "${given%=*} --simulate" "$mild" drive $given
done
bad "--command 0.5,0,0" "$mild" drive --command 0.5
bad "--delay 0 0.05,0.02" "$mild" drive --simulate --delay 0.05
bad "foma45 foam45" "$mild" drive --simulate --ground foma45
bad "task.gait_perod task.gait_period --task.gait_perod=0.7" "$mild" drive --task.gait_perod=0.7
bad "--json no_such_folder/x.json no_such_folder" "$mild" drive --json no_such_folder/x.json
for option in late damp-after stall-after glitch turn-limit speed-limit angle-limit torque-share seconds patience drop; do
    bad "--$option" "$mild" drive "--$option" -7
done
bad "--torque-share 0.01 1" "$mild" drive --torque-share 1.01
bad "--torque-share 0.01 1" "$mild" drive --torque-share 0
finish "two processes walk, and end as they should"
