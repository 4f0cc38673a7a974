#!/usr/bin/env bash
# `mild press` to `mild fit` and back, and every bad record refused with nothing written. Usage: test_fit.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

# noise SEED <press.csv: 2 % of every force, normally distributed.
noise() {
    awk -F, -v OFS=, -v seed="$1" 'BEGIN { srand(seed) } NR > 1 {
        $3 *= 1 + 0.02 * sqrt(-2 * log(1 - rand())) * cos(6.283185307179586 * rand()) } { print }'
}

# value FILE NAME: of a parameter in the JSON.
value() {
    tr -d ' \t\n' <"$1" | sed -n "s/.*\"$2\":{\"value\":\([^,]*\),.*/\1/p"
}

# near NAME VALUE TRUTH PERCENT
near() {
    awk -v v="$2" -v t="$3" -v p="$4" -v n="$1" 'BEGIN { e = 100 * (v / t - 1); printf "%-24s %6.2f %%\n", n, e
        exit !(v != "" && e < p && e > -p) }' || fail "$1: '$2' is not within $4 % of $3"
}

# refuse PATTERN COMMAND...: bad, with everything that could be written asked for.
refuse() {
    bad "$@" --json out.json --figure out.png
}

echo "errors of the fit without noise, and with 2 % noise, seeds 5, 6, 7"
while read -r ground k_pen sigma_cone; do
    "$mild" press --ground "$ground" --plate 0.2,0.1 --depth 0.04 --csv press.csv >/dev/null || fail "press $ground"
    "$mild" fit press.csv --plate 0.2,0.1 --ground "$ground" --json fit.json >/dev/null || fail "fit $ground"
    near "$ground k_pen, exact" "$(value fit.json k_pen)" "$k_pen" 0.01
    near "$ground sigma_cone, exact" "$(value fit.json sigma_cone)" "$sigma_cone" 0.01
    for seed in 7 6 5; do
        noise "$seed" <press.csv >"$ground.csv"
        "$mild" fit "$ground.csv" --plate 0.2,0.1 --ground "$ground" --json fit.json >table.txt || fail "fit $ground"
        near "$ground k_pen" "$(value fit.json k_pen)" "$k_pen" 5
        near "$ground sigma_cone" "$(value fit.json sigma_cone)" "$sigma_cone" 5
    done
done <<'GROUNDS'
rubber 1400 240000
foam60 850 200000
foam45 480 170000
foam28 190 130000
foam25 150 110000
grass 550 240000
sand_loose 380 150000
sand_dense 700 240000
GROUNDS
grep -q 'residual .* N, .* % of the force' table.txt || fail "no residual in the table"

# two speeds tell the drag; alpha and nu are one
"$mild" press --ground sand_loose --depth 0.04 --speed 1 --csv fast.csv >/dev/null
"$mild" fit sand_loose.csv fast.csv --plate 0.2,0.1 --fit k_pen,sigma_cone,alpha,nu,c_d --json fit.json >table.txt
near "two speeds: c_d" "$(value fit.json c_d)" 17.2 5
near "two speeds: alpha" "$(value fit.json alpha)" 1.047 5
grep -q '^nu and alpha: .*cannot tell them apart' table.txt || fail "alpha and nu are not said to be one"
"$mild" fit sand_loose.csv --plate 0.2,0.1 --fit k_pen,c_d | grep -q '^c_d: .*all rows have about the same speed' || fail "c_d at one speed"

# presses at constant speed tell c_g c_d only; bodies that brake tell c_g too, if loosely
for speed in 1 2; do
    "$mild" press --ground sand_loose --impact $speed --mass 5 --csv drop$speed.csv >/dev/null || fail "drop at $speed m/s"
done
rate=(--plate 0.2,0.1 --fit k_pen,sigma_cone,c_g,c_d --ground.c_g=1)
"$mild" fit sand_loose.csv fast.csv "${rate[@]}" --json fit.json >table.txt
near "presses: c_g c_d" "$(value fit.json c_d)" 46.44 2
grep -q '^c_g and c_d: .*cannot tell them apart' table.txt || fail "c_g and c_d are not said to be one"
"$mild" fit sand_loose.csv fast.csv drop1.csv drop2.csv "${rate[@]}" --json fit.json >table.txt
near "with drops: c_g" "$(value fit.json c_g)" 2.7 10
near "with drops: c_d" "$(value fit.json c_d)" 17.2 10

# the columns may stand in any order, with remarks and Windows line ends
printf '\xef\xbb\xbf# a remark\r\nforce_n, depth_m\r\n' >order.csv
awk -F, 'NR > 1 { printf "%s, %s\r\n", $3, $2 }' sand_loose.csv >>order.csv
"$mild" fit order.csv --plate 0.2,0.1 --json fit.json >/dev/null || fail "columns in another order"
near "another order: k_pen" "$(value fit.json k_pen)" 380 5

"$mild" fit --help | grep -q 'usage: mild fit DATA.csv' || fail "no help"

# bad input
fit=("$mild" fit)
plate=(--plate 0.2,0.1)
edit() { awk -F, -v OFS=, "$1" sand_loose.csv >bad.csv; }
refuse 'missing.csv: cannot read.*mild press' "${fit[@]}" missing.csv "${plate[@]}"
refuse 'no record given' "${fit[@]}" "${plate[@]}"
refuse '--plate' "${fit[@]}" sand_loose.csv
refuse '--plate' "${fit[@]}" sand_loose.csv --plate 0.2
refuse "unknown parameter 'k_pem'; nearest is 'k_pen'" "${fit[@]}" sand_loose.csv "${plate[@]}" --fit k_pem
refuse "nearest is 'sand_loose'" "${fit[@]}" sand_loose.csv "${plate[@]}" --ground sand_lose
refuse 'alpha' "${fit[@]}" sand_loose.csv "${plate[@]}" --alpha 2
edit '{ print $1, $2 }' && refuse 'bad.csv:1: no column force_n; name' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $3 = "nan" } { print }' && refuse "bad.csv:9: force_n 'nan' is not a finite number; correct" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $2 = "" } { print }' && refuse 'bad.csv:9: depth_m is missing; fill' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { print $1; next } { print }' && refuse 'bad.csv:9: depth_m is missing' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $2 = "1 mm" } { print }' && refuse "bad.csv:9: depth_m '1 mm'" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $3 = "1e999" } { print }' && refuse "bad.csv:9: force_n '1e999' is not a finite" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $3 = "12,5" } { print }' && refuse 'bad.csv:9: 8 values under 7 columns; a decimal point' "${fit[@]}" bad.csv "${plate[@]}"
awk 'BEGIN { print "depth_m,force_n"; for (i = 0; i <= 1000000; i++) print i * 1e-8 "," i }' >bad.csv
refuse 'bad.csv:1000002: more than 1000000 rows; take every tenth' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $1 = 0 } { print }' && refuse 'bad.csv:9: time_s 0 does not come after' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR > 1 { $2 *= 1000 } { print }' && refuse 'depth_m .* is beyond 2; it must be in metres' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR > 1 { $2 = -$2 } { print }' && refuse 'depth_m: 0 of 2001 rows.*positive down' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR > 1 { $3 = -$3 } { print }' && refuse 'force_n does not push back' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR < 9 { print }' && refuse 'depth_m: 6 of 7 rows.*at least 8' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 1 { print $0, "depth_m"; next } { print }' && refuse 'two columns are named depth_m' "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 1' && refuse 'depth_m: 0 of 0 rows' "${fit[@]}" bad.csv "${plate[@]}"
: >bad.csv && refuse 'bad.csv: empty' "${fit[@]}" bad.csv "${plate[@]}"
head -c 3000 "$mild" >bad.csv && refuse 'bad.csv:' "${fit[@]}" bad.csv "${plate[@]}"
cp sand_loose.csv out_fit.csv
"${fit[@]}" out_fit.csv "${plate[@]}" --figure out.png >/dev/null 2>&1 && fail "a record was written over"
cmp -s sand_loose.csv out_fit.csv || fail "a record was changed"

finish "fit: all as expected"
