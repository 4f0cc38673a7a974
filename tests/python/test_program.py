"""The program from Python, and which copy of the compiled files a processor gets."""
import contextlib
import importlib
import io
import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest
import unittest.mock

from mild import _processor, envs, trials

V2 = {"cx16", "lahf_lm", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"}
V3 = V2 | {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}  # the ABI's list, by Linux's names
V4 = V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
main = importlib.import_module("mild.__main__")


def on(flags, wanted=None):
    """A processor that has these flags."""
    stack = contextlib.ExitStack()
    stack.enter_context(unittest.mock.patch.object(_processor, "flags", lambda: set(flags)))
    stack.enter_context(unittest.mock.patch.dict(os.environ, {"MILD_PROCESSOR": wanted} if wanted else {}))
    if not wanted:
        os.environ.pop("MILD_PROCESSOR", None)
    return stack


class Processor(unittest.TestCase):
    def test_levels(self):
        for flags, wanted, levels in ((V4, None, ["x86-64-v4", "x86-64-v3", "x86-64-v2"]), (V3, None, ["x86-64-v3", "x86-64-v2"]),
                                      (V4 - {"avx512vl"}, None, ["x86-64-v3", "x86-64-v2"]), (V4 - {"avx2"}, None, ["x86-64-v2"]),
                                      (set(), None, ["x86-64-v3", "x86-64-v2"]), ({"fp"}, None, []),
                                      (V4, "x86-64-v3", ["x86-64-v3", "x86-64-v2"]), (set(), "x86-64-v2", ["x86-64-v2"]),
                                      (V4, "cuda", ["x86-64-v4", "x86-64-v3", "x86-64-v2"]), (set(), "cuda", ["x86-64-v3", "x86-64-v2"]),
                                      (V3, "x86-64-v4", ["x86-64-v3", "x86-64-v2"])):
            with on(flags, wanted):
                self.assertEqual(_processor.levels(), levels)
        with on(V4, "x86-64-v5"), self.assertRaisesRegex(ImportError, "^MILD_PROCESSOR: 'x86-64-v5' is none of x86-64-v2, x86-64-v3, x86-64-v4, cuda$"):
            _processor.levels()

    @unittest.skipUnless(pathlib.Path("/lib64/ld-linux-x86-64.so.2").exists(), "another system")
    def test_this_one(self):
        """What glibc says of this processor."""
        text = subprocess.run(["/lib64/ld-linux-x86-64.so.2", "--help"], capture_output=True, text=True).stdout
        with unittest.mock.patch.dict(os.environ):
            os.environ.pop("MILD_PROCESSOR", None)
            for name in _processor.LEVELS:
                self.assertEqual(name in _processor.levels(), f"{name} (supported" in text, name)

    def test_files(self):
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.object(_processor, "HERE", pathlib.Path(name)):
            here = pathlib.Path(name)
            with on(V4):  # a build tree without the program
                self.assertEqual((_processor.folder(), _processor.program()), (here, None))
            (here / "data/bin").mkdir(parents=True)
            (here / "x86-64-v4").mkdir()
            for level in ("x86-64-v3", "x86-64-v4"):
                (here / f"data/bin/mild-{level}").touch(mode=0o755)
            for flags, place, level in ((V4, here / "x86-64-v4", "x86-64-v4"), (V3, here, "x86-64-v3")):
                with on(flags):
                    self.assertEqual((_processor.folder(), _processor.program().name), (place, f"mild-{level}"))
            with on(V2), self.assertRaisesRegex(ImportError, r"AVX2 .*MARCH=x86-64-v2 make wheel$"):
                _processor.folder()


    def test_gpu(self):
        """The package mild_cuda beside this one, where there is a driver or it is asked for, and of the same version."""
        with tempfile.TemporaryDirectory() as name:
            here, other = pathlib.Path(name) / "mild", pathlib.Path(name) / "mild_cuda"
            driver = pathlib.Path(name) / "driver"
            for place in (here, other):
                (place / "data/bin").mkdir(parents=True)
                (place / "VERSION").write_text("1.2.3\n")
                (place / "data/bin/mild-x86-64-v3").touch(mode=0o755)
            with unittest.mock.patch.multiple(_processor, HERE=here, DRIVERS=("/none", str(driver))):
                for there, wanted, place in ((False, None, here), (False, "cuda", other), (True, None, other), (True, "x86-64-v3", here)):
                    driver.touch() if there else driver.unlink(missing_ok=True)
                    with on(V4, wanted):
                        self.assertEqual((_processor.folder(), _processor.program()), (place, place / "data/bin/mild-x86-64-v3"))
                (other / "VERSION").write_text("1.2.4\n")
                with on(V4), self.assertRaisesRegex(ImportError, "^mild is 1.2.3, but mild_cuda 1.2.4: install one of the same version$"):
                    _processor.folder()
                with on(V4, "x86-64-v4"):
                    self.assertEqual(_processor.folder(), here)


class Program(unittest.TestCase):
    @unittest.skipUnless(os.environ.get("MILD_PROGRAM"), "MILD_PROGRAM names no program")
    def test_runs(self):
        """Arguments, output and exit code are the program's."""
        for arguments in (["--version"], ["info", "robots"], ["eval", "--ground", "snad"], ["press", "--ground", "foam45", "--depth", "1e9"]):
            runs = [subprocess.run([*command, *arguments], capture_output=True, text=True)
                    for command in ([os.environ["MILD_PROGRAM"]], [sys.executable, "-m", "mild"])]
            self.assertEqual((runs[0].stdout, runs[0].stderr, runs[0].returncode), (runs[1].stdout, runs[1].stderr, runs[1].returncode))
        self.assertEqual(runs[0].returncode, 2)

    def test_trial(self):
        seen = []
        trials = types.SimpleNamespace(main=lambda arguments: seen.append(arguments) or 3)
        with unittest.mock.patch.dict(sys.modules, {"mild.trials": trials}):
            self.assertEqual(main.main(["trial", "robot.xml", "--speed", "1"]), 3)
        self.assertEqual(seen, [["robot.xml", "--speed", "1"]])

    def test_none(self):
        errors = io.StringIO()
        with unittest.mock.patch.object(_processor, "program", lambda: None), contextlib.redirect_stderr(errors):
            self.assertEqual(main.main(["play"]), 2)
        self.assertRegex(errors.getvalue(), r"^mild: this installation has no program[^\n]*docs/install.md[^\n]*\n$")

    def test_environment(self):
        """Beside it imageio-ffmpeg, if the system has no ffmpeg and nobody named one; this Python draws figures."""
        coder = types.ModuleType("imageio_ffmpeg")
        coder.get_ffmpeg_exe = lambda: "/packaged/ffmpeg"
        coder.__spec__ = importlib.machinery.ModuleSpec("imageio_ffmpeg", None)
        with unittest.mock.patch.dict(os.environ), unittest.mock.patch.dict(sys.modules, {"imageio_ffmpeg": coder}):
            os.environ.pop("MILD_FFMPEG", None)
            with unittest.mock.patch("shutil.which", lambda name: None):
                self.assertEqual(main.environment()["MILD_FFMPEG"], "/packaged/ffmpeg")
                os.environ["MILD_FFMPEG"] = "mine"
                self.assertEqual(main.environment()["MILD_FFMPEG"], "mine")
                del os.environ["MILD_FFMPEG"]
            with unittest.mock.patch("shutil.which", lambda name: "/usr/bin/ffmpeg"):
                self.assertEqual(main.environment()["MILD_FFMPEG"], "/usr/bin/ffmpeg")
        self.assertEqual(main.environment()["MILD_PYTHON"], sys.executable)

    def test_film(self):
        """mild trial's video by the same ffmpeg; without any it says what to install."""
        with unittest.mock.patch.dict(os.environ, {"MILD_FFMPEG": "/mine/ffmpeg"}):
            with unittest.mock.patch("subprocess.Popen") as opened:
                trials.Film("walk.mp4")
            self.assertEqual(opened.call_args.args[0][0], "/mine/ffmpeg")
            with self.assertRaisesRegex(RuntimeError, r"^video: needs ffmpeg; pip install 'mildground\[video\]'"):
                trials.Film("walk.mp4")

    def test_film_breaks(self):
        """An ffmpeg that ends is one line, not a broken pipe."""
        with unittest.mock.patch.dict(os.environ, {"MILD_FFMPEG": "/bin/false"}):
            film = trials.Film("walk.mp4")
            film.ffmpeg.wait()
            film.ffmpeg.stdin.write(b"picture")
            self.assertRaisesRegex(RuntimeError, "^video: ffmpeg failed$", film.close)

    def test_pipe(self):
        """Nobody reads on: no traceback."""
        reads, writes = os.pipe()
        os.close(reads)
        try:
            done = subprocess.run([sys.executable, "-m", "mild", "trial", "--keys"], stdout=writes, stderr=subprocess.PIPE, text=True, check=False)
        finally:
            os.close(writes)
        self.assertEqual((done.returncode, done.stderr), (141, ""))

    def test_home(self):
        """A wheel's data; where MILD_HOME names another folder, that one. Empty it counts as unset, for the environments as well."""
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.object(_processor, "HERE", pathlib.Path(name)):
            (pathlib.Path(name) / "data/bin").mkdir(parents=True)
            for given, home in ((None, name + "/data"), ("", name + "/data"), ("/mine", "/mine")):
                with unittest.mock.patch.dict(os.environ, {} if given is None else {"MILD_HOME": given}):
                    given is None and os.environ.pop("MILD_HOME", None)
                    self.assertEqual(main.environment()["MILD_HOME"], home)
        for given, home in (("", str(envs.DATA)), ("/mine", "/mine")):
            with unittest.mock.patch.dict(os.environ, MILD_HOME=given), unittest.mock.patch.object(envs.importlib.util, "find_spec", lambda name: None), \
                    unittest.mock.patch.object(envs._mujoco, "versions", lambda files: []):
                self.assertRaises(ImportError, envs.load)
                self.assertEqual(os.environ["MILD_HOME"], home)


if __name__ == "__main__":
    unittest.main()
