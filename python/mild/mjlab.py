"""mjlab's velocity tasks on soft ground: `train Mjlab-Velocity-Soft-Unitree-Go1`, after `pip install mildground[mjlab]` (docs/python.md).

mjlab imports this module by itself. Robots of one environment stand on GROUNDS in turn; other grounds are a parameter of the event:
--env.events.ground.params.ground "('foam45', 'sand_loose')". A task of your own becomes soft by `soften`. What was trained is judged by `mild trial`,
which wants the robot and a description of what the policy sees and does: python -m mild.mjlab Mjlab-Velocity-Soft-Unitree-Go1 --out go1"""
import argparse
import dataclasses
import pathlib
import shutil
import warnings

import torch
from mjlab.managers.curriculum_manager import CurriculumTermCfg
from mjlab.managers.event_manager import EventTermCfg
from mjlab.scene import Scene
from mjlab.tasks.registry import list_tasks, load_env_cfg, register_mjlab_task
from mjlab.tasks.velocity.config.g1.env_cfgs import unitree_g1_flat_env_cfg
from mjlab.tasks.velocity.config.g1.rl_cfg import unitree_g1_ppo_runner_cfg
from mjlab.tasks.velocity.config.go1.env_cfgs import unitree_go1_flat_env_cfg
from mjlab.tasks.velocity.config.go1.rl_cfg import unitree_go1_ppo_runner_cfg
from mjlab.tasks.velocity.rl import VelocityOnPolicyRunner

from ._mjlab_ground import SoftGround

GROUNDS = ("rubber", "grass", "sand_dense", "foam45", "sand_loose")  # as a biped learns them
LOW = r".*_(foot|calf|shin)\d*_collision\d*"  # what sinks in and so must not touch mjlab's floor
ROBOTS = {"Go1": (unitree_go1_flat_env_cfg, unitree_go1_ppo_runner_cfg, ("FR", "FL", "RR", "RL")),
          "G1": (unitree_g1_flat_env_cfg, unitree_g1_ppo_runner_cfg, ("left_foot", "right_foot"))}


def lay(env, env_ids, **keys):
    """The event: puts a SoftGround under the environment, once, as `env.soft_ground`."""
    if hasattr(env, "soft_ground"):
        raise RuntimeError("ground: the environment has soft ground already; the event's mode must be 'startup'")
    env.soft_ground = SoftGround(env, **keys)


def soften(config, feet, ground=GROUNDS, soles=r".*_foot\d*_collision", low=LOW, entity="robot", sensor="feet_ground_contact", heights="foot_height_scan",
           grounds=None):
    """Puts soft ground into a ManagerBasedRlEnvCfg on level ground, and returns it.

    feet: sites of the feet, in the order of `sensor`, mjlab's sensor of their contacts, which then has the ground's forces (None: no
    sensor), and of `heights`, its sensor of their heights, which then counts from the middle of the imprint in which a foot last stood
    (None: no sensor). ground: presets or files of soils, a list or a text with commas; the robots take them in turn. soles: regular expression of the geoms on which
    a foot stands, one sphere or capsules. low: of all geoms that leave the floor's collisions (its bit is 1) and keep the robot's own."""
    if grounds is not None:
        warnings.warn("soften: grounds is named ground now", DeprecationWarning, stacklevel=2)
        ground = grounds
    parts = config.scene.entities[entity]
    parts.collisions = tuple(dataclasses.replace(c, contype={low: 2, ".*": 1}, conaffinity={low: 2, ".*": 3}) for c in parts.collisions)
    config.events["ground"] = EventTermCfg(func=lay, mode="startup", params={
        "ground": tuple(ground.split(",") if isinstance(ground, str) else ground), "feet": tuple(feet), "soles": soles, "entity": entity, "sensor": sensor, "heights": heights})
    return config


def ground_levels(env, env_ids):
    """A curriculum as mjlab's of terrains. A robot begins on the first ground; 8 s on its feet bring it to the next one, a fall within 1.5 s
    back, and beyond the last one it stands on any. Pushes grow from nothing to the task's as the mean level does. Returns that mean."""
    soft, now, ids = env.soft_ground, env.common_step_counter, slice(None) if env_ids is None else env_ids
    push = env.event_manager.get_term_cfg("push_robot").params["velocity_range"] if "push_robot" in env.cfg.events else {}
    if not hasattr(soft, "level"):
        soft.level, soft.pushes = torch.zeros_like(soft.material), dict(push)
        soft.began = torch.zeros(env.num_envs, dtype=torch.long, device=env.device)
    lasted, count = (now - soft.began[ids]) * env.step_dt, len(soft.grounds)
    level = (soft.level[ids] + (lasted > 8).int() - (lasted < 1.5).int()).clamp(0, count)
    soft.level[ids], soft.began[ids] = level, now
    soft.material[ids] = torch.where(level < count, level, torch.randint_like(level, count))
    mean = soft.level.float().mean()
    push.update({axis: (float(mean) / count * low, float(mean) / count * high) for axis, (low, high) in soft.pushes.items()})
    return mean


def config_of(robot, play=False, ground=GROUNDS):
    """mjlab's task of "Go1" or "G1" on level ground, softened. The weight of the speed is doubled, because steps out of deep imprints cost
    posture and smoothness: at mjlab's own weight a robot that stands on sand loses nothing. The G1 goes from ground to ground (ground_levels)."""
    make, _, feet = ROBOTS[robot]
    config = soften(make(play=play), feet, ground)
    config.rewards["track_linear_velocity"].weight *= 2
    if robot == "G1" and not play:
        config.curriculum["ground_levels"] = CurriculumTermCfg(func=ground_levels)
    return config


# mjlab's terms of the actor, and ours (mild trial --keys).
TERMS = {"base_lin_vel": "linear_velocity", "base_ang_vel": "angular_velocity", "projected_gravity": "gravity", "joint_pos": "joint_position",
         "joint_vel": "joint_velocity", "actions": "action", "command": "command"}


def describe(config, frame):
    """The text of a description for mild.trial (docs/public-policies.md) of what a policy of this velocity task sees and does.
    frame: the site of its inertial sensors."""
    terms, action = config.observations["actor"].terms, config.actions["joint_pos"]
    for name, term in terms.items():
        if name not in TERMS:
            raise ValueError(f"describe: the actor's term '{name}' is none of {', '.join(TERMS)}")
        if term.history_length or not isinstance(term.scale, (type(None), int, float)):
            raise ValueError(f"describe: the actor's term '{name}' has a history, or a scale that is not one number")
    scale = action.scale if isinstance(action.scale, dict) else {".*": action.scale}
    lines = ["[policy]", "layout = mjlab", f"frame = {frame}", f"step = {config.sim.mujoco.timestep:g}", f"decimation = {config.decimation}",
             "[observation]", *(f"{TERMS[name]} = {1 if term.scale is None else term.scale:g}" for name, term in terms.items()),
             "[actuator]", "kind = model", "[scale]", *(f"robot/{name} = {value:.9g}" for name, value in scale.items()),
             "[default]", ".* = 0", *(f"robot/{name} = {value:.9g}" for name, value in config.scene.entities["robot"].init_state.joint_pos.items())]
    return "\n".join(lines) + "\n"


def export(task, folder):
    """Writes scene.xml, with the meshes that it needs, and policy.ini of a task into a new folder."""
    folder = pathlib.Path(folder)
    if folder.exists():
        raise ValueError(f"{folder} exists; name another folder")
    robot = task.rpartition("-")[2]  # the floor of mild.trial is touched by all that touches mjlab's rigid one
    config = ROBOTS[robot][0]() if task == f"Mjlab-Velocity-Soft-Unitree-{robot}" and robot in ROBOTS else load_env_cfg(task)
    scene = Scene(config.scene, device="cpu")
    text = describe(config, scene.spec.sensor("robot/imu_ang_vel").objname)
    scene.write(folder)
    robot = scene.entities["robot"].spec  # mjlab 1.6 leaves out the meshes of robots that it reads from files
    for mesh in robot.meshes:
        source, target = pathlib.Path(robot.modelfiledir, robot.meshdir, mesh.file), folder / "assets" / mesh.file
        if source.is_file() and not target.exists():
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(source, target)
    (folder / "policy.ini").write_text(f"; {task} of mjlab\n{text}")


def main():
    import mjlab.tasks  # noqa: F401 (fills the registry)

    parser = argparse.ArgumentParser(prog="python -m mild.mjlab", description="Writes scene.xml and policy.ini of a velocity task of mjlab, for mild trial.")
    parser.add_argument("task", choices=list_tasks(), metavar="TASK")
    parser.add_argument("--out", required=True, help="a new folder")
    given = parser.parse_args()
    try:
        export(given.task, given.out)
    except ValueError as error:
        parser.error(str(error))
    print(f"mild trial {given.out}/scene.xml POLICY.onnx --describe {given.out}/policy.ini")


def agent_of(robot):
    """mjlab's learner for the robot, with a folder of its own and TensorBoard, which needs no account; --agent.logger wandb. The G1's updates are
    twice as large and come after 16 steps in place of 24: with mjlab's 0.01 it stands still for the first 45 M steps (docs/python.md)."""
    config = ROBOTS[robot][1]()
    if robot == "G1":
        config.algorithm.desired_kl, config.num_steps_per_env = 0.02, 16
    config.logger, config.experiment_name = "tensorboard", config.experiment_name + "_soft"
    return config


for _robot in ROBOTS if __name__ != "__main__" else ():
    register_mjlab_task(task_id=f"Mjlab-Velocity-Soft-Unitree-{_robot}", env_cfg=config_of(_robot), play_env_cfg=config_of(_robot, play=True),
                        rl_cfg=agent_of(_robot), runner_cls=VelocityOnPolicyRunner)


if __name__ == "__main__":
    from mild import mjlab as _named  # the registered module, not this second copy of it
    _named.main()
