"""mild.attach: soft ground under an MjSpec. With MILD_PLUGIN, a file, also with the engine plugin."""
import copy
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import unittest
import unittest.mock

import mujoco
import numpy as np

import mild
from mild import _mujoco

PLATE = """<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
  <body name="plate" pos="0 0 0.02"><freejoint/>
    <geom type="box" size="0.1 0.05 0.01" mass="10" contype="0" conaffinity="0"/>
    <site name="under" pos="0 0 -0.01"/></body></worldbody></mujoco>"""
VIEWED = """
import contextlib, runpy, sys, threading, time, types
import mujoco

def draw():
    closed.wait()
    threading.Event().wait(0.3)
    print("window gone")

@contextlib.contextmanager
def launch_passive(model, data, **options):
    threading.Thread(target=draw, daemon=True).start()
    yield types.SimpleNamespace(cam=mujoco.MjvCamera(), sync=lambda: None)
    closed.set()

closed, time.sleep = threading.Event(), lambda seconds: None
mujoco.viewer = sys.modules["mujoco.viewer"] = types.SimpleNamespace(launch_passive=launch_passive)
sys.argv = sys.argv[1:]
sys.path.insert(0, sys.argv[0].rpartition("/")[0])
runpy.run_path(sys.argv[0])
"""
WALK = pathlib.Path(__file__).resolve().parents[2] / "examples/python/walk.py"
PLUGIN = os.environ.get("MILD_PLUGIN", "")


ROOT = pathlib.Path(__file__).resolve().parents[2]


class Versions(unittest.TestCase):
    def test_version(self):
        """mild.__version__ is that of CMakeLists.txt."""
        wanted = re.search(r"^project\(mild VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
        self.assertEqual(mild.__version__, wanted)

    def test_mujoco(self):
        """The plugin that is loaded is that of the MuJoCo in use; without one, one line names what there is and what to do."""
        with tempfile.TemporaryDirectory() as folder, unittest.mock.patch.object(_mujoco, "FOLDER", pathlib.Path(folder)):
            for version in ("3.9.0", "3.10.0", "4.0.0"):
                (pathlib.Path(folder) / version).mkdir()
                (pathlib.Path(folder) / version / "libmild_plugin.so").touch()
            for version in ("3.9.0", "4.0.0"):
                with unittest.mock.patch.object(mujoco, "mj_versionString", lambda: version):
                    self.assertEqual(_mujoco.folder("libmild_plugin.so", "plugin").name, version)
            for version in ("4.1.0", "3.11.0", "3.1.0"):
                with unittest.mock.patch.object(mujoco, "mj_versionString", lambda: version), unittest.mock.patch.dict(os.environ):
                    os.environ.pop("MILD_PLUGIN", None)
                    with self.assertRaisesRegex(RuntimeError, rf"^plugin: .* MuJoCo {version}, but for 3.9.0, 3.10.0, 4.0.0; "
                                                r"`pip install 'mujoco>=3.9.0,<=4.0.0'`[^\n]*$"):
                        mild.load_plugin()

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_own(self):
        """Without a name the package's own is loaded."""
        with unittest.mock.patch.dict(os.environ):
            os.environ.pop("MILD_PLUGIN")
            mild.load_plugin()
        self.assertEqual(_mujoco.versions("libmild_plugin.so"), [mujoco.__version__])

    def test_range(self):
        """The range of pyproject.toml is that of the headers that a wheel builds plugins with."""
        project = tomllib.loads((ROOT / "pyproject.toml").read_text())
        with tarfile.open(ROOT / "plugin/headers.tar.xz") as archive:
            found = {name.split("/")[0] for name in archive.getnames()}
        found = sorted(found, key=lambda version: [int(number) for number in version.split(".")])
        self.assertIn(f"mujoco>={found[0]},<={found[-1]}", project["project"]["dependencies"])
        self.assertIn("mujoco-core==" + found[-1], project["build-system"]["requires"])
        lines = (ROOT / "scripts/mujoco.txt").read_text().split()
        self.assertEqual([line.split("==")[1] for line in lines if "==" in line], found)


class Attach(unittest.TestCase):
    def test_arguments(self):
        spec = mujoco.MjSpec.from_string(PLATE)
        for arguments, name in ((("plate", ["plate"]), "spec"), ((spec, ["foot"]), "foot"), ((spec, []), "feet"),
                                ((spec, ["plate"] * 17), "feet: 17 of them and 0 in body"), ((spec, ["plate"] * 2), "'plate' and 'plate' are on one body, 'plate'"),
                                ((spec, ["plate", "under"]), "'plate' and 'under' are on one body, 'plate'"),
                                ((spec, ["left foot"]), "blanks"), ((spec, [5]), "feet: 5"),
                                ((spec, ["plate"], 3), "ground"), ((spec, ["plate"], [3]), "ground"),
                                *(((spec, ["plate"], wrong), "'snad'; nearest is 'sand_loose'") for wrong in ("snad", "grass, snad", ["grass", "snad"]))):
            with self.assertRaisesRegex((TypeError, ValueError), name):
                mild.attach(*arguments)
        for feet, body, name in (([], ["under"], "no body 'under'"), (["plate"], ["plate"], "body: 'plate' and 'plate'"),
                                 (["under"], "plate", "'under' and 'plate' are on one body"), ([], ["a b"], "body: 'a b'.*rename"),
                                 ([], ["plate"] * 17, "0 of them and 17 in body")):
            with self.assertRaisesRegex(ValueError, name):
                mild.attach(spec, feet, body=body)
        with self.assertRaisesRegex(RuntimeError, "no/such"):
            mild.attach(spec, "plate", library="no/such")
        with self.assertRaisesRegex(RuntimeError, "MuJoCo"):
            mild.attach(spec, "plate", library=__file__)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_library(self):
        """A file beside the program, by its name alone."""
        before = os.getcwd()
        try:
            os.chdir(os.path.dirname(PLUGIN))
            mild.attach(mujoco.MjSpec.from_string(PLATE), "plate", library=os.path.basename(PLUGIN))
        finally:
            os.chdir(before)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_floor(self):
        """On a rigid floor a foot is soft when attach excludes that pair, named as body or site, and rigid when it does not."""
        solid = PLATE.replace('contype="0" conaffinity="0"', "").replace(
            "<worldbody>", '<worldbody><geom type="plane" size="1 1 1"/>')
        heights = {}
        for foot, exclude in (("plate", True), ("under", True), ("plate", False)):
            spec = mujoco.MjSpec.from_string(solid)
            mild.attach(spec, foot, mild.Material("grass"), exclude=exclude, ground__k_pen=500)
            model = spec.compile()
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 1500)
            self.assertEqual((model.nexclude, data.ncon > 0), (exclude, not exclude))
            heights[foot, exclude] = data.qpos[2]
        depth = 0.01 - heights["plate", True]
        self.assertAlmostEqual(depth, fall(mild.Material("grass", k_pen=500)), delta=0.01 * depth)
        self.assertAlmostEqual(heights["under", True], heights["plate", True], delta=1e-9)
        self.assertGreater(heights["plate", False], 0.0095)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_body(self):
        """A plate as a body rests where it does as a foot, not on the rigid floor, on its side too, and the sensor has its row."""
        solid = PLATE.replace('0.1 0.05 0.01"', '0.117 0.078 0.01"').replace('contype="0" conaffinity="0"', "").replace(
            "<worldbody>", '<worldbody><geom type="plane" size="1 1 1"/>')
        depths = []
        for feet, body in (("plate", ()), ((), "plate"), ((), ["plate"])):
            spec = mujoco.MjSpec.from_string(solid)
            mild.attach(spec, feet, "foam45", body=body, sensor="felt", body_pitch=0.02)
            model = spec.compile()
            data = mujoco.MjData(model)
            if depths and isinstance(body, list):
                data.qpos[2:7] = 0.1, np.sqrt(0.5), np.sqrt(0.5), 0, 0
            mujoco.mj_step(model, data, 3000)
            self.assertAlmostEqual(data.sensor("felt").data.reshape(1, 12)[0, 2], 98.1, delta=0.5)
            depths.append(0.01 - data.qpos[2])
        self.assertAlmostEqual(depths[1], depths[0], delta=0.005 * depths[0])

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_floor_of_its_own(self):
        """A floor may be a body in the world, as mjlab has it; a box that is fixed there is no floor, and is touched as before."""
        solid = PLATE.replace('contype="0" conaffinity="0"', "").replace(
            "<worldbody>", '<worldbody><body name="scene"><body name="terrain"><geom type="plane" size="1 1 1"/></body>'
            '<body name="curb" pos="9 0 0"><geom type="box" size="1 1 1"/></body></body>')
        spec = mujoco.MjSpec.from_string(solid)
        mild.attach(spec, "plate", "foam45")
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 1500)
        self.assertEqual((model.nexclude, data.ncon), (2, 0))
        depth = 0.01 - data.qpos[2]
        self.assertAlmostEqual(depth, fall(mild.Material("foam45")), delta=0.01 * depth)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_surface(self):
        """The ground is drawn in place of planes of the floor, which still carry what is not soft; or the planes are."""
        floor = PLATE.replace("<worldbody>", '<worldbody><geom type="plane" size="1 1 1" rgba="1 0 0 1"/><body name="more"><geom type="plane" size="1 1 1"/>'
                                             '<geom type="box" size="1 1 1" pos="5 0 0"/></body><body name="ball" pos="0.5 0 0.1"><freejoint/>'
                                             '<geom type="sphere" size="0.1"/></body>')
        for surface in (True, False):
            spec = mujoco.MjSpec.from_string(floor)
            mild.attach(spec, ["plate"], surface=surface)
            model = spec.compile()
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 500)
            self.assertGreater(data.body("ball").xpos[2], 0.09)
            scene, planes, plates = mujoco.MjvScene(model, 5000), 0, 0
            mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, scene)
            for geom in scene.geoms[:scene.ngeom]:
                planes += geom.type == mujoco.mjtGeom.mjGEOM_PLANE
                plates += geom.type == mujoco.mjtGeom.mjGEOM_BOX and geom.category == mujoco.mjtCatBit.mjCAT_STATIC
            self.assertEqual((planes, plates > 2000), (0, True) if surface else (2, False))

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_running_ground(self):
        """mild.ground changes the ground by name, by keys and by a Material; what is wrong changes nothing."""
        spec = mujoco.MjSpec.from_string(PLATE)
        mild.attach(spec, ["plate"], "rubber")
        model = spec.compile()
        data = mujoco.MjData(model)
        ground = mild.ground(model, data)
        for given, keys in (("sand_loose", {}), (None, {"mu": 0.2}), (mild.Material("grass"), {"mu": 0.3})):
            ground.set(*[given] * (given is not None), **keys)
            self.assertEqual(ground.material().as_dict(), mild.Material(given or "sand_loose", **keys).as_dict())
        for wrong, error in (({"ground": "mud"}, ValueError), ({"mu": -1}, ValueError), ({"my": 1}, TypeError), ({"label": 1, "mu": 0.1}, ValueError),
                             ({"ground": "rigid"}, ValueError), ({"ground": mild.Material("dry_sand")}, ValueError)):
            with self.assertRaises(error, msg=str(wrong)):
                ground.set(**wrong)
        self.assertEqual(mild.ground(model, copy.copy(data), "ground").material().as_dict(), mild.Material("grass", mu=0.3).as_dict())
        bare = mujoco.MjModel.from_xml_string("<mujoco/>")
        for arguments, error, words in (((model, data, "other"), ValueError, "no mild.ground 'other'"), ((data, model), TypeError, "mujoco.MjModel"),
                                        ((spec.compile(), data), ValueError, "not one of this model"), ((bare, mujoco.MjData(bare)), ValueError, "no mild.ground")):
            with self.assertRaisesRegex(error, words):
                mild.ground(*arguments)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_load_plugin(self):
        """A model whose XML names the plugin."""
        mild.load_plugin()
        soft = PLATE.replace("<worldbody>", """<extension><plugin plugin="mild.ground"><instance name="ground">
            <config key="feet" value="plate"/></instance></plugin></extension><worldbody>""")
        self.assertEqual(mujoco.MjModel.from_xml_string(soft).nplugin, 1)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_walk(self):
        """examples/python/walk.py: the shipped policy goes at the commanded speed, in soft ground too. With --view it outlives the viewer's
        thread, which MuJoCo does not wait for and which needs a while after the window was closed."""
        for ground, command in (("rubber", ["-c", VIEWED, WALK, "rubber", "--view"]), ("grass", [WALK, "grass"])):
            said = subprocess.run([sys.executable, *command], check=True, capture_output=True, text=True).stdout
            way, seconds = map(float, re.fullmatch(rf"{ground}: (\S+) m in (\S+) s, upright\n", said.removeprefix("window gone\n")).groups())
            self.assertEqual(said.startswith("window gone"), "--view" in command)
            self.assertAlmostEqual(way / (seconds - 0.6), 0.6, delta=0.06, msg=said)  # 0.6 s: the first step

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_file(self):
        """A soil's file under a plate; its numbers are in the model, which outlives the file. In a list the plugin reads it."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "hard rubber.ini"
            mild.Material("rubber", k_pen=4000).save(path)
            spec = mujoco.MjSpec.from_string(PLATE)
            mild.attach(spec, ["plate"], path)
            path.unlink()
            model = spec.compile()
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 1500)
            wanted = fall(mild.Material("rubber", k_pen=4000))
            self.assertAlmostEqual(0.01 - data.qpos[2], wanted, delta=0.01 * wanted)
            path = path.with_name("hard.ini")
            mild.Material("rubber", k_pen=4000).save(path)
            for grounds, found in (([path, "grass"], wanted), (["grass", path], fall(mild.Material("grass")))):
                spec = mujoco.MjSpec.from_string(PLATE)
                mild.attach(spec, ["plate"], grounds, terrain__patches="stripes", terrain__patch_size=2)
                model = spec.compile()
                data = mujoco.MjData(model)
                data.qpos[0] = 1
                mujoco.mj_step(model, data, 1500)
                self.assertAlmostEqual(0.01 - data.qpos[2], found, delta=0.01 * found)
            spec = mujoco.MjSpec.from_string(PLATE)
            mild.attach(spec, ["plate"], [path, "grass"], terrain__patches="stripes")
            path.write_text("[ground]\npreset = rubbr\n")
            for wrong in (path, [path, "grass"]):
                with self.assertRaisesRegex(ValueError, "hard.ini:2: preset: .*'rubbr'.*'rubber'"):
                    mild.attach(spec, ["plate"], wrong)
            with self.assertRaisesRegex(ValueError, "hard.ini:2: preset: .*'rubbr'"):
                spec.compile()
            with self.assertRaisesRegex(ValueError, "without blanks"):
                mild.attach(mujoco.MjSpec.from_string(PLATE), ["plate"], [pathlib.Path(folder) / "a b.ini", "grass"])


def fall(material):
    """Depth at which the plate of PLATE rests."""
    ground = mild.Ground([mild.Sole([(-0.1, -0.05), (0.1, -0.05), (0.1, 0.05), (-0.1, 0.05)])], material, 0.002)
    ground.inverse_inertia[:] = np.diag([0.1] * 3 + [1000] * 3)
    ground.position[0, 2] = 0.01
    for _ in range(1500):
        ground.velocity[:] = ground.free_velocity[:] = ground.new_velocity
        ground.free_velocity[0, 2] -= 9.81 * ground.dt
        ground.solve()
        ground.advance()
        ground.position[0] += ground.new_velocity[0, :3] * ground.dt
    return -ground.position[0, 2]


if __name__ == "__main__":
    unittest.main()
