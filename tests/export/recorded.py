"""What `mild eval --actions` recorded, as arrays: for the tests of all that runs a policy elsewhere."""

import csv

import numpy as np


class Trial:
    """Rows of one trial in time: arrays [steps, width]."""

    def __init__(self, names, rows):
        def columns(prefix, suffix=""):
            wanted = [i for i, name in enumerate(names) if name.startswith(prefix) and name.endswith(suffix)]
            return np.array([[float(row[i]) for i in wanted] for row in rows])

        self.command = columns("command_")
        self.phase = columns("phase")[:, 0]
        self.quaternion = columns("quaternion_")
        self.omega = columns("omega_")
        self.angle = columns("angle_", "_rad")
        self.speed = columns("speed_", "_rad_s")
        self.observation = columns("observation").astype(np.float32)
        self.action = columns("action_").astype(np.float32)
        w, x, y, z = self.quaternion.T  # the third row of the rotation, downward
        self.gravity = -np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)


def trials(path):
    """The trials of a file with one ground and one speed."""
    with open(path, newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    numbers = sorted({int(row[0]) for row in rows})
    return [Trial(names, [row for row in rows if int(row[0]) == k]) for k in numbers]
