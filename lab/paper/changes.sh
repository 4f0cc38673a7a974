# shellcheck shell=bash
# Sourced by latent.sh, modulation.sh and deviations.sh: trainings by configs/models.ini on one GPU, half a minute each, with one change at a time.
# The script that sources it has change[NAME], options of a training, and measure RUN STEM, which writes STEM.RESULT of a finished
# run; it measures on the processor while the next one trains.
here=$(dirname "$0")
mild=${MILD:-build/mild}
config=$here/../../configs/models.ini
declare -A change

# train_changes FOLDER SEEDS RESULT [NAME ...]: FOLDER/NAME-SEED.RESULT of each, of all without a NAME. What is there is kept. SEEDS: how
# many, or FIRST-LAST.
train_changes() {
    local out=$1 seeds=$2 result=$3 seed name run
    shift 3
    [[ $seeds == *-* ]] || seeds=1-$seeds
    local names=("$@")
    [ $# -gt 0 ] || mapfile -t names < <(printf '%s\n' "${!change[@]}" | sort)
    for name in "${names[@]}"; do
        [ -n "${change[$name]+set}" ] || { echo "$(basename "$0"): unknown change '$name'; choose from ${!change[*]}" >&2; exit 2; }
    done
    runs=$(mktemp -d)
    trap 'wait; rm -rf "$runs"' EXIT
    mkdir -p "$out"
    for seed in $(seq "${seeds%-*}" "${seeds#*-}"); do
        for name in "${names[@]}"; do
            [ -e "$out/$name-$seed.$result" ] && continue
            run=$runs/$name-$seed
            # shellcheck disable=SC2086 # several options
            "$mild" train --config "$config" --out "$run" --train.seed="$seed" ${change[$name]} >"$runs/log" 2>&1 ||
                { cat "$runs/log" >&2; exit 1; }
            echo "$name-$seed $(tail -1 "$runs/log")"
            cp "$run/log.csv" "$out/$name-$seed.csv"
            cp "$run/config.ini" "$out/$name-$seed.ini"
            measure "$run" "$out/$name-$seed" &
        done
    done
}
