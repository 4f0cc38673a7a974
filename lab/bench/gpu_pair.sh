#!/usr/bin/env bash
# Is a build as fast on a GPU as another, and are its results the same? Runs both in turns on one device: `mild bench batch` and
# `robots`, then a short training whose parameters must be the same to the bit.
# Usage: lab/bench/gpu_pair.sh OLD/build/mild NEW/build/mild [ROUNDS]
set -euo pipefail
old=$(realpath "$1") new=$(realpath "$2") rounds=${3:-5}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset MILD_HOME # each program reads the configs of its own tree

for bench in batch robots; do
    for ((round = 0; round < rounds; round++)); do
        for which in old new; do
            (cd "$(dirname "${!which}")/.." && "${!which}" bench "$bench" --train.device=cuda --json - >"$work/$bench.$which.$round")
        done
    done
done
python3 - "$work" "$rounds" <<'END'
import json, pathlib, statistics, sys
work, rounds = pathlib.Path(sys.argv[1]), int(sys.argv[2])
def rows(bench, which, turn):
    text = (work / f"{bench}.{which}.{turn}").read_text()
    return {row["case"]: (row["value"], row["unit"]) for row in json.loads(text[text.index("{"):text.rindex("}") + 1])["rows"]}
for bench in ("batch", "robots"):
    pairs = [(rows(bench, "old", t), rows(bench, "new", t)) for t in range(rounds)]
    for case, (value, unit) in pairs[0][0].items():
        ratios = [n[case][0] / o[case][0] for o, n in pairs if case in n and o[case][0]]
        if ratios:
            print(f"{bench:7} {case:32} {value:12.5g} {unit:8} new/old {statistics.median(ratios):.3f}")
END

for which in old new; do
    (cd "$(dirname "${!which}")/.." && "${!which}" train --out "$work/$which" --train.device=cuda --train.robots=batch --train.envs=48 \
        --train.minutes=0 --train.iterations=5 >"$work/$which.log" 2>&1) || { tail -3 "$work/$which.log"; exit 1; }
    (cd "$work/$which" && sha256sum policy.safetensors)
done
cmp "$work/old/policy.safetensors" "$work/new/policy.safetensors" && echo "the same policy to the bit"
