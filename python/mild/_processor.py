"""Which copy of the compiled files this processor runs: a wheel has those of x86-64-v3 in the package's folder, and may have faster
ones for newer processors in folders beside. MILD_PROCESSOR=x86-64-v3 takes the plain ones."""
import os
import pathlib

HERE = pathlib.Path(os.path.abspath(__file__)).parent
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
    if wanted and wanted not in LEVELS:
        raise ImportError(f"MILD_PROCESSOR: '{wanted}' is none of {', '.join(LEVELS)}")
    for name, needs in LEVELS.items():
        if has and not needs <= has:
            break
        found.insert(0, name)
        if name == (wanted or (None if has else "x86-64-v3")):
            break
    return found


def program():
    """The program's file, or None: a wheel's, or that of the build tree around this package."""
    names = [HERE / "data/bin" / f"mild-{name}" for name in levels() + ["native"]]
    if HERE.parent.name == "python":
        names.append(HERE.parents[1] / "mild")
    return next((name for name in names if os.access(name, os.X_OK)), None)


def folder():
    """The folder of the compiled files. Raises ImportError where a wheel has none for this processor."""
    if (HERE / "data/bin").is_dir() and not program():
        raise ImportError("this wheel of mild is for processors with AVX2 (x86-64-v3), which this one has not; on it build one from "
                          "the sources: MARCH=x86-64-v2 make wheel")
    return next((HERE / name for name in levels() if (HERE / name).is_dir()), HERE)
