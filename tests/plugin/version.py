"""A leg falls on soft ground, with what integrators treat implicitly, under every integrator that all versions of MuJoCo have.
Usage: version.py PLUGIN [OTHER.json]; prints where it is after 0.4 s as JSON, or compares with another version's."""
import json
import sys

import mujoco

LEG = """<mujoco><option timestep="0.002" integrator="{integrator}"/><extension><plugin plugin="mild.ground"><instance name="soft">
<config key="feet" value="foot"/><config key="ground" value="{ground}"/></instance></plugin></extension>
<default><geom contype="0" conaffinity="0"/><joint axis="0 1 0"/></default>
<worldbody><body pos="0 0 0.6"><freejoint/><geom type="box" size=".1 .08 .05" mass="8"/>
<body pos="0 0 -.05"><joint name="hip" range="-90 90" {joint}/><geom type="capsule" fromto="0 0 0 .1 0 -.25" size=".03" mass=".8"/>
<body pos=".1 0 -.25"><joint name="knee" range="-2 {bend}" {joint}/><geom type="capsule" fromto="0 0 0 -.1 0 -.28" size=".025" mass=".4"/>
<body name="foot" pos="-.1 0 -.28"><joint name="ankle" range="-60 60" {joint}/><geom {sole} mass=".2"/></body></body></body></body>
</worldbody>{rest}</mujoco>"""
BOX = 'type="box" size=".11 .08 .01" pos=".02 0 -.03"'
VERTICES = " ".join(f"{x} {y} {z}" for x in (-0.11, 0.11) for y in (-0.08, 0.08) for z in (-0.01, 0.01))
MESH = f'<asset><mesh name="sole" vertex="{VERTICES}"/></asset><sensor><plugin plugin="mild.ground" instance="soft"/></sensor>'
PD = "<actuator>" + "".join(f'<position joint="{j}" kp="300" kv="10"/>' for j in ("hip", "knee", "ankle")) + "</actuator>"
CASES = {"damping": ('damping="4"', 120, ""), "PD": ('armature=".02"', 120, PD), "springs": ('stiffness="60"', 120, ""), "limit": ("", 60, ""),
         "friction": ('frictionloss="1" armature=".02"', 120, PD),
         "equality": ("", 120, '<equality><joint joint1="knee" joint2="hip" polycoef="0 -1 0 0 0"/></equality>'), "mesh": ("", 120, MESH)}


def fall(case, integrator, ground):
    joint, bend, rest = CASES[case]
    sole = 'type="mesh" mesh="sole" pos=".02 0 -.03"' if rest is MESH else BOX
    model = mujoco.MjModel.from_xml_string(
        LEG.format(integrator=integrator, ground=ground, joint=joint, bend=bend, sole=sole, rest=rest))
    data = mujoco.MjData(model)
    data.qpos[7:10] = -0.4, 0.9, -0.5
    data.qvel[0] = 0.3
    for _ in range(200):
        data.ctrl[:] = (-0.4, 0.9, -0.5)[: model.nu]
        mujoco.mj_step(model, data)
    return list(data.qpos)


def main():
    mujoco.mj_loadPluginLibrary(sys.argv[1])
    found = {f"{case} {integrator} {ground}": fall(case, integrator, ground) for case in CASES
             for integrator in ("Euler", "implicitfast", "implicit") for ground in ("rubber", "sand_loose")}
    if len(sys.argv) < 3:
        print(json.dumps(found))
        return
    with open(sys.argv[2], encoding="utf-8") as file:
        other = json.load(file)
    apart = {key: max(abs(a - b) for a, b in zip(found[key], other[key], strict=True)) for key in found}
    worst = max(apart, key=apart.get)
    print(f"MuJoCo {mujoco.__version__}: {len(apart)} falls, apart by {apart[worst]:.1e} at most ({worst})")
    assert len(apart) == len(other) and apart[worst] < 1e-6


main()
