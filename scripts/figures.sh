#!/usr/bin/env bash
# Draws the figures of docs/ again: figures.sh [presets] [recovery] [impact] [sinkage] [eccentric] [terrain] [walk]
# [robots] [run] [jump] [steps] [rise] [actuator] [motion] [patchwork]; without a name all. The drawings are scripts/drawings.py's.
set -euo pipefail
cd "$(dirname "$0")/.."
mild=build/mild
work=out/figures
python=.venv/bin/python
[ -x "$python" ] || python=python3
mkdir -p "$work"

# record NAME OPTIONS...: records a press to $work/NAME.csv
record() {
    local name=$1
    shift
    "$mild" press "$@" --csv "$work/$name.csv" >/dev/null
}

presets() {
    "$mild" info grounds >"$work/grounds.txt"
    for ground in rubber foam60 foam45 foam28 foam25 grass sand_loose sand_dense; do
        record "$ground" --ground "$ground" --plate sole --depth 0.06 --speed 0.001
    done
    local bed=(--ground.bed_depth=1)
    record softest --ground sand_loose --plate sole --depth 0.06 --speed 0.001 "${bed[@]}" \
        --ground.k_pen=8 --ground.sigma_cone=0.01e6 --ground.alpha=0.698 --ground.nu=2.4
    record hardest --ground sand_loose --plate sole --depth 0.06 --speed 0.001 "${bed[@]}" \
        --ground.k_pen=1400 --ground.sigma_cone=0.24e6 --ground.alpha=1.310 --ground.nu=0.8
}

recovery() {
    for share in 1 0.5 0; do
        record "recovery_$share" --ground sand_loose --plate 0.2,0.1 --depth 0.015,0.003,0.025 --speed 0.001 \
            --ground.recovery=$share
    done
}

# A flat, straight ground (kappa = k_pen, u_f = 1.6 m, drag without inertia) obeys Katsuragi and Durian's equation with
# d1 = M/(n c_d m_a') = 0.0105 m and k = n k_pen = 2000 N/m; sand's drag ends where its cones are complete.
impact() {
    for speed in 0.5 1 2; do
        record "flat_$speed" --ground sand_loose --plate 0.0975,0.0975 --impact $speed --mass 0.5 --step 2e-5 --seconds 0.2 \
            --ground.alpha=1.5 --ground.nu=0.1 --ground.k_pen=80 --ground.sigma_cone=14882.6 --ground.c_d=100 \
            --ground.c_g=1 --ground.phi=0.5 --ground.bed_depth=1
        record "sand_$speed" --ground sand_loose --plate 0.2,0.1 --impact $speed --mass 5 --step 2e-5 --seconds 0.4
    done
}

# A plate of 11 x 7 elements tilted front edge down, under every model.
eccentric() {
    for model in mild con_cone con_spring ecc_spring ecc_quasi ecc_quasi_3d; do
        for tilt in 0 1 2 3 4 6 8 10 12 14 17 20; do
            record "${model}_$tilt" --ground sand_loose --model "$model" --plate 0.2145,0.1365 --depth 0.02 --speed 0.001 \
                --tilt $tilt
        done
    done
}

# still VIDEO PICTURE FILTER: frames of a video as a picture of 256 colours, a third of the size of one with all
still() {
    ffmpeg -loglevel error -y -i "$1" -frames:v 1 -vsync 0 \
        -filter_complex "$3,split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=sierra2_4a" "$2"
}

# The first part of `make run`: six moments of the walk, and the sole pressure.
walk() {
    "$mild" play --ground rubber,foam45,sand_loose --video "$work/walk.mp4" --pressure docs/pressure.png
    rm docs/pressure.csv
    still "$work/walk.mp4" docs/walk.png \
        "select='eq(n,40)+eq(n,109)+eq(n,150)+eq(n,205)+eq(n,255)+eq(n,300)',scale=640:-1:flags=area,tile=3x2"
}

# The README's moving picture: a walk of seven seconds over rubber, foam and sand, then the G1 runs on sand; imprints, sole pressures.
motion() {
    local picture=(--terrain.memory=true --width 1280 --height 720 --video)
    "$mild" play --ground rubber,foam45,sand_loose --patch 1.6 --speed 0.7 --seconds 8 "${picture[@]}" "$work/motion.mp4"
    "$mild" play --robot g1 --policy policies/g1_run.safetensors --ground sand_loose --speed 2.8 --seconds 6 "${picture[@]}" "$work/sand.mp4"
    ffmpeg -loglevel error -y -ss 1 -t 7 -i "$work/motion.mp4" -ss 2 -t 3.4 -i "$work/sand.mp4" \
        -filter_complex "[0][1]concat,scale=640:-1:flags=area" -c:v libwebp_anim -loop 0 -q:v 45 -compression_level 4 docs/walk.webp
}

# The other robots, a moment of each.
robots() {
    "$mild" play --robot go1 --config configs/go1.ini --policy policies/go1.safetensors --ground grass --seconds 4 --video "$work/go1.mp4"
    "$mild" play --robot g1 --config configs/g1.ini --policy policies/g1.safetensors --ground sand_loose --seconds 4 --video "$work/g1.mp4"
    ffmpeg -loglevel error -y -i "$work/go1.mp4" -i "$work/g1.mp4" -filter_complex \
        "[0]select='eq(n,70)',setpts=0[a];[1]select='eq(n,72)',setpts=0[b];[a][b]hstack" -frames:v 1 "$work/robots.mkv"
    still "$work/robots.mkv" docs/robots.png "scale=1280:-1:flags=area"
}

# The Go1 rights itself on loose sand: six moments.
rise() {
    "$mild" play --robot go1 --policy policies/go1_rise.safetensors --ground sand_loose --speed 0 --seconds 4 \
        --task.start=back --task.may_lie=true --video "$work/rise.mp4"
    still "$work/rise.mp4" docs/rise.png \
        "select='eq(n,24)+eq(n,29)+eq(n,33)+eq(n,36)+eq(n,42)+eq(n,90)',scale=480:-1:flags=area,tile=3x2"
}

# The G1 runs on grass: three moments.
run() {
    "$mild" play --robot g1 --policy policies/g1_run.safetensors --ground grass --speed 2.8 --seconds 5 --video "$work/run.mp4"
    still "$work/run.mp4" docs/run.png "select='eq(n,90)+eq(n,92)+eq(n,94)',scale=480:-1:flags=area,tile=3x1"
}

# The G1 jumps on loose sand: four moments.
jump() {
    "$mild" play --robot g1 --policy policies/g1_jump.safetensors --ground sand_loose --speed 0 --jump 0.4 --seconds 2.6 \
        --video "$work/jump.mp4"
    still "$work/jump.mp4" docs/jump.png "select='eq(n,38)+eq(n,41)+eq(n,47)+eq(n,54)',crop=iw/2:ih:iw/4:0,scale=320:-1:flags=area,tile=4x1"
}

# The G1 climbs steps of loose sand: three moments.
steps() {
    "$mild" play --robot g1 --policy policies/g1_steps.safetensors --ground sand_loose --speed 0.5 --seconds 5 --terrain.kind=steps \
        --terrain.wavelength=1.4 --terrain.amplitude=0.15 --video "$work/steps.mp4"
    still "$work/steps.mp4" docs/steps.png "select='eq(n,53)+eq(n,66)+eq(n,79)',scale=480:-1:flags=area,tile=3x1"
}

# A robot among its imprints on waves of two materials, after five seconds.
terrain() {
    "$mild" play --ground sand_dense,sand_loose --speed 0.5 --seconds 5.2 --video "$work/terrain.mp4" \
        --terrain.kind=waves --terrain.amplitude=0.04 --terrain.wavelength=1.6 --terrain.memory=true \
        --terrain.patches=checker --terrain.patch_size=1.2 --terrain.border=0.3
    still "$work/terrain.mp4" docs/terrain.png "select='eq(n,125)'"
}

# 4096 robots on a patchwork of eight soils.
patchwork() {
    "$mild" play --envs 4096 --ground rubber,foam60,foam45,foam28,foam25,grass,sand_loose,sand_dense --terrain.patches=checker \
        --terrain.patch_size=3 --seconds 7 --video "$work/patchwork.mp4"
    ffmpeg -loglevel error -y -i "$work/patchwork.mp4" -vf "fps=8,scale=560:-1:flags=area" -c:v libwebp_anim -loop 0 -q:v 30 \
        -compression_level 6 docs/patchwork.webp
}

# Torques of a held-out second: a made-up motor, the network fitted to it, the best PD.
actuator() {
    "$mild" actuator log --out "$work/motor.csv"
    "$mild" actuator fit "$work/motor.csv" --out "$work/motor.safetensors" --spacing 0.005 --figure "$work/actuator.png"
    cp "$work/actuator.png" docs/actuator.png
}

for name in "${@:-all}"; do
    case $name in
    presets | recovery | impact | eccentric) "$name" && "$python" scripts/curves.py "$name" "$work" "docs/$name.png" ;;
    terrain | walk | robots | run | jump | steps | rise | actuator | motion | patchwork) "$name" ;;
    sinkage) presets && "$python" scripts/curves.py sinkage "$work" docs/sinkage.png ;;
    all) for each in presets recovery impact sinkage eccentric terrain walk robots run jump steps rise actuator motion patchwork; do "$0" "$each"; done ;;
    *) echo "figures: unknown figure '$name'; choose from presets recovery impact sinkage eccentric terrain walk robots run jump steps rise actuator motion patchwork" >&2 && exit 2 ;;
    esac
done
