"""mild.warp's ground in an environment of mjlab (mild.mjlab)."""
import dataclasses
import re

import torch
import warp as wp
from mjlab.sensor.contact_sensor import ContactData
from mjlab.sim.sim import _suspend_gc

from .warp import Ground


class SoftGround:
    """The ground under `env`, on its device. On a GPU it acts while mjlab's graph of a step is captured, and is part of it.

    wrench, shape, material: tensors that share the memory of mild.warp.Ground's wrench, foot and material. imprint: how deep each foot
    stood when it last touched the ground [m]."""

    def __init__(self, env, ground, feet, soles, entity="robot", sensor="feet_ground_contact", heights=None):
        """feet: names of sites, in the order of `sensor` and `heights`; soles have the frames of their bodies. soles: a regular
        expression of the geoms that they stand on."""
        self.env, self.sim, model, self.grounds = env, env.sim, env.sim.mj_model, tuple(ground)
        self.sites = [site_of(model, f"{entity}/{name}") for name in feet]
        self.ground = Ground(model, self.sim.wp_model, self.sim.wp_data, [model.body(model.site_bodyid[site]).name for site in self.sites],
                             list(ground), soles=f"{re.escape(entity)}/(?:{soles})", exclude=False, timestep=env.physics_dt)
        self.m, self.d, self.soles, self.round, self.radius = self.sim.wp_model, self.sim.wp_data, self.ground.soles, self.ground.round, self.ground.radius[0]
        self.wrench, self.shape, self.material = (wp.to_torch(a) for a in (self.ground.wrench, self.ground.foot, self.ground.material))
        self.step, self.reset, self.capture = self.sim.step, self.sim.reset, self.sim.create_graph
        self.sim.step, self.sim.reset, self.sim.create_graph = self.step_with, self.reset_with, self.capture_with
        self.imprint = torch.zeros_like(self.shape[..., 4])
        if sensor is not None:
            env.scene[sensor]._extract_sensor_data = self.sense
        if heights is not None:
            self.scan = env.scene[heights]._compute_data
            env.scene[heights]._compute_data = self.measure
        self.ground.step()  # compiles the kernels
        self.reset_with()
        self.capture_with()

    def step_with(self):
        if self.sim.use_cuda_graph:
            self.step()
        else:
            with wp.ScopedDevice(self.sim.wp_device), self.ground.acting():
                self.step()

    def capture_with(self):
        self.capture()  # mjlab's own graphs; those of forward and reset stay
        if self.sim.use_cuda_graph:
            with _suspend_gc(), wp.ScopedDevice(self.sim.wp_device), wp.ScopedCapture() as capture:
                self.ground.step()
            self.sim.step_graph = capture.graph

    def reset_with(self, worlds=None):
        self.reset(worlds)
        which = torch.zeros(self.env.num_envs, dtype=torch.uint8, device=self.env.device)
        which[slice(None) if worlds is None else worlds] = 1
        self.imprint = self.imprint.masked_fill(which.bool()[:, None], 0)
        stream = wp.stream_from_torch(torch.cuda.current_stream(which.device)) if which.is_cuda else None
        with wp.ScopedDevice(self.sim.wp_device), wp.ScopedStream(stream):
            self.ground.reset(wp.from_torch(which))

    def sense(self):
        """What mjlab's sensor of the feet's contacts reads: forces on the ground."""
        return ContactData(found=(self.shape[..., 5] > 0).float(), force=-self.wrench[..., :3])

    def measure(self):
        """What mjlab's sensor of the feet's heights reads: from the middle of the imprint. From the untouched ground a swing of 100 mm
        would be one of 230 mm where a foot stands 130 mm deep, more than the leg can; from the bottom it would not come out."""
        self.imprint = torch.where(self.shape[..., 5] > 0, self.shape[..., 4], self.imprint)
        return dataclasses.replace(self.scan(), heights=wp.to_torch(self.d.site_xpos)[:, self.sites, 2] + self.imprint / 2)


def site_of(model, name):
    try:
        return model.site(name).id
    except KeyError:
        raise ValueError(f"feet: the model has no site '{name}'") from None
