#!/usr/bin/env bash
# A soil as a file: from records of a bevameter, written here by Bekker's and Janosi's formulas with noise, to a file; from the
# file to every command that takes a ground. Usage: test_soil.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$root/tests/kit.sh" "$1"
awk=(awk -v pi=3.141592653589793 -v n=0.8 -v kc=5790 -v kphi=180000 -v c=150 -v mu=0.62 -v K=0.018)
# the same numbers in every awk: Park and Miller's generator
normal='function unit() { seed = seed * 16807 % 2147483647; return seed / 2147483647 }
function normal() { return sqrt(-2 * log(1 - unit())) * cos(2 * pi * unit()) }'

# press SEED B AREA: down to 40 mm and up again, springing back by a tenth; noise of 1 % of the peak.
press() {
    "${awk[@]}" -v seed="$1" -v b="$2" -v area="$3" "$normal"'BEGIN {
        seed = 7919 * seed; print "depth_m,force_n"; peak = area * (kc / b + kphi) * 0.04 ^ n
        for (i = 1; i <= 200; i++) { u = 0.04 * i / 200; print u "," area * (kc / b + kphi) * u ^ n + 0.01 * peak * normal() }
        for (i = 1; i <= 100; i++) { u = 0.04 * (1 - i / 200); f = peak * (1 - (0.04 - u) / 0.004); f = f > 0 ? f : 0
            print u "," f + 0.01 * peak * normal() } }'
}

# ring SEED PRESSURE: of 0.2 and 0.12 m, by sums over thin rings; noise of 1 % of the strength.
ring() {
    "${awk[@]}" -v seed="$1" -v p="$2" "$normal"'BEGIN {
        seed = 7919 * seed; print "angle_rad,torque_nm,force_n"; R = 0.1; r0 = 0.06
        full = (c + p * mu) * 2 / 3 * pi * (R ^ 3 - r0 ^ 3)
        for (i = 1; i <= 100; i++) { a = 0.8 * i / 100; t = 0; d = (R - r0) / 200
            for (k = 0; k < 200; k++) { r = r0 + (k + 0.5) * d; t += (c + p * mu) * (1 - exp(-r * a / K)) * 2 * pi * r * r * d }
            print a "," t + 0.01 * full * normal() "," p * pi * (R ^ 2 - r0 ^ 2) } }'
}

# holds FILE.json NAME TRUTH: the interval holds the truth, and is narrow enough to be of use.
holds() {
    tr -d ' \t\n' <"$1" | sed -n "s/.*\"$2\":{\"value\":\([^,]*\),\"low\":\([^,]*\),\"high\":\([^}]*\)}.*/\1 \2 \3/p" |
        awk -v t="$3" -v n="$2" '{ printf "%-14s %10.5g  %10.5g .. %10.5g, true %g\n", n, $1, $2, $3, t
            ok = $2 <= t && t <= $3 && $3 - $2 < 0.5 * t } END { exit !ok }' || fail "$2: the interval does not hold $3"
}

p25=$(awk 'BEGIN { print 3.141592653589793 * 0.025 ^ 2 }') p75=$(awk 'BEGIN { print 3.141592653589793 * 0.075 ^ 2 }')
press 1 0.025 "$p25" >d5.csv # a round plate: b is its radius
press 2 0.075 "$p75" >d15.csv
press 3 0.1 0.03 >wide.csv
ring 4 5000 >r5.csv
ring 5 20000 >r20.csv
records=(d5.csv d15.csv wide.csv r5.csv r20.csv)
sizes=(--model bekker --plate 0.05 --plate 0.15 --plate 0.3,0.1 --ring 0.2,0.12)
"$mild" fit "${records[@]}" "${sizes[@]}" --hold k_drift=0,b_drift=0,bed_depth=1 --soil mars.ini --json fit.json >table.txt ||
    fail "fit: $(cat table.txt)"
while read -r name value; do
    holds fit.json "$name" "$value"
done <<<'k_c 5790
k_phi 180000
exponent 0.8
mu 0.62
shear_length 0.018
recovery 0.1'
# cohesion: 150 Pa beside a strength of 3 to 12 kPa; its interval may be wide
tr -d ' \t\n' <fit.json | sed -n 's/.*"cohesion":{"value":[^,]*,"low":\([^,]*\),"high":\([^}]*\)}.*/\1 \2/p' |
    awk '{ ok = $1 <= 150 && 150 <= $2 } END { exit !ok }' || fail "cohesion"
grep -q '^residual .* N/m^2, .* % of the stress (root mean square); 200 rows of slip of 2 files' table.txt || fail "residual of the shear"
grep -q '^residual .* N, .* unloading rows of 3 files' table.txt || fail "residual of the unloading"
grep -q '^no press straight down determines k_drift, b_drift, refill$' table.txt || fail "what nothing determines"

# the file: source, intervals, and numbers to the last digit
head -2 mars.ini | grep -q '^# mild fit d5.csv d15.csv wide.csv r5.csv r20.csv --model bekker --plate 0.05' || fail "no source in: $(cat mars.ini)"
grep -q '^# shear: residual .* 200 rows of slip of 2 files' mars.ini || fail "no residual in: $(cat mars.ini)"
grep -B1 '^k_c = ' mars.ini | grep -q '^# 95 %: [0-9.]* \.\. [0-9.]* N/m^(n+1)$' || fail "no interval in: $(cat mars.ini)"
grep -B1 '^bed_depth = 1$' mars.ini | grep -q '^# held$' || fail "what is held: $(cat mars.ini)"
value() { sed -n "s/^$1 = //p" mars.ini; }
[ "$(value k_c | tr -d . | wc -c)" -ge 15 ] || fail "k_c is rounded: $(value k_c)"
for name in k_c k_phi exponent mu shear_length cohesion recovery; do # the numbers of the table
    tr -d ' \t\n' <fit.json | sed -n "s/.*\"$name\":{\"value\":\([^,]*\),.*/\1/p" |
        awk -v f="$(value $name)" '{ ok = (f - $1) ^ 2 < 1e-16 * f ^ 2 } END { exit !ok }' || fail "the file's $name is $(value $name)"
done
keys=()
for key in $(sed -n 's/^\([a-z_]*\) = .*/\1/p' mars.ini | grep -v model); do
    keys+=("--ground.$key=$(value "$key")")
done

# every command: the same as a preset whose numbers are all replaced by those of the file
same() {
    cmp -s "$1" "$2" || fail "$3: the file's ground is another: $(diff "$1" "$2" | head -5)"
}
"$mild" press --ground ./mars.ini --csv a.csv >/dev/null && "$mild" press --ground clay "${keys[@]}" --csv b.csv >/dev/null
same a.csv b.csv press
for model in "" "--model bekker"; do # the file's own model stays
    "$mild" eval --ground ./mars.ini $model --trials 2 --seconds 2 --json a.json >/dev/null
    "$mild" eval --ground clay "${keys[@]}" --trials 2 --seconds 2 --json b.json >/dev/null
    sed -i 's|"./mars.ini"|"clay"|; /"model"/d' a.json && sed -i '/"model"/d' b.json
    same a.json b.json "eval $model"
done
for model in mild con_spring; do
    bad "bekker $model --model" "$mild" eval --ground mars.ini --model $model
done
expect 0 '^rubber+./mars.ini+grass ' "$mild" eval --ground rubber+./mars.ini+grass,clay,mars.ini --trials 1 --seconds 1
"$mild" eval --ground rubber+./mars.ini --patch 0.3 --trials 2 --seconds 3 --json a.json >/dev/null
"$mild" eval --ground rubber+dry_sand --patch 0.3 --trials 2 --seconds 3 --json b.json >/dev/null
cmp -s a.json b.json && fail "the file in a course is not seen"
expect 0 './mars.ini' "$mild" play --ground rubber,./mars.ini --seconds 1
(cd / && "$mild" eval --ground "$work/mars.ini" --trials 1 --seconds 1 >/dev/null) || fail "a file by its whole path"

# a soil that says only what differs, and one of mild matched to another model
printf '[ground]\npreset = sand_loose\nk_pen = 500\n' >grit.ini
"$mild" press --ground grit.ini --csv a.csv >/dev/null && "$mild" press --ground sand_loose --ground.k_pen=500 --csv b.csv >/dev/null
same a.csv b.csv preset
"$mild" press --ground grit.ini --model bekker >a.txt && "$mild" press --ground sand_loose --model bekker >b.txt
cmp -s a.txt b.txt && fail "the file is not matched to bekker"

# training draws from files, and a resumed run reads them again
train=("$mild" train --config "$root/configs/quick.ini" --train.envs=8 --ppo.minibatches=2 --train.iterations=1 --train.threads=1)
"${train[@]}" --out run --randomize.presets=grit.ini,foam45 >/dev/null 2>&1 || fail "training on a file"
grep -q '^presets = grit.ini,foam45$' run/config.ini || fail "the run does not say its soil"
"$mild" train --out run --resume --train.iterations=2 >/dev/null 2>&1 || fail "resumed on a file"
"${train[@]}" --out run2 --randomize.presets=grit.ini --randomize.preset_jitter=0 >/dev/null 2>&1
"${train[@]}" --out run3 --randomize.presets=sand_loose --randomize.preset_jitter=0 >/dev/null 2>&1
cmp -s run2/policy.safetensors run3/policy.safetensors && fail "training does not see the file"
bad "randomize.presets mars.ini randomize.model" "${train[@]}" --out no --randomize.presets=mars.ini --randomize.model=mild
bad "randomize.presets nosuch.ini" "${train[@]}" --out no --randomize.presets=grit.ini,nosuch.ini

# mistakes name file, line, key and remedy
sed 's/^k_phi = .*/k_phy = 5/' mars.ini >bad.ini
bad "k_phy k_phi" "$mild" press --ground bad.ini
grep -v '^k_phi' mars.ini >bad.ini
bad "bad.ini k_phi" "$mild" eval --ground grass,bad.ini
bad "nosuch.ini" "$mild" play --ground nosuch.ini
bad "mars" "$mild" eval --ground mars
bad "mars.txt" "$mild" eval --ground mars.txt
printf '[ground]\npreset = mars.ini\n' >self.ini
bad "mars.ini rigid self.ini:2" "$mild" press --ground self.ini

# what --soil refuses, and then writes nothing and harms nothing
cp mars.ini before.ini
fit=("$mild" fit "${records[@]}" "${sizes[@]}")
bad "--soil k_drift b_drift --hold-from" "${fit[@]}" --soil new.ini --json out.json
bad "--soil new.txt .ini" "${fit[@]}" --hold-from clay --soil new.txt
bad "--soil mars.ini" "${fit[@]}" --hold-from mars.ini --soil mars.ini
bad "--soil --json mars.ini" "${fit[@]}" --hold-from clay --soil mars.ini --json mars.ini
bad "cohesion k_pen --hold" "$mild" fit wide.csv --plate 0.3,0.1 --hold cohesion=1 --soil new.ini
bad "--model" "$mild" fit wide.csv r5.csv --plate 0.3,0.1 --ring 0.2,0.12
bad "--ring" "$mild" fit r5.csv --model bekker
bad "--ring" "$mild" fit r5.csv --model bekker --ring 0.12,0.2
bad "--ring 2 1" "$mild" fit r5.csv --model bekker --ring 0.2,0.12 --ring 0.2,0.1
bad "--plate 3 2" "$mild" fit d5.csv r5.csv wide.csv "${sizes[@]}"
printf 'slip_m,pressure_pa\n1,2\n' >bad.csv
bad "bad.csv:1 shear_pa" "$mild" fit bad.csv --model bekker
awk=("${awk[@]}" -v kphi=0) # then k_phi has a limit, which the preset's 1.5e6 is beyond
press 1 0.025 "$p25" >n5.csv
press 2 0.075 "$p75" >n15.csv
bad "--soil k_phi --hold --hold-from" "$mild" fit n5.csv n15.csv --model bekker --plate 0.05 --plate 0.15 \
    --hold-from dry_sand --soil new.ini
cmp -s mars.ini before.ini || fail "a refused fit changed the soil"

# shear alone; one pressure; a preset for what is missing; a soil as what is missing
expect 0 '^cohesion  *-  *-' "$mild" fit r5.csv --model bekker --ring 0.2,0.12
"${fit[@]}" --hold-from before.ini --soil mars.ini >/dev/null || fail "a soil for --hold-from"
grep -B1 '^bed_depth' mars.ini | grep -q '^# of before.ini' || fail "what is of a soil"
"$mild" fit wide.csv --model bekker --plate 0.3,0.1 --hold-from before.ini --soil one.ini >/dev/null || fail "one plate, the rest of a soil"
grep -B1 '^k_c' one.ini | grep -q '^# of before.ini' || fail "one plate determines k_c"

finish "soil: all as expected"
