"""A plate of 10 kg falls on loose sand: the ground under a simulator of one's own. python plate.py"""
import numpy as np

import mild

mass, side, dt = 10.0, (0.2, 0.1), 1e-3
sole = mild.Sole.plate(*side)
ground = mild.Ground([sole], mild.Material("sand_loose", mu=0.5), dt)

# What the engine knows of the plate: A = J M^-1 J^T, here of a free box whose centre is the ankle.
inertia = mass / 12 * np.array([side[1] ** 2, side[0] ** 2, side[0] ** 2 + side[1] ** 2])
ground.inverse_inertia[:] = np.diag(np.r_[np.full(3, 1 / mass), 1 / inertia])
ground.position[0] = [0, 0, 0.05]
twist = np.array([0.3, 0, 0, 0, 0, 0])  # [m/s, rad/s] it also slides

for step in range(400):
    ground.velocity[0] = twist
    ground.free_velocity[0] = twist + dt * np.array([0, 0, -9.81, 0, 0, 0])
    ground.solve()  # forces and the twist after the step
    ground.advance()  # the sand remembers
    twist = ground.new_velocity[0].copy()
    ground.position[0] += dt * twist[:3]
    if step % 50 == 49:
        print(f"{1e3 * (step + 1) * dt:4.0f} ms  height {1e3 * ground.position[0, 2]:6.2f} mm  "
              f"force {ground.force[0, 2]:7.2f} N  speed {twist[0]:5.2f} m/s")

print(f"pressed slowly it would sink {1e3 * sole.sinkage(ground.terrain.materials[0], 9.81 * mass):.2f} mm")

# The same ground in a press, and its parameters back from the record.
sand = ground.terrain.materials[0]
press = mild.press(sand, sole, depth=0.03)
X, y = mild.loading(press.time, press.depth, press.force)
fit = mild.GroundFit(plate=side, hold={"alpha": sand.alpha}).fit(X, y)
for name, state in fit.states_.items():
    if state == "fitted":
        low, high = fit.intervals_[name]
        print(f"{name} = {fit.parameters_[name]:.5g} ({low:.5g} .. {high:.5g}) {fit.units_[name]}")
