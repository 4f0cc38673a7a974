"""Soft ground in Newton (mild.newton): a stool of four legs sinks into each ground as deep as its weight on its soles. It needs
pip install newton[sim]; python newton_soft.py --ground sand_loose,foam45 --device cuda:0"""
import argparse
import pathlib

import newton
import numpy as np
import warp as wp

import mild.newton

STOOL = pathlib.Path(__file__).parents[1] / "soft_stool.xml"
FEET, DT = ("foot1", "foot2", "foot3", "foot4"), 0.005


def worlds(count, device):
    """A model with a stool in each world."""
    stool, scene = newton.ModelBuilder(), newton.ModelBuilder()
    for builder in (stool, scene):
        newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    stool.add_mjcf(str(STOOL))
    scene.replicate(stool, count)
    return scene.finalize(device=device)


def stand(grounds, count, device, seconds=6):
    model = worlds(count, device)
    solver = newton.solvers.SolverMuJoCo(model, skip_visual_only_geoms=False)  # soles that collide with nothing are geoms to stand on, too
    ground = mild.newton.attach(solver, feet=FEET, ground=grounds, dt=DT)
    here, there, control = model.state(), model.state(), model.control()
    place = here.joint_q.numpy().reshape(count, -1)
    place[:, 2] = 0.31  # [m] the soles at the ground
    here.joint_q.assign(place.ravel())

    def step():
        solver.step(here, there, control, None, DT)
        solver.step(there, here, control, None, DT)

    with wp.ScopedDevice(device):
        step()  # compiles Warp's kernels
        if cuda := wp.get_device().is_cuda:
            with wp.ScopedCapture() as capture:
                step()
        for k in range(steps := round(seconds / DT / 2)):
            solver.mjw_model.opt.gravity.fill_(wp.vec3(0, 0, -9.81 * min(1, 2 * k / steps)))  # the weight comes slowly
            wp.capture_launch(capture.graph) if cuda else step()
    return solver, ground


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ground", default="rubber,foam45,grass,sand_loose", type=lambda text: text.split(","))
    parser.add_argument("--worlds", type=int, default=8)
    parser.add_argument("--device", default="cpu")
    given = parser.parse_args()
    solver, ground = stand(given.ground, given.worlds, given.device)
    force, depth, load = ground.wrench.numpy()[:, :, 2], ground.foot.numpy()[:, :, 3], solver.mj_model.body_subtreemass[1] * 9.81
    for index, name in enumerate(given.ground):
        rows = ground.material.numpy() == index
        print(f"{name:>12s}: {rows.sum()} stools of {load:.1f} N, carried {force[rows].sum(1).mean():.1f} N, {1e3 * depth[rows].mean():.2f} mm deep; "
              f"that load on a sole: {1e3 * np.mean([one.sinkage(name, load / 4) for one in ground.soles]):.2f} mm")
