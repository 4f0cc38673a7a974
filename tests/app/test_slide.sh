#!/usr/bin/env bash
# Plates that slide: `mild press --drag` to `mild fit` and back to a soil, for ground where slip costs support; what a level drag
# does not determine; records that are of no use. Usage: test_slide.sh PATH_TO_MILD
source "$(dirname "$0")/../kit.sh" "$1"

# ground NAME KEY=VALUE...: a soil whose numbers are the truth, but for these.
ground() {
    local name=$1
    shift
    printf '[ground]\nmodel = mild_merged\nk_pen = 230\nsigma_cone = 60000\nalpha = 0.3\nnu = 0.9\nc_g = 29\nc_d = 1\nphi = 0.59\nrho = 2500\nmu = 0.5
k_drift = 0\nb_drift = 0\nrecovery = 0\nbed_depth = 1\nslip_length = 0.0025\nregain_length = 0.0007\ngrip = 0.14\nslip_growth = 0\n' >"$name"
    for pair in "$@"; do
        sed -i "s/^${pair%%=*} = .*/${pair%%=*} = ${pair#*=}/" "$name"
    done
}

# noise SEED <record: every tenth row, with 5 % of every force, normally distributed; a file without slip has 8 columns.
noise() {
    awk -F, -v OFS=, -v seed="$1" 'BEGIN { srand(seed) }
        function error() { return 1 + 0.05 * sqrt(-2 * log(1 - rand())) * cos(6.283185307179586 * rand()) }
        NR > 1 { $3 *= error(); if (NF > 8) $9 *= error() } NR % 10 == 1 { print }'
}

# number FILE NAME KEY: of a parameter in the JSON.
number() {
    tr -d " \t\n" <"$1" | sed -n "s/.*\"$2\":{\([^}]*\)}.*/\1/p" | tr , '\n' | sed -n "s/^\"$3\"://p"
}

# holds NAME FILE TRUTH: the 95 % interval does.
holds() {
    awk -v low="$(number "$2" "$1" low)" -v high="$(number "$2" "$1" high)" -v t="$3" 'BEGIN { exit !(low != "" && low <= t && t <= high) }'
}

plates=(--plate 0.12 --plate 0.1,0.1 --plate 0.1,0.1)
known=alpha=0.3,c_g=29,c_d=1,phi=0.59,rho=2500
ground truth.ini
"$mild" press --ground ./truth.ini --plate 0.12 --depth 0.03 --csv disc.csv >/dev/null || fail "press"
"$mild" press --ground ./truth.ini --plate 0.1,0.1 --depth 0.03 --csv square.csv >/dev/null
"$mild" press --ground ./truth.ini --plate 0.1,0.1 --depth 0.015 --drag 0.03 --csv drag.csv >/dev/null

# without noise, all of it from one command
"$mild" fit disc.csv square.csv drag.csv --model mild_merged "${plates[@]}" --hold $known --json fit.json >table.txt || fail "fit"
near k_pen "$(number fit.json k_pen value)" 230 0.1
near sigma_cone "$(number fit.json sigma_cone value)" 60000 0.1
near nu "$(number fit.json nu value)" 0.9 0.1
near slip_length "$(number fit.json slip_length value)" 0.0025 0.1
near grip "$(number fit.json grip value)" 0.14 0.5
awk -v v="$(number fit.json mu low)" 'BEGIN { exit !(v > 0.3 && v < 0.5) }' || fail "mu is not bounded from below"
grep -q '^not determined by these data: mu, regain_length; .*a plate that sinks as it slides determines regain_length' table.txt ||
    fail "what a level drag does not determine"
[ "$(grep -c '"residual"' fit.json)" = 3 ] || fail "the JSON has not one residual for each kind"
grep -q 'rows that slide of 1 file' table.txt || fail "the slide's residual"

# friction that mu bounds: mu is determined, and grip from below
ground slick.ini mu=0.3 grip=0.3
"$mild" press --ground ./slick.ini --plate 0.1,0.1 --depth 0.015 --drag 0.03 --csv slick.csv >/dev/null
"$mild" fit disc.csv square.csv slick.csv --model mild_merged "${plates[@]}" --hold $known --json slick.json >/dev/null
near "mu, where it bounds friction" "$(number slick.json mu value)" 0.3 0.5
near "slip_length there" "$(number slick.json slip_length value)" 0.0025 0.1

# lengths that grow with the depth: known, they do not hide slip_length; taken for none, it is that of the depth
ground deep.ini slip_growth=0.08
for depth in 0.015 0.03; do "$mild" press --ground ./deep.ini --plate 0.1,0.1 --depth $depth --drag 0.03 --csv deep$depth.csv >/dev/null; done
"$mild" fit disc.csv square.csv deep0.015.csv deep0.03.csv --model mild_merged "${plates[@]}" --plate 0.1,0.1 --hold $known,slip_growth=0.08 \
    --json deep.json >/dev/null || fail "slip_growth"
near "slip_length that grows with the depth" "$(number deep.json slip_length value)" 0.0025 0.1
"$mild" fit disc.csv square.csv deep0.015.csv --model mild_merged "${plates[@]}" --hold $known --json deep.json >/dev/null
near "taken for one that does not, 15 mm deep" "$(number deep.json slip_length value)" 0.0037 1

# Coulomb's friction alone: mu is determined
ground coulomb.ini grip=0
"$mild" press --ground ./coulomb.ini --plate 0.1,0.1 --depth 0.015 --drag 0.03 --csv coulomb.csv >/dev/null
"$mild" fit disc.csv square.csv coulomb.csv --model mild_merged "${plates[@]}" --hold $known,grip=0 --json coulomb.json >/dev/null
near "mu without grip" "$(number coulomb.json mu value)" 0.5 0.5

# mild too, and the other way along
"$mild" press --ground grass --ground.slip_length=0.004 --ground.grip=0.2 --ground.recovery=0 --plate 0.2,0.1 --depth 0.02 --drag 0.02 \
    --csv mild.csv >/dev/null
"$mild" fit mild.csv --plate 0.2,0.1 --hold-from grass --json mild.json >table.txt || fail "mild"
near "slip_length of mild" "$(number mild.json slip_length value)" 0.004 0.5
near "grip of mild" "$(number mild.json grip value)" 0.2 1
awk -F, -v OFS=, 'NR > 1 { $9 = -$9; $11 = 0.4 - $11 } { print }' mild.csv >back.csv
"$mild" fit back.csv --plate 0.2,0.1 --hold-from grass --json back.json >/dev/null
near "slip to -x" "$(number back.json slip_length value)" "$(number mild.json slip_length value)" 1e-6

# ground where slip costs nothing: slip_length 0 of the preset is not contradicted
"$mild" press --ground grass --plate 0.2,0.1 --depth 0.02 --drag 0.02 --csv none.csv >/dev/null
"$mild" fit none.csv --plate 0.2,0.1 --hold-from grass --soil none.ini >/dev/null || fail "no slip"
grep -q '^slip_length = 0$' none.ini || fail "no slip: $(cat none.ini)"
near "mu, of which 1 % is drift resistance" "$(sed -n 's/^mu = //p' none.ini)" 0.7 2

# noise: several records, and intervals that hold the truth; of 24 one should not
missed=0 draws=12
short && draws=4
for seed in $(seq $draws); do
    for record in disc square drag; do noise "$seed${#record}" <$record.csv >n_$record.csv; done
    "$mild" press --ground ./truth.ini --plate 0.12 --depth 0.01 --drag 0.03 --csv other.csv >/dev/null
    noise 7"$seed" <other.csv >n_other.csv
    "$mild" fit n_disc.csv n_square.csv n_drag.csv n_other.csv --model mild_merged "${plates[@]}" --plate 0.12 --hold $known,mu=0.5 \
        --json noise.json >/dev/null || fail "noise $seed"
    near "slip_length, 5 % of noise" "$(number noise.json slip_length value)" 0.0025 6
    near "grip, 5 % of noise" "$(number noise.json grip value)" 0.14 6
    for pair in slip_length=0.0025 grip=0.14; do holds "${pair%=*}" noise.json "${pair#*=}" || missed=$((missed + 1)); done
done
echo "95 % intervals that miss the truth: $missed of $((2 * draws))"
[ $missed -le 4 ] || fail "$missed intervals of $((2 * draws)) miss the truth"

# a soil from it, which the program presses as the truth
"$mild" fit disc.csv square.csv drag.csv --model mild_merged "${plates[@]}" --soil soil.ini \
    --hold $known,mu=0.5,regain_length=0.0007,k_drift=0,b_drift=0,recovery=0 >/dev/null || fail "--soil"
grep -q '^# slides: residual' soil.ini && grep -q '^slip_length = 0.0025\|^slip_length = 0.00249' soil.ini || fail "the soil: $(cat soil.ini)"
for soil in truth soil; do "$mild" press --ground ./$soil.ini --plate 0.15,0.1 --depth 0.02 --drag 0.02 --csv $soil.csv >/dev/null; done
paste -d, truth.csv soil.csv | awk -F, 'NR > 1 { if ($3 > most) most = $3; d = $3 - $15; e = $9 - $21; if (d * d > w) w = d * d; if (e * e > w) w = e * e }
    END { exit !(most > 20 && sqrt(w) < 0.01 * most) }' || fail "the soil does not press as the truth"
bad "--soil mu regain_length" "$mild" fit disc.csv square.csv drag.csv --model mild_merged "${plates[@]}" --soil no.ini \
    --hold $known,k_drift=0,b_drift=0,recovery=0

# what does not help, or is wrong, in one line
"$mild" fit disc.csv square.csv drag.csv --model bekker "${plates[@]}" | grep -q '^left out: .* rows of slip; slip costs no support' || fail "bekker"
edit() { awk -F, -v OFS=, "$1" drag.csv >bad.csv; }
fit=("$mild" fit disc.csv bad.csv --plate 0.12 --plate 0.1,0.1 --model mild_merged)
edit 'NR > 1 { $9 = -$9 } { print }' && bad "bad.csv force_x_n" "${fit[@]}"
edit 'NR > 1 && $11 > 0 && $11 < 0.0299 { next } { print }' && bad "bad.csv slide 8" "${fit[@]}"
edit 'NR > 1 && $11 > 0 { $3 = -100 } { print }' && bad "bad.csv force_n" "${fit[@]}"
edit 'NR == 1 || $11 > 0' && bad "press" "$mild" fit bad.csv --plate 0.1,0.1 --model mild_merged
edit 'NR == 1 || $11 > 0' && "${fit[@]}" --hold $known | grep -q '^slip_length  *0.00[12]' || fail "a record that begins with the slip"
bad "slip_length press" "$mild" fit disc.csv --plate 0.12 --model mild_merged --hold slip_length=0.002
finish "slide: all as expected"
