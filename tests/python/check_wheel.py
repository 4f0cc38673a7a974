"""An installed wheel, from an empty folder (scripts/wheels.sh): its compiled files are those for this processor, and work."""
import pathlib
import sys

import gymnasium
import mujoco
import numpy as np

import mild
from mild import _mujoco, _processor

sole = mild.Sole.plate(0.2, 0.1)
curve = mild.press(mild.Material("sand_loose"), sole, depth=0.03)
assert curve.force.max() > 10

spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="foot"><freejoint/><geom type="box" size=".1 .1 .1" mass="9"/></body>'
                                 '</worldbody></mujoco>')
mild.attach(spec, "foot", sensor="feet")
model = spec.compile()
data = mujoco.MjData(model)
data.qpos[2] = 0.09
mujoco.mj_step(model, data)
assert data.sensor("feet").data[2] > 1, "the ground carries nothing"

envs = gymnasium.make_vec("mild/SA01-v0", num_envs=4, config="configs/quick.ini")
envs.reset(seed=1)
assert np.isfinite(envs.step(np.zeros(envs.action_space.shape, "f4"))[1]).all()

places = [pathlib.Path(module.__file__) for module in (mild._ground, sys.modules["mild._envs"])] + [_mujoco.FOLDER]
best = next((name for name in _processor.levels() if (_processor.HERE / name).is_dir()), "")
assert all(_processor.HERE / best in place.parents for place in places), places
assert not best or _processor.program().name == f"mild-{best}"
assert _processor.HERE.parent.name == "site-packages", "not of an installed wheel"
print(f"mild {mild.__version__}: {places[0].relative_to(_processor.HERE)}, {_processor.program().name}")
