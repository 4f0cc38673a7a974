#!/usr/bin/env bash
# Scripts with bad input: one line, exit 2. Usage: test_scripts.sh PATH_TO_MILD
root=$(cd "$(dirname "$0")/../.." && pwd)
source "$(dirname "$0")/../kit.sh" "$1"
python=$root/.venv/bin/python
[ -x "$python" ] || python=python3

bad "train_walk: usage: scripts/train_walk.sh FOLDER" "$root/scripts/train_walk.sh"
bad "train_walk: usage" "$root/scripts/train_walk.sh" a b
latent() { "$python" "$root/scripts/latent.py" "$@"; }
bad "latent.py: the following arguments are required: csv" latent
bad "latent.py: none.csv: cannot read: No such file" latent none.csv
bad "latent.py: .: cannot read: Is a directory" latent .
echo hello >foreign
bad "latent.py: foreign: has not the columns ground, trial, time_s, modulated0" latent foreign
bad "latent.py: .*mild.safetensors: .*give what mild eval --latent wrote" latent "$root/policies/mild.safetensors"
printf 'ground,trial,speed_m_s,time_s,modulated0\nrigid,0,0.6,3,x\n' >words
bad "latent.py: words: could not convert string to float: 'x'; give" latent words
printf 'ground,trial,speed_m_s,time_s,modulated0\nrigid,0,0.6,3\n' >short
bad "latent.py: short: .*; give what mild eval --latent wrote" latent short
printf 'ground,trial,speed_m_s,time_s,modulated0\nrigid,0,0.6,3,1\n' >one
bad "latent.py: one: trials are shorter than 2.8 s or fewer than 2" latent one
# its figures need what scripts/paper/requirements.txt names
"$python" -c 'import sklearn' 2>/dev/null && bad "paper.py: unknown experiment nosuch; there are table2 " "$python" -B "$root/scripts/paper/paper.py" nosuch
finish "scripts: bad input"
