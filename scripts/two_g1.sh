#!/usr/bin/env bash
# docs/two-g1.webp: Unitree's policy of the G1 and ours on loose sand, side by side, on Unitree's MJCF, commanded to walk at 0.5 m/s, without noise.
# Usage: two_g1.sh CLONES (scripts/public_policies.py --list) OUT.webp; PYTHON has the package mild, torch and pyopengl.
set -e
here=$(cd "$(dirname "$0")/.." && pwd)
gym=$1/unitree_rl_gym
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
film() {
    MUJOCO_GL=${MUJOCO_GL:-egl} "${PYTHON:-python3}" -m mild trial "$gym/resources/robots/g1_description/scene.xml" "$2" --describe "$here/examples/trial/$1.ini" \
        --ground sand_loose --trials 1 --seconds 7 --noise 0 --attach prints=256 --video "$work/$1.mp4"
}
film unitree_g1 "$gym/deploy/pre_train/g1/motion.pt"
film mild_g1 "$here/examples/trial/policies.py:G1"
font=$(find "$here/.venv" /usr/share/fonts -name DejaVuSans.ttf 2>/dev/null | head -1)
label() { echo "crop=540:540,scale=400:-1,drawtext=fontfile=$font:text='$1':x=12:y=12:fontsize=20:fontcolor=black"; }
ffmpeg -loglevel error -y -i "$work/unitree_g1.mp4" -i "$work/mild_g1.mp4" -filter_complex \
    "[0]$(label "Unitree"),tpad=stop_mode=clone:stop_duration=7[a];[1]$(label "ours")[b];[a][b]hstack=shortest=1,fps=15" \
    -loop 0 -quality 55 -compression_level 6 "$2"
