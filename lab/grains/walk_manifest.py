"""What a walk was made by: OUT/.../made.json beside what came out of it, and the same in OUT/walks.json."""
import hashlib
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def first_line(*command):
    """What a command says first, or None."""
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    except OSError:
        return None
    return done.stdout.strip().split("\n")[0] if done.returncode == 0 and done.stdout.strip() else None


def in_repository(word):
    """A word of a command as it is typed in the repository's root."""
    return os.path.relpath(word, ROOT) if os.path.isabs(str(word)) and str(word).startswith(f"{ROOT}/") else str(word)


def write(folder, words, args, on_grains):
    """Before a walk: its command, policy, seeds, commit and devices."""
    policy = pathlib.Path(args.policy)
    commit, changed = first_line("git", "rev-parse", "HEAD"), first_line("git", "status", "--porcelain", "--untracked-files=no")
    gpu = first_line("nvidia-smi", "--query-gpu=name", "--format=csv,noheader") if on_grains else None
    made = {"command": [in_repository(word) for word in words], "policy": in_repository(policy.resolve()),
            "policy_sha256": hashlib.sha256(policy.read_bytes()).hexdigest() if policy.is_file() else None, "robot": args.robot, "seed": args.seed,
            "bed_seed": args.bed_seed if on_grains else None, "commit": commit and commit + (" and changes" if changed else ""),
            "gpu": gpu, "cores": os.cpu_count()}
    (folder / "made.json").write_text(json.dumps(made, indent=1) + "\n")


def read(folder):
    """Of a walk; {} where it was made before this was written."""
    file = folder / "made.json"
    return {"made": json.loads(file.read_text())} if file.exists() else {}
