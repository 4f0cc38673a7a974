"""Which copy of the compiled files is taken: a wheel has those of x86-64-v3 in the package's folder, and may have faster ones for newer
processors in folders beside. The package mild_cuda has them for a GPU. MILD_PROCESSOR=x86-64-v3 takes the plain ones, cuda those."""
import importlib.util
import os
import pathlib
import shutil

HERE = pathlib.Path(os.path.abspath(__file__)).parent
DRIVERS = ("/dev/nvidiactl", "/dev/dxg")  # of Linux, and of Linux in Windows
LEVELS = {  # what each level needs beyond the one before, as Linux calls it
    "x86-64-v2": {"cx16", "lahf_lm", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"},
    "x86-64-v3": {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"},
    "x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
}


def flags():
    """Of the first processor; none where Linux does not say."""
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as lines:
            return next((set(line.split(":", 1)[1].split()) for line in lines if line.startswith("flags")), set())
    except OSError:
        return set()


def levels():
    """Those that this processor runs, best first."""
    wanted, has, found = os.environ.get("MILD_PROCESSOR"), flags(), []
    if wanted and wanted not in (*LEVELS, "cuda"):
        raise ImportError(f"MILD_PROCESSOR: '{wanted}' is none of {', '.join(LEVELS)}, cuda")
    for name, needs in LEVELS.items():
        if has and not needs <= has:
            break
        found.insert(0, name)
        if name == wanted or name == "x86-64-v3" and not (has or wanted in LEVELS):
            break
    return found


def gpu():
    """The folder of the package mild_cuda where it is installed and there is a driver, or it is asked for. None otherwise."""
    place, wanted = HERE.parent / "mild_cuda", os.environ.get("MILD_PROCESSOR")
    if wanted not in (None, "", "cuda") or not place.is_dir() or not (wanted or any(map(os.path.exists, DRIVERS))):
        return None
    versions = [(folder / "VERSION").read_text().strip() for folder in (HERE, place)]
    if versions[0] != versions[1]:
        raise ImportError(f"mild is {versions[0]}, but mild_cuda {versions[1]}: install one of the same version")
    return place


def program():
    """The program's file, or None: a wheel's, or that of the build tree around this package."""
    names = [place / "data/bin" / f"mild-{name}" for place in (gpu(), HERE) if place for name in levels() + ["native"]]
    if HERE.parent.name == "python":
        names.append(HERE.parents[1] / "mild")
    return next((name for name in names if os.access(name, os.X_OK)), None)


def folder():
    """The folder of the compiled files. Raises ImportError where a wheel has none for this processor."""
    if (HERE / "data/bin").is_dir() and not program():
        raise ImportError("this wheel of mild is for processors with AVX2 (x86-64-v3), which this one has not; on it build one from "
                          "the sources: MARCH=x86-64-v2 make wheel")
    return gpu() or next((HERE / name for name in levels() if (HERE / name).is_dir()), HERE)


def ffmpeg():
    """What makes videos: MILD_FFMPEG, else the system's, else that of the package imageio-ffmpeg; None without any."""
    if os.environ.get("MILD_FFMPEG"):
        return os.environ["MILD_FFMPEG"]
    if not shutil.which("ffmpeg") and importlib.util.find_spec("imageio_ffmpeg"):
        import imageio_ffmpeg

        return imageio_ffmpeg.get_ffmpeg_exe()
    return shutil.which("ffmpeg")
