"""mild.newton.isaaclab in Isaac Lab's own G1 task, stepped by its manager; `make isaaclab-check` installs Isaac Lab without its simulator
and runs it on the CPU. On a GPU, where the manager captures its steps in a graph: check_isaaclab.py --device cuda:0 (mild's build must have CUDA, or
mild_cuda be there). Isaac Lab's files of robots and floors lie on its maker's server; a floor and robots/g1 as USD stand in their place."""
import argparse
import importlib.metadata
import os
import pathlib
import sys
import tempfile
import unittest

FOLDER = tempfile.TemporaryDirectory()
os.environ["ISAACSIM_ASSET_ROOT"] = FOLDER.name  # read when isaaclab is imported

import gymnasium  # noqa: E402
import isaaclab_tasks  # noqa: E402, F401
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import torch  # noqa: E402
from isaaclab.managers import EventTermCfg  # noqa: E402
from isaaclab_newton.physics import NewtonManager  # noqa: E402
from isaaclab_rl.rsl_rl import RslRlVecEnvWrapper, create_rsl_rl_runner, handle_deprecated_rsl_rl_cfg  # noqa: E402
from isaaclab_tasks.core.velocity.config.g1.agents.rsl_rl_ppo_cfg import G1FlatPPORunnerCfg  # noqa: E402
from isaaclab_tasks.core.velocity.config.g1.flat_env_cfg import G1FlatEnvCfg  # noqa: E402
from pxr import Gf, Usd, UsdGeom, UsdPhysics  # noqa: E402

import mild  # noqa: E402
import mild.newton  # noqa: E402

DEVICE, SOILS, WORLDS = "cpu", ["sand_loose", "foam45"], 4
FEET = ["left_ankle_roll_link", "right_ankle_roll_link"]
ASSETS = pathlib.Path(FOLDER.name) / "Isaac/IsaacLab"


def stage_of(path, root):
    path.parent.mkdir(parents=True)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, root).GetPrim())
    return stage


def write_floor(path):
    stage = stage_of(path, "/floor")
    plane = UsdGeom.Plane.Define(stage, "/floor/plane")
    plane.CreateAxisAttr("Z")
    UsdPhysics.CollisionAPI.Apply(plane.GetPrim())
    stage.Save()


def place(prim, position, quaternion, scale=None):
    xform = UsdGeom.Xformable(prim)
    xform.AddTranslateOp().Set(Gf.Vec3d(*map(float, position)))
    xform.AddOrientOp().Set(turned(quaternion))
    if scale is not None:
        xform.AddScaleOp().Set(Gf.Vec3f(*map(float, scale)))


def turned(quaternion):
    return Gf.Quatf(*map(float, quaternion))


def write_g1(path):
    """robots/g1: its bodies side by side under the robot, as in Isaac Lab's own files. Soles are boxes; of the rest the trunk collides alone."""
    model = mujoco.MjModel.from_xml_path(str(pathlib.Path(__file__).parents[2] / "robots/g1/g1.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    stage = stage_of(path, "/g1")
    UsdPhysics.ArticulationRootAPI.Apply(stage.GetPrimAtPath("/g1"))
    for body in range(1, model.nbody):
        name = model.body(body).name
        prim = UsdGeom.Xform.Define(stage, f"/g1/{name}").GetPrim()
        place(prim, data.xpos[body], data.xquat[body])
        UsdPhysics.RigidBodyAPI.Apply(prim)
        mass = UsdPhysics.MassAPI.Apply(prim)
        mass.CreateMassAttr(float(model.body_mass[body]))
        mass.CreateCenterOfMassAttr(Gf.Vec3f(*map(float, model.body_ipos[body])))
        mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*map(float, model.body_inertia[body])))
        mass.CreatePrincipalAxesAttr(turned(model.body_iquat[body]))
        for geom in range(model.ngeom):
            if model.geom_bodyid[geom] == body and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX and name in FEET:
                shape = UsdGeom.Cube.Define(stage, f"/g1/{name}/sole")  # of size 2
                place(shape, model.geom_pos[geom], model.geom_quat[geom], model.geom_size[geom])
                UsdPhysics.CollisionAPI.Apply(shape.GetPrim())
        if name == "pelvis":
            shape = UsdGeom.Sphere.Define(stage, "/g1/pelvis/ball")
            shape.CreateRadiusAttr(0.07)
            UsdPhysics.CollisionAPI.Apply(shape.GetPrim())
            continue
        index = model.body_jntadr[body]
        joint = UsdPhysics.RevoluteJoint.Define(stage, f"/g1/joints/{model.joint(index).name}")
        joint.CreateBody0Rel().SetTargets([f"/g1/{model.body(model.body_parentid[body]).name}"])
        joint.CreateBody1Rel().SetTargets([f"/g1/{name}"])
        joint.CreateAxisAttr("XYZ"[int(np.argmax(model.jnt_axis[index]))])
        joint.CreateLocalPos0Attr(Gf.Vec3f(*map(float, model.body_pos[body])))
        joint.CreateLocalRot0Attr(turned(model.body_quat[body]))
        joint.CreateLocalPos1Attr(Gf.Vec3f(0))
        joint.CreateLocalRot1Attr(Gf.Quatf(1))
        low, high = np.degrees(model.jnt_range[index])
        joint.CreateLowerLimitAttr(float(low))
        joint.CreateUpperLimitAttr(float(high))
        UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "angular")
    stage.Save()


def task():
    """Isaac-Velocity-Flat-G1 as it is, less what its robot has and ours has not: arms, fingers, a waist; and less pictures from the server."""
    cfg = G1FlatEnvCfg()
    cfg.sim.physics, cfg.sim.device, cfg.scene.num_envs = cfg.sim.physics.newton_mjwarp, DEVICE, WORLDS
    cfg.scene.sky_light = cfg.scene.terrain.visual_material = None
    cfg.commands.base_velocity.debug_vis = False
    cfg.rewards.joint_deviation_fingers = cfg.rewards.joint_deviation_arms = cfg.rewards.joint_deviation_torso = None
    robot, legs = cfg.scene.robot, cfg.scene.robot.actuators["legs"]
    robot.init_state.joint_pos = {name: at for name, at in robot.init_state.joint_pos.items() if "hip" in name or "knee" in name or "ankle" in name}
    robot.actuators = {"legs": legs, "feet": robot.actuators["feet"]}
    legs.joint_names_expr = [name for name in legs.joint_names_expr if name != "torso_joint"]
    for numbers in (legs.stiffness, legs.damping, legs.armature):
        numbers.pop("torso_joint")
    for params in (cfg.events.add_base_mass.params["asset_cfg"], cfg.events.base_external_force_torque.params["asset_cfg"],
                   cfg.terminations.base_contact.params["sensor_cfg"]):
        params.body_names = "pelvis"
    cfg.events.reset_base.params["velocity_range"] = {}  # so that all begin alike
    cfg.events.ground = EventTermCfg(func=mild.newton.isaaclab, mode="startup", params={"feet": FEET, "ground": SOILS})
    return cfg


class IsaacLab(unittest.TestCase):
    def test_task(self):
        write_floor(ASSETS / "Environments/Grid/default_ground_plane_checker_v1/default_ground_plane.usda")
        write_g1(ASSETS / "Robots/Unitree/G1/g1_minimal.usd")
        env = gymnasium.make("Isaac-Velocity-Flat-G1", cfg=task())
        inside, ground = env.unwrapped, NewtonManager._solver.soft_ground
        self.assertFalse(NewtonManager._solver.mjw_model.opt.run_collision_detection)  # its contacts are Newton's
        still = torch.zeros(WORLDS, env.action_space.shape[-1], device=DEVICE)
        env.reset()
        env.step(still)
        first = ground.foot.numpy().copy()
        self.assertEqual(NewtonManager._graph is not None, DEVICE != "cpu")  # on a GPU these steps are launches of a graph
        for _ in range(20):
            env.step(still)
        weight = 9.81 * ground.m.body_mass.numpy().sum(1)
        load, depth = ground.wrench.numpy()[:, :, 2].sum(1), ground.foot.numpy()[:, :, 4]
        for world in range(WORLDS):
            print(f"{SOILS[world % 2]:10s} {load[world]:.1f} N of {weight[world]:.1f} N, feet {1e3 * depth[world].mean():.1f} mm deep")
        np.testing.assert_allclose(load[::2], weight[::2], rtol=0.02)  # foam swings for longer
        np.testing.assert_allclose(load[1::2], weight[1::2], rtol=0.3)
        self.assertGreater(depth[::2].min(), 0.04)
        self.assertGreater(depth[::2].min(), 1.2 * depth[1::2].max())
        sensor = inside.scene["contact_forces"]
        self.assertEqual(float(sensor.data.net_forces_w.torch[:, sensor.find_sensors(FEET)[0]].abs().max()), 0)  # of the floor, which they have left
        inside.reset(env_ids=torch.tensor([0], device=DEVICE))
        env.step(still)
        fresh = ground.foot.numpy()
        np.testing.assert_allclose(fresh[0, :, 4], first[0, :, 4], rtol=0.01)
        self.assertGreater(fresh[2, :, 4].min(), 1.2 * fresh[0, :, 4].max())  # a world that went on
        agent = handle_deprecated_rsl_rl_cfg(G1FlatPPORunnerCfg(device=DEVICE), importlib.metadata.version("rsl-rl-lib"))
        runner = create_rsl_rl_runner(RslRlVecEnvWrapper(env), agent, log_dir=None)
        runner.learn(2)
        actor = runner.alg.save()["actor_state_dict"]
        self.assertTrue(all(bool(values.isfinite().all()) for values in actor.values()))
        self.assertTrue(np.isfinite(ground.wrench.numpy()).all())
        env.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu")
    given, rest = parser.parse_known_args()
    DEVICE = given.device
    unittest.main(argv=[sys.argv[0], *rest])
