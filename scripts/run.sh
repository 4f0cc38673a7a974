#!/usr/bin/env bash
# The tour of `make run`: watch the shipped policy walk, train one from scratch, compare both on one course.
set -euo pipefail
cd "$(dirname "$0")/.."
minutes=${MINUTES:-5}
mild=build/mild
shipped=policies/mild.safetensors
trained=runs/quick/policy.safetensors
course=(--ground rubber,foam45,sand_loose --speed 0.3,0.6 --trials 5 --seconds 20)

if ! [[ $minutes =~ ^[0-9]+(\.[0-9]+)?$ ]]; then
    echo "run: MINUTES=$minutes is not a number of minutes" >&2
    exit 2
fi
mkdir -p out runs

echo "1/3  The shipped policy walks from rubber over foam onto loose sand."
"$mild" play --policy "$shipped" --ground rubber,foam45,sand_loose --video out/walk.mp4 --pressure out/pressure.png

echo
echo "2/3  A policy of your own, from nothing, in $minutes minutes. Ctrl-C ends the training early and keeps what it has."
rm -rf runs/quick
set -m # the training is a job of its own: Ctrl-C reaches it alone, and this script goes on
"$mild" train --config configs/quick.ini --train.minutes="$minutes" --out runs/quick
set +m

echo
echo "3/3  Both policies on the same course."
"$mild" eval --policy "$shipped" "${course[@]}" --json out/shipped.json >out/shipped.txt
"$mild" eval --policy "$trained" "${course[@]}" --json out/trained.json >out/trained.txt
.venv/bin/python scripts/compare.py shipped=out/shipped.json trained=out/trained.json
echo
echo "Video out/walk.mp4, sole pressure out/pressure.png, training log runs/quick/log.csv, your policy $trained."
