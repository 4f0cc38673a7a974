"""Pictures of the environments' robots, by MuJoCo's renderer."""
import os

import numpy as np

from ._stand import _paint

SIZE = (640, 480)  # [pixels]


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
