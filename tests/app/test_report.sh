#!/usr/bin/env bash
# mild report: what the page shows of run folders, and what it says of damaged ones. Usage: test_report.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

# run FOLDER SEED FACTOR: a run of 101 iterations whose return is FACTOR times the iteration, and a column of its own.
run() {
    mkdir "$1"
    awk -v f="$3" 'BEGIN { print "iteration,episode/reward,loss/value,reward/gait,reward/none,mine"
        for (i = 0; i <= 100; i++) printf "%d,%g,%g,0.5,0,nan\n", i, f * i, 10 ^ (-i / 50) }' >"$1/log.csv"
    printf '[train]\nenvs = %s\nseed = %s\n[terrain]\nseed = 1\n' "${4:-64}" "$2" >"$1/config.ini"
}
run seed1 1 1
run seed2 2 3
run seed3 3 5
run other 1 0.5 '<128>'
printf '0.1.0 & more\nmild train\n' >seed1/version.txt
cat >seed2/eval.json <<'END'
{"rows": [{"ground": "sand_loose", "speed": 0.6, "trials": 10, "success": 9, "velocity": 0.59, "cot": 0.7, "torque_max": 81.4,
    "clearance": 0.052, "penetration": 0.074, "drift": 0.0032},
    {"ground": "foam25", "speed": 0.6, "trials": 10, "success": 0, "velocity": 0, "cot": 0, "torque_max": 90, "clearance": 0.01,
    "penetration": 0.1, "drift": 0.001, "measured": 0}]}
END
printf 'ten bytes!' >seed1/small.mp4
head -c 4194305 /dev/zero >'other/big one.mp4'
mkdir pages

expect 0 'report seed1/report.html' "$mild" report seed1
expect 0 '' "$mild" report seed1 seed2 other seed3 --out pages/page.html
page=$(cat pages/page.html)
"$mild" report seed1 seed2 --out - | head -1 | grep -q '^<!doctype html>$' || fail "--out -: standard output is not the page alone"
! grep -qE '(src|href)="?(http|//)|<script|<link|@import|url\(' <<<"$page" || fail "the page needs other files"
has() { grep -qF -- "$1" <<<"$page" || fail "the page has not: $1"; }
has '0.1.0 &amp; more'
has '<td>sand_loose<td class=n>9 of 10<td class=n>0.60<td class=n>0.59<td class=n>0.70<td class=n>81<td class=n>52<td class=n>74<td class=n>3'
has '<td>foam25<td class=n>0 of 10<td class=n>0.60<td class=n><td class=n><td class=n>90<' # they fell too early
has '<td class=n>100<td class=n>97.50<' # iterations, and the mean return over the last six rows
has "src=\"data:video/mp4;base64,$(printf 'ten bytes!' | base64)\""
has 'src="../other/big%20one.mp4"'
has '<tr><td>train.envs<td>64<td>&lt;128&gt;<td>' # default: whatever it is
has 'seed1 (3 seeds)'
has '>gait</text>'
! grep -q '>none</text>' <<<"$page" || fail "a chart of a reward that is 0 throughout"
! grep -q '<td>terrain.seed' <<<"$(sed -n '/Between the runs/,/<\/table>/p' <<<"$page")" || fail "keys that do not differ are listed"
alone=$(cat seed1/report.html)
defaults=$(sed -n '/From the defaults/,/<\/table>/p' <<<"$alone")
grep -q '<td>train.envs<td>64' <<<"$defaults" && ! grep -q '<td>terrain.seed' <<<"$defaults" || fail "differences from the defaults: $defaults"
grep -q 'From the defaults' <<<"$alone" && ! grep -q 'Between the runs' <<<"$alone" || fail "differences of a single run"

# The curves of the return: the mean of the seeds is 3 i, its band from i to 5 i, the other run is i / 2. So at the last iteration
# the heights above that of the first are as 3 to 1 to 5 to 0.5, and the axis is linear in i.
python3 - pages/page.html <<'END' || fail "curves of the return"
import re, sys
page = open(sys.argv[1], encoding="utf-8").read()
def paths(title):
    svg = next(s for s in page.split("<svg")[1:] if f">{title}</text>" in s.split("</svg>")[0])
    svg = svg.split("</svg>")[0]
    return [(re.search("#[0-9a-f]{6}", style).group(), [tuple(map(float, p.split())) for p in re.findall(r"[ML]([^MLh]+)", way)])
            for style, way in re.findall(r'<path (fill.*?) d="([^"]*)"', svg)]
(band_color, band), (mean_color, mean), (other_color, other) = paths("return of an episode")
assert band_color == mean_color != other_color
chips = {name: color for color, name in re.findall(r'<i style="background:(#[0-9a-f]{6})"></i>([a-z0-9]+)<td', page)}
assert chips == {"seed1": mean_color, "seed2": mean_color, "seed3": mean_color, "other": other_color}, chips
assert len(mean) == len(other) == 101 and len(band) == 202
rise = lambda p: mean[0][1] - p[1]
assert abs(rise(mean[100]) - 6 * rise(other[100])) < 0.3, (mean[100], other[100])
assert abs(rise(band[100]) - 5 / 3 * rise(mean[100])) < 0.2 and abs(rise(band[101]) - rise(mean[100]) / 3) < 0.2
assert all(abs(rise(p) - i / 100 * rise(mean[100])) < 0.11 for i, p in enumerate(mean))
assert rise(mean[100]) > 0 and mean[100][0] > mean[0][0]
assert all(abs(p[0] - mean[0][0] - i / 100 * (mean[100][0] - mean[0][0])) < 0.11 for i, p in enumerate(mean))
_, value = paths("value loss")[-1]  # 10^(-i / 50): a straight line where the axis is logarithmic
assert all(abs(p[1] - value[0][1] - i / 100 * (value[100][1] - value[0][1])) < 0.11 for i, p in enumerate(value))
labels = [float(x) for x in re.findall(r"text-anchor=end>([-0-9.e]+)<", page.split(">value loss</text>")[1].split("</svg>")[0])]
assert labels == [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1], labels
END

# Columns as a training has them: 300 points of 500 rows. A point is the mean of the rows whose iterations, from 0 to 1497 by 3, are nearest
# to its place; the axis holds the least and the greatest of these with a margin of 4 %. Of the last twentieth: rows 474 to 499.
mkdir long
awk 'BEGIN { print "iteration,episode/reward"
    for (i = 0; i < 500; i++) printf "%d,%s\n", 3 * i, i % 7 == 5 ? "nan" : i * i % 101 - 50 }' >long/log.csv
expect 0 '' "$mild" report long
python3 - long/report.html <<'END' || fail "points of a long run"
import re, sys
page = open(sys.argv[1], encoding="utf-8").read()
rows = [(3 * i, i * i % 101 - 50) for i in range(500) if i % 7 != 5]
places = [1497 * k / 299 for k in range(300)]
near = [[value for at, value in rows if abs(at - place) < 1497 / 299 / 2] for place in places]
means = [(place, sum(values) / len(values)) for place, values in zip(places, near) if values]
low, high = min(value for _, value in means), max(value for _, value in means)
margin = 0.04 * (high - low)
way = re.search(r'<path fill=none .*? d="M(.*?)h0"', page).group(1)
points = [tuple(map(float, point.split())) for point in way.split("L")]
assert len(points) == len(means) < 300, (len(points), len(means))
for (x, y), (place, value) in zip(points, means):
    assert abs(x - (52 + place / 1497 * (350 - 52))) < 0.051, (x, place)
    assert abs(y - (178 + (value - low + margin) / (high - low + 2 * margin) * (26 - 178))) < 0.051, (y, place, value)
last = [value for at, value in rows if at >= 3 * 474]
assert f"<td class=n>1497<td class=n>{sum(last) / len(last):.2f}<" in page
END

# a training is writing the last row; a run without a config
printf '101,7' >>seed1/log.csv
rm other/config.ini
expect 0 '' "$mild" report seed1 other --out again.html
grep -q '<td class=n>100<' again.html || fail "the last complete row is not the last iteration"

# runs alike whose configs name no seed
for name in plain same; do
    run $name 1 1
    sed -i '/^seed/d' $name/config.ini
done
expect 0 "" "$mild" report plain same seed2 --out alike.html
grep -qF 'plain (2 seeds)' alike.html || fail "runs without a seed are not one group"

# a named page: no page by halves, and links are for others to follow
ln -s ../seed1/config.ini pages/link.html
bad "--out pages/link.html" "$mild" report seed1 --out pages/link.html
mkdir linked theirs
ln -s ../seed1/log.csv linked/log.csv
bad "linked/log.csv link" "$mild" report linked
cp seed2/log.csv theirs
echo '<title>mine</title>' >theirs/report.html
bad "theirs/report.html --out" "$mild" report theirs
mkfifo theirs/version.txt
bad "theirs/version.txt pipe" "$mild" report theirs --out pages/theirs.html
bad "--out" "$mild" report seed1 --out a.html --out b.html
bad "standard output" bash -c '"$0" report seed1 --out - >/dev/full' "$mild"
bad "install python3 MILD_PYTHON /no/python" env MILD_PYTHON=/no/python "$mild" report seed1
bad "here/python/mild/report.py" env MILD_HOME=here "$mild" report seed1

bad "nowhere/log.csv" "$mild" report nowhere
bad "report RUN" "$mild" report
bad "--out seed1/config.ini" "$mild" report seed1 --out seed1/config.ini
bad "--out seed2/eval.json" "$mild" report seed1 seed2 --out seed2/eval.json
bad "/dev/full" "$mild" report seed1 --out /dev/full
bad "--out no/where.html" "$mild" report seed1 --out no/where.html
mkdir new torn foreign odd folder folder/log.csv
head -1 seed1/log.csv >new/log.csv
bad "new/log.csv" "$mild" report new
sed '3s/,.*//' seed2/log.csv >torn/log.csv
bad "torn/log.csv:3 1 6" "$mild" report seed2 torn
printf 'time_s,depth_m\n0,1\n' >foreign/log.csv
bad "iteration, foreign/log.csv" "$mild" report foreign
cp seed2/log.csv odd/
printf '{"rows": 1}' >odd/eval.json
bad "odd/eval.json --json" "$mild" report odd
rm odd/eval.json
printf '[train]\nenvs\n' >odd/config.ini
bad "odd/config.ini:2" "$mild" report odd
bad "folder/log.csv" "$mild" report folder
rm odd/config.ini
log() { # NAMES TEXT: a log that is refused
    printf "$2" >odd/log.csv
    bad "$1" "$mild" report odd
}
log 'odd/log.csv iteration,' ''
log 'odd/log.csv iteration,' 'iteration,a'
log 'odd/log.csv iteration,' 'iteration\n1\n'
log 'odd/log.csv row' 'iteration,a\n1,2'
log 'odd/log.csv:3 1 2' 'iteration,a\n1,2\n2\n3,4\n'
log 'odd/log.csv:2 3 2' 'iteration,a\n1,2,3\n'
log 'odd/log.csv:2 1,' 'iteration,a\n1,\n2,3\n'
log 'odd/log.csv:2 row' 'iteration,a\n\n'
log 'odd/log.csv:3 iteration 2' 'iteration,a\n2,2\n2,3\n'
log 'odd/log.csv:2 iteration nan' 'iteration,a\nnan,2\n'
log 'odd/log.csv:2 iteration -1' 'iteration,a\n-1,2\n'
log 'odd/log.csv:2 iteration 1e+300' 'iteration,a\n1e300,2\n'
log 'odd/log.csv:3 row' 'iteration,a\n1,2\n\0,3\n'

finish "report: pages, curves, bad input"
