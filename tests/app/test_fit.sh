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
    tr -d " \t\n" <"$1" | sed -n "s/.*\"$2\":{\"value\":\([^,]*\),.*/\1/p"
}

# refuse NAMES COMMAND...: bad, with everything that could be written asked for.
refuse() {
    bad "$@" --json out.json --figure out.png
}

cone() { awk -v s="$1" -v a="$2" 'BEGIN { print s / cos(a) }'; }
shape() { awk -v a="$1" -v n="$2" 'BEGIN { print sin(a) / cos(a) / n }'; }
plate=(--plate 0.2,0.1)
sand=(--ground sand_loose --model mild --ground.k_pen=380 --ground.sigma_cone=150000)

echo "errors of the fit with nothing held, without noise, and with 2 % noise"
while read -r ground k_pen sigma_cone alpha nu; do
    "$mild" press --ground "$ground" --model mild "--ground.k_pen=$k_pen" "--ground.sigma_cone=$sigma_cone" "${plate[@]}" --depth 0.04 --csv press.csv >/dev/null || fail "press $ground"
    "$mild" fit press.csv "${plate[@]}" --json fit.json >/dev/null || fail "fit $ground"
    near "$ground k_pen, exact" "$(value fit.json k_pen)" "$k_pen" 0.01
    near "$ground cone, exact" "$(value fit.json 'sigma_cone\/cos(alpha)')" "$(cone "$sigma_cone" "$alpha")" 0.01
    near "$ground shape, exact" "$(value fit.json 'tan(alpha)\/nu')" "$(shape "$alpha" "$nu")" 0.01
    grep -q '"undetermined":.*"sigma_cone", "alpha", "nu"' fit.json || fail "$ground: sigma_cone, alpha, nu have values"
    "$mild" fit press.csv "${plate[@]}" --hold alpha="$alpha" --json fit.json >/dev/null || fail "fit $ground"
    near "$ground nu, alpha held" "$(value fit.json nu)" "$nu" 0.01
    near "$ground sigma_cone, alpha held" "$(value fit.json sigma_cone)" "$sigma_cone" 0.01
    noise 5 <press.csv >"$ground.csv"
    "$mild" fit "$ground.csv" "${plate[@]}" --hold-from "$ground" --fit k_pen,sigma_cone --json fit.json >table.txt ||
        fail "fit $ground"
    near "$ground k_pen" "$(value fit.json k_pen)" "$k_pen" 5
    near "$ground sigma_cone" "$(value fit.json sigma_cone)" "$sigma_cone" 5
done <<'GROUNDS'
foam45 480 170000 1.10 1.6
sand_loose 380 150000 1.047 2.0
GROUNDS
grep -q 'residual .* N, .* % of the force' table.txt || fail "no residual in the table"

echo "bias of the curve in each file"
"$mild" press --ground foam45 "${plate[@]}" --depth 0.03 --csv one.csv >/dev/null || fail "press"
awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "force_n") c = i; print; next } { $c *= 1.5; print }' one.csv >half_more.csv
"$mild" fit one.csv half_more.csv "${plate[@]}" --json files.json >files.txt || fail "two files"
grep -q '^bias by file: one.csv +25.0 %, half_more.csv -16.7 %$' files.txt || fail "$(grep bias files.txt)"
bias() { tr -d " \t\n" <files.json | sed -n "s|.*\"file\":\"$1\",\"force\":\([-0-9.e]*\)}.*|\1|p"; }
near "bias in one.csv" "$(bias one.csv)" 0.25 0.1
near "bias in half_more.csv" "$(bias half_more.csv)" -0.16667 0.1
"$mild" fit one.csv "${plate[@]}" --json files.json >files.txt || fail "one file"
! grep -q bias files.txt && ! grep -q bias files.json || fail "bias of a single file"
grep -q '^the intervals assume alpha = 1.047, nu = 2, c_g = 2.7' table.txt || fail "what is held is not said"

# what is assumed and what is not determined
"$mild" fit foam45.csv "${plate[@]}" >table.txt
grep -q '^not determined by these data: sigma_cone, alpha, nu, c_g, c_d, phi, rho; hold .*--hold-from' table.txt ||
    fail "what is not determined is not said"
grep -q '^alpha  *-  *-  *-  rad' table.txt || fail "alpha has a value"
grep -q '^the intervals assume no firm bed down to 0.04 m' table.txt || fail "the bed"
grep -q '^a press at another speed or a drop says more about c_g, c_d' table.txt || fail "one speed"
grep -q '^no press straight down determines mu, k_drift, b_drift, slip_length' table.txt || fail "what no press determines"
"$mild" fit foam45.csv "${plate[@]}" --hold alpha=1.1,c_g=0 >table.txt
grep -q '^the intervals assume alpha = 1.1, c_g = 0$' table.txt || fail "what is held"
"$mild" fit foam45.csv "${plate[@]}" --hold-from foam45 >table.txt
grep -q '^the intervals assume alpha = 1.1, .* of foam45, because the data do not determine them' table.txt || fail "what is filled"
grep -q '^nu  *1\.[56]' table.txt || fail "nu is not fitted"
"$mild" fit foam45.csv "${plate[@]}" --model ecc_spring | grep -q 'neighbouring rows are alike.*another --model' || fail "a wrong law is not said"

# a bed within the record
"$mild" press --ground foam45 "${plate[@]}" --depth 0.04 --ground.bed_depth=0.03 --csv bed.csv >/dev/null
"$mild" fit bed.csv "${plate[@]}" --hold bed_depth=0.03 --json fit.json >table.txt
near "bed at 30 mm: k_pen" "$(value fit.json k_pen)" 480 0.1

# two speeds determine the drag
"$mild" press "${sand[@]}" --depth 0.04 --speed 1 --csv fast.csv >/dev/null
"$mild" fit sand_loose.csv fast.csv "${plate[@]}" --hold-from sand_loose --fit k_pen,sigma_cone,alpha,c_d --json fit.json >table.txt
near "two speeds: c_d" "$(value fit.json c_d)" 17.2 5
near "two speeds: alpha" "$(value fit.json alpha)" 1.047 5
"$mild" fit sand_loose.csv "${plate[@]}" --hold-from sand_loose --hold sigma_cone=150000 --fit k_pen,c_d --json fit.json >/dev/null
tr -d ' \t\n' <fit.json | grep -q '"limits":{"c_d":{' || fail "c_d at one speed"

# every model, each in its own parameters; the press is matched to foam45
"$mild" press --ground foam45 --model hunt_crossley --depth 0.04 --speed 1 --csv fast_hunt_crossley.csv >/dev/null
for model in con_cone con_spring ecc_spring ecc_quasi ecc_quasi_3d bekker hunt_crossley; do
    "$mild" press --ground foam45 --model $model --depth 0.04 --csv "$model.csv" >/dev/null || fail "press --model $model"
    "$mild" fit "$model.csv" $([ $model = hunt_crossley ] && echo fast_$model.csv) "${plate[@]}" --model $model \
        --json $model.json >table.txt || fail "fit --model $model"
    grep -q "\"model\":.*\"$model\"" $model.json || fail "the model's name"
done

# a plate for each file, in order: the numbers of one plate, and of bekker k_c and k_phi each by itself
"$mild" press --ground foam45 --plate 0.15,0.1 --depth 0.04 --csv small.csv >/dev/null
"$mild" press --ground foam45 --plate 0.3,0.1 --depth 0.04 --csv large.csv >/dev/null
"$mild" fit small.csv large.csv --plate 0.15,0.1 --plate 0.3,0.1 --json fit.json >table.txt
near "two plates: k_pen" "$(value fit.json k_pen)" 480 0.1
"$mild" fit large.csv small.csv --plate 0.3,0.1 --plate 0.15,0.1 --figure plates.png --json fit.json >/dev/null
near "two plates, the other way round: k_pen" "$(value fit.json k_pen)" 480 0.1
awk -F, 'NR > 1 && ($3 - $5) ^ 2 > 1 { exit 1 }' plates_fit.csv || fail "the figure's forces are those of another plate"
"$mild" press --ground clay --plate 0.15,0.1 --depth 0.04 --csv narrow.csv >/dev/null
"$mild" press --ground clay --plate 0.3,0.2 --depth 0.04 --csv wide.csv >/dev/null
"$mild" fit narrow.csv wide.csv --plate 0.15,0.1 --plate 0.3,0.2 --model bekker --json clay.json >/dev/null
near "two plates: k_c" "$(value clay.json k_c)" 13190 0.5
near "two plates: k_phi" "$(value clay.json k_phi)" 692150 0.5
bad "ground.k_c 0.04 0.0433432 ground.plate_width" "$mild" press --ground clay --ground.k_c=-30000 --plate 0.1,0.04 --depth 0.02 --csv out.csv
bad "ground.k_c -90000 0.13003 ground.plate_width" "$mild" eval --ground clay --ground.k_c=-90000 --controller stand --trials 1 --seconds 1
refuse "fit k_c k_phi 0.1" "$mild" fit narrow.csv --plate 0.15,0.1 --model bekker --hold k_c=-500,k_phi=4900
refuse "--plate 2 1" "$mild" fit small.csv --plate 0.15,0.1 --plate 0.3,0.1
refuse "--plate 3" "$mild" fit small.csv --plate 0.15,0.1,0.1
refuse "--hold plate_width --plate" "$mild" fit wide.csv --plate 0.3,0.2 --model bekker --hold plate_width=0.1

# the way up determines recovery: of foam at least all but a little, of sand at most a little, of grass a half
"$mild" fit foam45.csv "${plate[@]}" | grep -q '^recovery  *-  *0.99[0-9]*  *-  -$' || fail "foam springs back"
"$mild" press --ground grass --depth 0.04 --csv grass.csv >/dev/null
"$mild" fit grass.csv "${plate[@]}" --json fit.json >table.txt
near "grass: recovery" "$(value fit.json recovery)" 0.5 2
"$mild" press --ground clay --plate 0.05 --depth 0.04 --csv round.csv >round.txt
grep -q 'a round plate of 0.05 m: 5 elements' round.txt || fail "a round plate: $(cat round.txt)"

# the columns may stand in any order, with remarks and Windows line ends
printf '\xef\xbb\xbf# a remark\r\nforce_n, depth_m\r\n' >order.csv
awk -F, 'NR > 1 { printf "%s, %s\r\n", $3, $2 }' sand_loose.csv >>order.csv
"$mild" fit order.csv --plate 0.2,0.1 --json fit.json >/dev/null || fail "columns in another order"
near "another order: k_pen" "$(value fit.json k_pen)" 380 5
"$mild" fit order.csv --plate 0.2,0.1 | grep -q 'assume a slow press, because' || fail "no speeds"

"$mild" fit --help | grep -q 'usage: mild fit DATA.csv' || fail "no help"

# bad input
fit=("$mild" fit)
edit() { awk -F, -v OFS=, "$1" sand_loose.csv >bad.csv; }
refuse "missing.csv" "${fit[@]}" missing.csv "${plate[@]}"
refuse "--plate" "${fit[@]}" "${plate[@]}"
refuse "--plate" "${fit[@]}" sand_loose.csv
refuse "--plate" "${fit[@]}" sand_loose.csv --plate 0.2m
refuse "k_pem k_pen --fit" "${fit[@]}" sand_loose.csv "${plate[@]}" --fit k_pem --hold-from foam45
refuse "--fit --hold-from" "${fit[@]}" sand_loose.csv "${plate[@]}" --fit k_pen
refuse "sand_lose sand_loose" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold-from sand_lose
refuse "--hold-from --hold" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold-from clay
refuse "--hold 2 0.1 1.5" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold alpha=2
refuse "alpha --hold NAME=VALUE" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold alpha
refuse "alpha=nan --hold NAME=VALUE" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold alpha=nan
refuse "mu nu --hold" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold mu=0.5
refuse "zeta alpha --hold" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold zeta=1
refuse "--hold alpha=1 alpha=1.1" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold alpha=1,alpha=1.1
refuse "--hold alpha=1 --fit" "${fit[@]}" sand_loose.csv "${plate[@]}" --hold-from foam45 --fit alpha --hold alpha=1
refuse "--hold con_spring" "${fit[@]}" sand_loose.csv "${plate[@]}" --model con_spring --hold k_pen=1
refuse "bekkr bekker" "${fit[@]}" sand_loose.csv "${plate[@]}" --model bekkr
refuse "--model" "${fit[@]}" sand_loose.csv "${plate[@]}" --model rigid
edit '{ print $1, $2 }' && refuse "bad.csv:1 force_n" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $3 = "nan" } { print }' && refuse "bad.csv:9 force_n nan" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { print $1; next } { print }' && refuse "bad.csv:9 depth_m" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $3 = "12,5" } { print }' && refuse "bad.csv:9 9 8" "${fit[@]}" bad.csv "${plate[@]}"
awk 'BEGIN { print "depth_m,force_n"; for (i = 0; i <= 1000000; i++) print i * 1e-8 "," i }' >bad.csv
refuse "bad.csv:1000002 1000000" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 9 { $1 = 0 } { print }' && refuse "bad.csv:9 time_s 0" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR > 1 { $2 *= 1000 } { print }' && refuse "bad.csv:53 depth_m 2.04 2" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR > 1 { $2 = -$2 } { print }' && refuse "bad.csv:2002 depth_m 0 2001" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR > 1 { $3 = -$3 } { print }' && refuse "force_n" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR < 11 { print }' && refuse "8 rows parameters" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR < 3 { print }' && refuse "depth_m 0 1" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR < 9 { print }' && refuse "bad.csv:8 depth_m 6 7 8" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 1 { print $0, "depth_m"; next } { print }' && refuse "depth_m columns" "${fit[@]}" bad.csv "${plate[@]}"
edit 'NR == 1' && refuse "depth_m 0" "${fit[@]}" bad.csv "${plate[@]}"
: >bad.csv && refuse "bad.csv" "${fit[@]}" bad.csv "${plate[@]}"
head -c 3000 "$mild" >bad.csv && refuse "bad.csv:1" "${fit[@]}" bad.csv "${plate[@]}"
cp sand_loose.csv out_fit.csv
"${fit[@]}" out_fit.csv "${plate[@]}" --figure out.png >/dev/null 2>&1 && fail "a record was written over"
cmp -s sand_loose.csv out_fit.csv || fail "a record was changed"

finish "fit: all as expected"
