"""Gymnasium: gymnasium.make_vec("mild/SA01-v0", num_envs=...) and gymnasium.make("mild/SA01-v0"); G1 and Go1 likewise."""
import collections.abc
import os
import pathlib
import tempfile
import weakref

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from ._stand import _paint
from .envs import open_envs

OBSERVATIONS = ("history", "frame")
PERIOD = 0.01  # [s] policy step
SIZE = (640, 480)  # [pixels] of a picture
ROBOTS = {"SA01": {}, "G1": {"config": "configs/g1.ini"}, "Go1": {"config": "configs/go1.ini"}}  # what each is opened with


def register():
    """Registers mild/SA01-v0, mild/G1-v0 and mild/Go1-v0. `import mild` does it."""
    for name, keys in ROBOTS.items():
        if f"mild/{name}-v0" not in gymnasium.registry:
            gymnasium.register(f"mild/{name}-v0", entry_point="mild.gym:Env", vector_entry_point="mild.gym:VectorEnv", kwargs=keys)


class Camera:
    """Draws robots of one MJCF on a level floor in the colour of a ground, the first of several, into which soles sink out of sight."""

    def __init__(self, path, ground, size=SIZE):
        if not os.environ.get("DISPLAY"):
            os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo reads it once, when it is imported
        try:
            import mujoco
        except ImportError:
            raise ImportError("render_mode: drawing needs MuJoCo; pip install mujoco") from None

        self.mujoco, spec = mujoco, mujoco.MjSpec.from_file(path)
        spec.worldbody.add_geom(name="floor_of_picture", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05])
        _paint(spec, ground)
        spec.stat.extent = 2.5  # by which the reach of shadows is chosen
        spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.3] * 3, [0.25] * 3
        spec.visual.headlight.specular = [0] * 3
        for light in list(spec.lights):
            spec.delete(light)
        spec.worldbody.add_light(pos=[1.5, -1.5, 4], dir=[-0.35, 0.4, -0.85], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, diffuse=[0.6] * 3,
                                 specular=[0.2] * 3)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        screen = self.model.vis.global_
        screen.offwidth, screen.offheight = max(size[0], screen.offwidth), max(size[1], screen.offheight)
        try:
            self.renderer = mujoco.Renderer(self.model, size[1], size[0])
        except (ImportError, RuntimeError, AttributeError) as error:
            raise RuntimeError(f"render_mode: MuJoCo cannot draw: {error}; set MUJOCO_GL=egl before Python starts, "
                               "and `pip install pyopengl`") from None
        self.view = mujoco.MjvCamera()
        self.view.azimuth, self.view.elevation = 130, -15

    def picture(self, qpos):
        """(height, width, 3) uint8."""
        self.data.qpos[:] = qpos
        self.mujoco.mj_kinematics(self.model, self.data)
        self.mujoco.mj_camlight(self.model, self.data)
        self.view.lookat[:] = qpos[0], qpos[1], 0.7 * qpos[2]
        self.view.distance = 1.3 + 1.9 * max(qpos[2], 0.2)
        self.renderer.update_scene(self.data, self.view)
        return np.array(self.renderer.render())

    def close(self):
        self.renderer.close()


def ground_keys(ground, folder):
    """The keys of a task on these grounds alone, as they are: "rigid"; a preset, a soil's file or a Material; or a list of these three.
    folder: where a Material is written."""
    from . import Material

    if isinstance(ground, str) and ground == "rigid":
        return {"randomize.rigid_share": 1, "randomize.preset_share": 0, "randomize.patch_share": 0}
    names, models = [], []
    for k, one in enumerate(ground if isinstance(ground, (list, tuple)) else [ground]):
        if not isinstance(one, (str, os.PathLike, Material)):
            raise TypeError(f"ground: a {type(one).__name__}, but it must be 'rigid', a preset, a soil's file or a Material, or a list of the "
                            "latter three")
        if isinstance(one, str) and one == "rigid":
            raise ValueError("ground: 'rigid' is the engine's own contact; it stands alone")
        material = Material(one)
        models.append(material.model)
        if isinstance(one, Material):
            one = pathlib.Path(folder) / f"ground{k}.ini"
            material.save(one)
        names.append(os.fspath(one))
        if "," in names[-1]:
            raise ValueError(f"ground: {names[-1]!r} has a comma, which separates grounds; move the file, or give mild.Material of it")
    whole = sorted(set(models) & {"con_cone", "con_spring"})  # one element under a sole
    if not names or (whole and len(set(models)) > 1):
        raise ValueError(f"ground: {' and '.join(sorted(set(models)))} in one task; name grounds of one model" if names else
                         "ground: an empty list")
    return {"randomize.rigid_share": 0, "randomize.preset_share": 1, "randomize.preset_jitter": 0, "randomize.patch_share": 0,
            "randomize.slip_share": 0, "randomize.presets": ",".join(names), "randomize.model": whole[0] if whole else "own"}


class _Task:
    """What both kinds of environment share: opening, seeding, steps into new arrays, which C fills, and pictures."""

    def _open(self, num_envs, observation, render_mode, ground, max_episode_steps, keys):
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode: {render_mode!r} is none of None, {', '.join(map(repr, self.metadata['render_modes']))}; "
                             "gymnasium.wrappers.HumanRendering makes a window of 'rgb_array', and so does `mild play`")
        self.render_mode, self._ground, self._camera, self._folder = render_mode, ground, None, None
        keys = dict(keys)
        own = {}
        if ground is not None:
            self._folder = tempfile.TemporaryDirectory()  # of Materials, which each seed reads again
            weakref.finalize(self, self._folder.cleanup)
            own.update(ground_keys(ground, self._folder.name))
        if max_episode_steps is not None:
            own["task.episode"] = PERIOD * int(max_episode_steps)
        given = keys.get("overrides")
        if own and isinstance(given, (collections.abc.Mapping, type(None))):
            for key in set(own) & set(given or {}):
                raise ValueError(f"overrides: {key} is what {'max_episode_steps' if key == 'task.episode' else 'ground'} sets; leave one out")
            keys["overrides"] = {**own, **(given or {})}
        if observation not in OBSERVATIONS:
            raise ValueError(f"observation: '{observation}' is none of {', '.join(OBSERVATIONS)}")
        self._envs, self._count, self._observation, self._keys = None, num_envs, observation, keys
        self._seed(int(self.np_random.integers(2**63)))
        shape = self._envs
        self._count = shape.envs
        width = shape.observation * (shape.frames if observation == "history" else 1)
        high = np.full(width, np.inf, np.float32)
        clip = np.full(shape.actions, shape.clip, np.float32)
        self._single = gymnasium.spaces.Box(-high, high), gymnasium.spaces.Box(-clip, clip)

    def _seed(self, seed):
        opened = open_envs(self._count, seed=seed, **self._keys)
        if opened.device >= 0:
            opened.close()
            raise ValueError("train.device: Gymnasium's environments have arrays of NumPy; set device='cpu'")
        self._shut()
        self._envs = opened

    def _arrays(self):
        """New arrays for the results of a step."""
        shape, rows = self._envs, self._count
        arrays = {"history": np.empty((rows, shape.frames, shape.observation), np.float32),
                  "reward": np.empty(rows, np.float32),
                  "last": np.empty((rows, shape.frames, shape.observation), np.float32),
                  "terms": np.empty((rows, shape.rewards), np.float32)}
        arrays.update((name, np.empty(rows, np.bool_)) for name in ("done", "timeout", "valid"))
        return arrays

    def _seen(self, history):
        """The observation in a history: all of it in a row, or its newest frame; a view."""
        return history.reshape(self._count, -1) if self._observation == "history" else history[:, -1]

    def _begin(self, seed):
        if self._envs is None:
            raise RuntimeError("reset: the environment is closed")
        if seed is not None:
            if not (isinstance(seed, (int, np.integer)) and 0 <= seed < 2**64):
                raise ValueError(f"seed: {seed!r}, but it must be a whole number of 0 .. 2^64 - 1")
            self._seed(int(seed))
        arrays = self._arrays()
        self._envs.reset(self._envs.buffers(**arrays))
        return self._seen(arrays["history"])

    def _act(self, action):
        if self._envs is None:
            raise RuntimeError("step: the environment is closed")
        arrays = self._arrays()
        self._envs.step(action, self._envs.buffers(**arrays))
        return arrays

    def _pictures(self, count):
        if self.render_mode is None:
            gymnasium.logger.warn("render() without a render_mode draws nothing; make(..., render_mode='rgb_array')")
            return None
        if self._envs is None:
            raise RuntimeError("render: the environment is closed")
        poses = [self._envs.pose(i) for i in range(count)]
        if self._camera is None:
            ground = self._ground[0] if isinstance(self._ground, (list, tuple)) else self._ground
            self._camera = Camera(self._envs.model, os.fspath(ground) if isinstance(ground, (str, os.PathLike)) else "")
        return tuple(self._camera.picture(pose) for pose in poses)

    def _shut(self):
        if self._envs is not None:
            self._envs.close()
            self._envs = None

    def _end(self):
        self._shut()
        if self._camera is not None:
            self._camera.close()
            self._camera = None
        if self._folder is not None:
            self._folder.cleanup()


class VectorEnv(gymnasium.vector.VectorEnv, _Task):
    """`num_envs` robots on soft ground (docs/task.md); None: as many as the config's train.envs. (Gymnasium's make_vec gives a
    number, 1 by default.)

    observation: "history", (num_envs, frames * observation) float32, oldest numbers first, or "frame", the newest only;
    noisy, as the policy sees it. Actions: (num_envs, actions) float32 in units of the action scale; ValueError for one that
    is not finite. config, overrides, robot, device, threads: see mild.envs.open_envs; device: cpu, with train.robots=mujoco.
    ground: these grounds alone, as they are, in the place of those that the config draws: "rigid"; a preset, a soil's file
    (docs/soil.md) or a Material; or a list of these three. max_episode_steps: the longest episode (task.episode, 2000 steps).
    render_mode: None or "rgb_array" (robots are seen on a level floor, whatever the terrain). The seed is Gymnasium's, reset(seed=), never the config's train.seed.

    Every step returns new arrays, into which the library writes without a copy. Environments that ended begin anew in the
    same step (SAME_STEP): the observation is the first of the new episode, info["final_obs"] (num_envs, ...) has the last of
    the old one where info["_final_obs"] and else 0, and info["final_info"] the sums of the reward's terms over it,
    "reward_terms" (num_envs, terms), in the order of `reward_names`, and whether it ended because a number was not finite, "diverged". The first episodes are shorter than the later ones, so that they do not
    end together. One seed stands for all environments."""

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": ["rgb_array"], "render_fps": 100}

    def __init__(self, num_envs=None, *, observation="history", render_mode=None, ground=None, max_episode_steps=None, **keys):
        self._open(num_envs, observation, render_mode, ground, max_episode_steps, keys)
        self.num_envs = num_envs = self._count
        self.single_observation_space, self.single_action_space = self._single
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, num_envs)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, num_envs)
        self.reward_names = self._envs.reward_names

    def reset(self, *, seed=None, options=None):
        """New episodes. seed: a whole number, from which all environments draw differently; without it they draw on, and what was drawn for a start from which no step was taken is drawn again. options: must be empty."""
        if options:
            raise ValueError(f"options: {', '.join(options)}: there are none; environments reset themselves (SAME_STEP)")
        observation = self._begin(seed)
        super().reset(seed=None if seed is None else int(seed))
        return observation, {}

    def step(self, actions):
        """(observations, rewards, terminations, truncations, infos); see the class."""
        arrays = self._act(np.ascontiguousarray(actions, np.float32))
        done, truncated = arrays["done"], arrays["timeout"]
        return self._seen(arrays["history"]), arrays["reward"], done & ~truncated, truncated, self._info(arrays, done)

    def _info(self, arrays, done):
        if not done.any():
            return {}
        for name in ("terms", "last"):  # where no episode ended the library writes nothing
            arrays[name][~done] = 0
        final = {"reward_terms": arrays["terms"], "_reward_terms": done, "diverged": done & ~arrays["valid"], "_diverged": done}
        return {"final_obs": self._seen(arrays["last"]), "_final_obs": done, "final_info": final, "_final_info": done}

    def statistics(self):
        """Means over the episodes that ended since the last call: a dict, see EnvsStats of src/env/envs_step.h."""
        if self._envs is None:
            raise RuntimeError("statistics: the environment is closed")
        return self._envs.statistics()

    def render(self):
        """A picture of each robot, (height, width, 3) uint8, in a tuple; None without a render_mode."""
        return self._pictures(self.num_envs)

    def close_extras(self, **kwargs):
        self._end()


class Env(gymnasium.Env, _Task):
    """One robot; arguments and spaces as those of VectorEnv; one thread, unless `threads` says otherwise.
    info["reward_terms"] of the last step of an episode are the sums of the reward's terms over it."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 100}

    def __init__(self, *, observation="history", render_mode=None, ground=None, max_episode_steps=None, **keys):
        self._ended = False
        self._open(1, observation, render_mode, ground, max_episode_steps, {"threads": 1, **keys})
        self.observation_space, self.action_space = self._single

    def reset(self, *, seed=None, options=None):
        """A new episode. seed: a whole number. options: must be empty or None."""
        super().reset(seed=None if seed is None else int(seed))
        self._ended = False
        return self._begin(seed)[0], {}

    def step(self, action):
        """(observation, reward, terminated, truncated, info). Raises RuntimeError after the end of an episode."""
        if self._ended:
            raise RuntimeError("step: the episode has ended; call reset()")
        action = np.ascontiguousarray(action, np.float32)
        if action.shape != self.action_space.shape:
            raise ValueError(f"action: shape {action.shape}, but it must be {self.action_space.shape}")
        arrays = self._act(action[None])
        self._ended, truncated = bool(arrays["done"][0]), bool(arrays["timeout"][0])
        info = {}
        if self._ended:
            info = {"reward_terms": dict(zip(self._envs.reward_names, arrays["terms"][0].tolist()))}
        seen = self._seen(arrays["last" if self._ended else "history"])[0]
        return seen, float(arrays["reward"][0]), self._ended and not truncated, truncated, info

    def render(self):
        """The robot on a floor in the ground's colour, (height, width, 3) uint8; None without a render_mode. After the end of an episode
        it is the beginning of the next."""
        pictures = self._pictures(1)
        return None if pictures is None else pictures[0]

    def close(self):
        self._end()
