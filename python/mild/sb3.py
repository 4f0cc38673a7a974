"""Stable-Baselines3: a VecEnv over mild.gym.VectorEnv."""
import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from .gym import VectorEnv


class Env(VecEnv):
    """`num_envs` robots on soft ground (docs/task.md); arguments as those of mild.gym.VectorEnv.

    infos[i] of an environment that ended has "terminal_observation", "TimeLimit.truncated" and "reward_terms". Actions are
    clipped by Stable-Baselines3 to the space, which is what the task does too."""

    def __init__(self, num_envs=None, **keys):
        self.envs = VectorEnv(num_envs, **keys)
        self.render_mode = self.envs.render_mode
        super().__init__(self.envs.num_envs, self.envs.single_observation_space, self.envs.single_action_space)

    def reset(self):
        """Observations (num_envs, ...); with the seed of the last call of seed()."""
        observation, _ = self.envs.reset(seed=self._seeds[0])
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions):
        self._actions = actions

    def step_wait(self):
        """(observations, rewards, dones, infos)."""
        observation, reward, ended, truncated, info = self.envs.step(self._actions)
        infos = [{} for _ in range(self.num_envs)]
        done = ended | truncated
        for i in np.flatnonzero(done):
            terms = info["final_info"]["reward_terms"][i].tolist()
            infos[i] = {"terminal_observation": info["final_obs"][i], "TimeLimit.truncated": bool(truncated[i]),
                        "reward_terms": dict(zip(self.envs.reward_names, terms))}
        return observation, reward, done, infos

    def get_images(self):
        """A picture of each robot, with render_mode="rgb_array"."""
        return list(self.envs.render() or ())

    def close(self):
        self.envs.close()

    def get_attr(self, attr_name, indices=None):
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name, value, indices=None):
        raise NotImplementedError("set_attr: environments share everything; open them with other overrides")

    def env_method(self, method_name, *method_args, indices=None, **method_kwargs):
        raise NotImplementedError("env_method: environments are no objects of their own")

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * len(list(self._get_indices(indices)))
