"""The policy in numpy (examples/python/policy.py) against what `mild eval` saw and did, and against faults that it must not
survive. Usage: test_policy.py SOURCE_FOLDER POLICY EXACT.csv NOISY.csv OTHER OTHER.csv, of eval --actions without and with noise and
delay, and of another policy, whose modulation sees the clock in the place of its actor."""

import pathlib
import sys

import recorded

TOLERANCE = 1e-5
source, policy, exact, noisy, other, moved = pathlib.Path(sys.argv[1]), *sys.argv[2:]
text = (source / "examples/python/policy.py").read_text(encoding="utf-8")
page = (source / "docs/policy.md").read_text(encoding="utf-8")

# what would go unnoticed in a port of one's own: text of the program, and what is there instead
FAULTS = [
    ("heads[:n], heads[n : (n + len(heads)) // 2]", "heads[32:], heads[16:32]", "action"),  # order of the heads
    ("heads[n : (n + len(heads)) // 2]", "heads[(n + len(heads)) // 2 :]", "action"),
    ("theta[:half] * mu + theta[half:]", "mu", "action"),  # no modulation
    ("theta[:half] * mu + theta[half:]", "theta[half:] * mu + theta[:half]", "action"),
    ("[estimates[3:], frame[-2:]]", "[estimates, frame[-2:]]", "action"),
    ('.weight"] @ x', '.weight"].T.reshape(self.tensors[f"{name}.{i}.weight"].shape) @ x', "action"),  # transposed weights
    ("np.expm1(np.minimum(x, 0))", "0", "action"),  # ReLU
    ("np.expm1(np.minimum(x, 0))", "0.01 * x", "action"),
    ("x if i == layers[-1] else", "", "action"),  # an activation behind the last layer
    ("[means.ravel(), frame]", "[frame, means.ravel()]", "action"),
    ("means.ravel()", "means[::-1].ravel()", "action"),  # newest mean first
    (".reshape(5, self.stride, -1).mean(axis=1)", ".reshape(5, self.stride, -1)[:, -1]", "action"),  # frames, not their means
    ("np.vstack([self.frames[1:], frame])", "np.vstack([frame, self.frames[:-1]])", "action"),
    ("np.tile(frame,", "np.tile(0 * frame,", "action"),
    ("[frame, estimates, z]", "[frame, z, estimates]", "action"),
    ("[2, 2, 1]", "[1, 1, 1]", "observation"),
    ("0.05 * qd", "qd", "observation"),
    ("q - self.pose", "q", "observation"),
    ("0] * 2)", "0.1] * 2)", "observation"),
    ("self.last, clock", "0 * self.last, clock", "observation"),
    ("np.sin(turn), np.cos(turn)", "np.cos(turn), np.sin(turn)", "observation"),
    ("0.01 / (self.period", "0.02 / (self.period", "observation"),
    ("self.slowing * slow", "0 * slow", "observation"),  # the clock of a fast command
    ("[0.5, 1.5, 1]", "[1, 3, 1]", "observation"),  # the frame's command for the command
    ("< 0.1)", "< 1)", "observation"),
    ("1]), gravity,", "1]), -gravity,", "observation"),
]


def worst(program, trials, own, path=policy):
    """Largest error of the actions, and of the observations where the program makes its own (bool own)."""
    names = {}
    exec(compile(program, "policy.py", "exec"), names)  # the program under test, or one with a fault
    action = observation = 0.0
    for trial in trials:
        runner = names["Policy"](path)
        runner.phase = trial.phase[0]
        for k in range(len(trial.action)):
            frame = trial.observation[k]
            if own:
                made = runner.observe(trial.omega[k], trial.gravity[k], trial.command[k], trial.angle[k], trial.speed[k])
                observation = max(observation, abs(made - frame).max())
            action = max(action, abs(runner.act(frame) - trial.action[k]).max())
    return {"action": action, "observation": observation}


def check_shapes():
    """The table of tensors on the page."""
    names = {}
    exec(compile(text, "policy.py", "exec"), names)
    tensors, _ = names["read"](policy)
    for net in "encoder", "modulation", "actor":
        weights = [name for name in tensors if name.startswith(net) and name.endswith("weight")]
        places = f"`{net}.0 " + " ".join("." + name.split(".")[1] for name in weights[1:]) + "`"
        shapes = " ".join(str(list(tensors[name].shape)) for name in weights)
        assert f"| {places} | {shapes} |" in page, f"docs/policy.md does not say {places} | {shapes}"


def main():
    walked, walked_noisy = recorded.trials(exact), recorded.trials(noisy)
    found = worst(text, walked, True)
    found_noisy = worst(text, walked_noisy, False)
    print(f"actions {found['action']:.1e}, with noise {found_noisy['action']:.1e}; observations {found['observation']:.1e}")
    assert max(*found.values(), found_noisy["action"]) < TOLERANCE
    check_shapes()
    least = {"action": 1e9, "observation": 1e9}
    for old, new, what in FAULTS:
        assert text.count(old) == 1, f"'{old}' is not once in the program"
        error = worst(text.replace(old, new), walked[:1], True)[what]
        assert error > 100 * TOLERANCE, f"a fault is not noticed: '{new}' for '{old}': {error:.1e}"
        least[what] = min(least[what], error)
    modulated = recorded.trials(moved)
    error = worst(text, modulated, True, other)["action"]
    unseen = worst(text.replace("frame[-2:]", "0 * frame[-2:]"), modulated, True, other)["action"]
    print(f"a modulation with the clock: {error:.1e}, without it {unseen:.1e}")
    assert error < TOLERANCE < 0.01 * unseen
    print(f"{len(FAULTS)} faults noticed, the least by {least['action']:.1e} and {least['observation']:.1e}")


main()
