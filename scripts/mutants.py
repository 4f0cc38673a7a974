#!/usr/bin/env python3
"""Mutation testing: makes small random faults in one layer, runs that layer's tests on each, and
prints the share that the tests catch and the faults that survive. docs/testing.md explains it.

A fault (mutant) changes one place of src/LAYER: an operator, a number, a condition, an index, the
order of two arguments, a sign, or it removes a statement. Text inside comments, strings, error
messages and assertions stays. Everything happens in a copy of the tree under build/mutants."""

import argparse
import concurrent.futures
import dataclasses
import fcntl
import hashlib
import json
import math
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time

from mutate import File, Mutant, draw, plain

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
BUILD = WORK / "build"
NAMED = ROOT / "tests" / "mutants.txt"
FAULTS = ROOT / "tests" / "faults.txt"

# Share of their draws that the ground's random tests make (tests/ground/ground_kit.h).
DRAWS = "0.1"

# glibc fills new memory with a pattern, so that what nobody set is no lucky 0, and its checking
# malloc aborts when a block is freed whose end was written over.
MEMORY = {"MALLOC_PERTURB_": "165"}
if pathlib.Path("/lib/x86_64-linux-gnu/libc_malloc_debug.so.0").exists():
    MEMORY |= {"MALLOC_CHECK_": "3", "LD_PRELOAD": "libc_malloc_debug.so.0"}

# A layer without a folder of tests is tested by the layer above it, wings of the ground by the ground's.
TESTED_BY = {"control": ("control", "eval")} | {
    wing: ("ground",) for wing in ("law", "models", "sole", "step", "terrain")}

# ---------------------------------------------------------------------------------------------
# tests/mutants.txt: equivalent mutants, each with its reason.


def read_entries(path):
    """Entries of a file in the form of tests/mutants.txt: {"at": text, "=": text, "-": lines,
    "+": lines}."""
    entries, entry = [], {}
    lines = path.read_text().splitlines() if path.exists() else []
    for number, line in enumerate(lines + [""], 1):
        if line.startswith("#"):
            continue
        if not line.strip():
            if entry:
                missing = {"at", "-", "+", "="} - set(entry)
                if missing:
                    sys.exit(f"mutants: {path.name} line {number}: an entry without "
                             f"{' '.join(sorted(missing))}")
                entries.append(entry | {"=": " ".join(entry["="])})
            entry = {}
        elif line[0] in "-+=" and line[1:2] in (" ", ""):
            entry.setdefault(line[0], []).append(line[2:].strip())
        else:
            entry["at"] = line.strip()
    return entries


def read_named():
    joined = lambda lines: plain(" ".join(lines))
    return {f"{e['at']}: {joined(e['-'])} -> {joined(e['+'])}": e["="]
            for e in read_entries(NAMED)}


def fault_of(entry, file):
    """The mutant that an entry of tests/faults.txt describes: line by line within its function."""
    path, _, function = entry["at"].partition(" ")
    lines, place, first, last = file.source.split("\n"), 0, 0, 0
    if len(entry["-"]) != len(entry["+"]):
        sys.exit(f"mutants: {FAULTS.name}: {entry['=']}: as many - as + are wanted")
    for before, after in zip(entry["-"], entry["+"]):
        while place < len(lines) and (file.functions[place] != function or
                                      lines[place].strip() != before):
            place += 1
        if place == len(lines):
            sys.exit(f"mutants: {FAULTS.name}: {entry['=']}: {path} {function} has no line\n"
                     f"    {before}\nThe code changed: write the same fault in its present form.")
        first, last = first or place + 1, place + 1
        lines[place] = lines[place].replace(before, after)
        place += 1
    begin, end = file.starts[first - 1], file.starts[last]
    text = "".join(line + "\n" for line in lines[first - 1:last])
    return Mutant(path, first, function, "fault", begin, end, text, " ".join(entry["-"]),
                  " ".join(entry["+"]), entry["="])


def entry_of(mutant):
    suffix = mutant.name.rpartition(" #")[2] if " #" in mutant.name[-4:] else ""
    plus = mutant.after + (f" #{suffix}" if suffix else "")
    return f"{mutant.path} {mutant.function}\n- {mutant.before}\n+ {plus}\n"


# ---------------------------------------------------------------------------------------------
# The copy of the tree, its build, and what each test is linked from.


def source_file(path):
    return File(path, (TREE / path).read_text())


def copy_tree():
    """The working tree as it stands, without what git ignores; a file that is the same is left."""
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT,
                            capture_output=True, check=False)
    if listed.returncode == 0:
        names = [n for n in listed.stdout.decode().split("\0") if n and (ROOT / n).is_file()]
    else:  # an archive without git
        names = [str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if p.is_file() and
                 p.relative_to(ROOT).parts[0] not in ("build", ".venv", "out", "runs")]
    wanted = set(names)
    for old in [p for p in TREE.rglob("*") if p.is_file() and not p.is_symlink()]:
        if str(old.relative_to(TREE)) not in wanted:
            old.unlink()
    for name in names:
        source, target = ROOT / name, TREE / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_symlink() or not target.exists() or source.read_bytes() != target.read_bytes():
            shutil.copy(source, target)
    venv = TREE / ".venv"
    if not venv.exists() and (ROOT / ".venv").exists():
        venv.symlink_to((ROOT / ".venv").resolve())


@dataclasses.dataclass
class Test:
    name: str
    command: list
    links: dict  # path of an executable in the command -> (folder, link command)
    seconds: float = 0  # processor time of the run without a fault


@dataclasses.dataclass
class Object:
    path: pathlib.Path  # the .o
    source: pathlib.Path
    command: list
    folder: str
    depends: set


def run_quiet(command, **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace", check=False, **more)
    if done.returncode:
        sys.exit(f"mutants: failed: {shlex.join(map(str, command))}\n{done.stdout[-4000:]}")
    return done.stdout


def find_tests(layers):
    """Tests of a layer from what CMake wrote for ctest, which knows them before they are built:
    add_test([=[NAME]=] ...), or add_test("NAME" ...) by a newer CMake."""
    tests = []
    text = (BUILD / "tests" / "CTestTestfile.cmake").read_text()
    for name, arguments in re.findall(r'^add_test\((?:\[=\[|")(.*?)(?:\]=\]|") (.*)\)$', text, re.M):
        command = [m.replace('\\"', '"') for m in re.findall(r'"((?:\\.|[^"\\])*)"', arguments)]
        if name.partition("/")[0] in layers:
            tests.append(Test(name, command, {}))
    return tests


def build_tests(layers, jobs):
    # an array on the stack that overflows stops the program, as under the sanitizers
    flags = ["-DCMAKE_BUILD_TYPE=None", "-DCMAKE_C_FLAGS=-O3 -fstack-protector-strong",
             "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DMILD_WERROR=ON", "--log-level=ERROR"]
    if shutil.which("ccache"):
        flags.append("-DCMAKE_C_COMPILER_LAUNCHER=ccache")
    run_quiet(["cmake", "-S", TREE, "-B", BUILD, "-G", "Unix Makefiles", "-Wno-dev", *flags])
    tests = find_tests(layers)
    executables = {c: pathlib.Path(c).name for t in tests for c in t.command
                   if c.startswith(str(BUILD)) and not c.endswith(".sh") and c != str(BUILD)}
    if not tests:
        sys.exit(f"mutants: there is no test of {' or '.join(layers)} (ctest -N lists all)")
    run_quiet(["cmake", "--build", BUILD, "--parallel", str(jobs), "--target",
               *sorted(set(executables.values()))])
    scripts = {p.parent.name[:-4]: p for p in BUILD.rglob("link.txt")}
    for test in tests:
        for argument in test.command:
            script = scripts.get(executables.get(argument))
            if script:
                test.links[argument] = (str(script.parent.parent.parent),
                                        shlex.split(script.read_text().splitlines()[0]))
    return [t for t in tests if t.links]


def find_objects():
    """Every object that was built, with the files that it was made from (by the compiler's .d)."""
    objects = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        command = shlex.split(entry["command"])
        if os.path.basename(command[0]) == "ccache":
            command = command[1:]
        at = command.index("-o")
        path = pathlib.Path(entry["directory"], command[at + 1])
        depfile = pathlib.Path(str(path) + ".d")
        if not depfile.exists():
            continue
        names = depfile.read_text().replace("\\\n", " ").partition(":")[2].split()
        depends = {os.path.realpath(os.path.join(entry["directory"], n)) for n in names}
        objects[path.resolve()] = Object(path.resolve(), pathlib.Path(entry["file"]), command,
                                         entry["directory"], depends)
    return objects


def linked_objects(test, objects):
    """Objects that a test's executables are linked from: those named, and those in its archives."""
    used = set()
    for folder, command in test.links.values():
        for argument in command:
            path = pathlib.Path(folder, argument).resolve()
            if path in objects:
                used.add(path)
            elif argument.endswith(".a") and str(path).startswith(str(BUILD)):
                members = path.parent / "CMakeFiles" / (path.stem.removeprefix("lib") + ".dir")
                used.update(o for o in objects if members in o.parents)
    return used


# ---------------------------------------------------------------------------------------------
# One worker compiles one mutant, links and runs.


class Worker:
    def __init__(self, number, objects, tests):
        self.folder = WORK / f"worker{number}"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.overlay = self.folder / "overlay"
        self.run_folder = self.folder / "run"
        self.run_folder.mkdir(parents=True)
        for entry in TREE.iterdir():  # tests read and write relative to the root of the tree
            (self.run_folder / entry.name).symlink_to(entry)
        self.objects, self.tests = objects, tests

    def compile(self, path, source):
        """Objects that depend on path, made with source in its place: {object: the new one}, or
        the compiler's message. What did not change gives the same bytes."""
        original = TREE / path
        shutil.rmtree(self.overlay, ignore_errors=True)
        layer_path = pathlib.Path(path).relative_to("src")
        changed = self.overlay / layer_path
        changed.parent.mkdir(parents=True)
        changed.write_text(f'#line 1 "{original}"\n{source}')
        made = {}
        for number, (name, item) in enumerate(self.affected(original)):
            output = self.folder / f"{number}.o"
            command = [a for a in item.command if not a.startswith("-M")]
            command[command.index("-o") + 1] = str(output)
            if item.source.resolve() == original.resolve():
                command[command.index("-c") + 1] = str(changed)
            command[1:1] = [f"-I{self.overlay}"]
            done = subprocess.run(command, cwd=item.folder, capture_output=True, text=True,
                                  errors="replace", check=False)
            if done.returncode:
                return done.stderr
            made[name] = output
        return made

    def affected(self, original):
        """The small ones first, which show soonest that the compiler refuses a mutant."""
        real = os.path.realpath(original)
        return sorted(((n, o) for n, o in self.objects.items() if real in o.depends),
                      key=lambda entry: entry[0].stat().st_size)

    def link(self, test, changed):
        """The test's command with executables that hold the changed objects."""
        command = list(test.command)
        for argument, (folder, link) in test.links.items():
            link, added, replaced = list(link), [], set()
            for i, word in enumerate(link):
                path = pathlib.Path(folder, word).resolve()
                if word.endswith(".o") and path in changed:
                    link[i] = str(changed[path])
                    replaced.add(path)
            members = linked_objects(Test("", [], {argument: (folder, link)}), self.objects)
            # before the archives: whoever comes first defines the symbols
            added = [str(new) for old, new in changed.items() if old in members - replaced]
            at = link.index("-o")
            output = self.folder / pathlib.Path(argument).name
            link[at + 1] = str(output)
            link[at:at] = added
            done = subprocess.run(link, cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode:
                return done.stderr
            command = [str(output) if c == argument else c for c in command]
        return command

    def run(self, command, seconds):
        """(caught by, processor seconds); seconds is the processor time that it may take."""

        def limit():
            cpu = int(math.ceil(seconds))
            resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 1))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))

        environment = dict(os.environ, CMOCKA_TEST_ABORT="1", TMPDIR=str(self.folder),
                           MILD_TEST_DRAWS=DRAWS, **MEMORY)
        log = self.folder / "log"
        with open(log, "wb") as out:
            child = subprocess.Popen(command, cwd=self.run_folder, stdout=out, stderr=out,
                                     stdin=subprocess.DEVNULL, env=environment, preexec_fn=limit,
                                     start_new_session=True)
            timer = threading.Timer(20 + 10 * seconds, os.killpg, (child.pid, signal.SIGKILL))
            timer.start()
            _, status, usage = os.wait4(child.pid, 0)
            timer.cancel()
            child.returncode = os.waitstatus_to_exitcode(status)
        return child.returncode, usage.ru_utime + usage.ru_stime

    def judge(self, mutant, source):
        """(verdict, detail): refused, same, caught or survived."""
        text = source[:mutant.begin] + mutant.text + source[mutant.end:]
        made = self.compile(mutant.path, text)
        if isinstance(made, str):
            return "refused", made.strip().splitlines()[0] if made.strip() else "compiler"
        changed = {name: path for name, path in made.items()
                   if path.read_bytes() != name.read_bytes()}
        if not changed:
            return "same", ""
        reached = False
        for test in self.tests:
            if not any(name in test.members for name in changed):
                continue
            reached = True
            command = self.link(test, changed)
            if isinstance(command, str):
                return "refused", command.strip().splitlines()[-1]
            code, seconds = self.run(command, 2 + 4 * test.seconds)
            if code:
                hang = code in (-signal.SIGXCPU, -signal.SIGKILL)
                return "caught", test.name + (" (hang)" if hang else "")
        return ("survived", "") if reached else ("survived", "in no test's program")


def measure(tests, worker, jobs):
    """Runs every test once without a fault; what did not change since the last time is not run."""
    store = WORK / "times.json"
    known = json.loads(store.read_text()) if store.exists() else {}
    for test in tests:
        digest = hashlib.sha256()
        for argument in test.command:
            if os.path.isfile(argument):
                digest.update(pathlib.Path(argument).read_bytes())
        key = test.name + " " + digest.hexdigest()
        if key not in known:
            code, seconds = worker.run(test.command, 600)
            if code:
                tail = (worker.folder / "log").read_text(errors="replace")[-3000:]
                sys.exit(f"mutants: {test.name} fails without a fault (exit {code}):\n{tail}")
            known = {k: v for k, v in known.items() if not k.startswith(test.name + " ")}
            known[key] = seconds
            store.write_text(json.dumps(known))
        test.seconds = known[key]
    tests.sort(key=lambda t: t.seconds)


# ---------------------------------------------------------------------------------------------


def report_text(options, results, named, wanted, seconds):
    caught = [r for r in results if r[1] == "caught"]
    survived = [r for r in results if r[1] == "survived"]
    refused = sum(r[1] == "refused" for r in results)
    same = sum(r[1] == "same" for r in results)
    count = len(caught) + len(survived)
    lines = [f"layer {options.layer}, seed {options.seed}: {len(caught)} of {count} mutants caught"
             f" ({100 * len(caught) / max(count, 1):.1f} %), {len(survived)} survived",
             f"not counted: {refused} that the compiler refuses, {same} with the same object code, "
             f"{len(named)} equivalent by {NAMED.relative_to(ROOT)}; {seconds:.0f} s"]
    if count < wanted:
        lines.append(f"there are no more than {count} mutants")
    kinds = sorted({r[0].kind for r in caught + survived})
    table = [f"{k} {sum(r[0].kind == k for r in caught)}/"
             f"{sum(r[0].kind == k for r in caught + survived)}" for k in kinds]
    lines.append("caught by kind: " + ", ".join(table))
    if survived:
        lines += ["", "survivors:", ""]
        for mutant, _, detail in sorted(survived, key=lambda r: (r[0].path, r[0].line)):
            note = f" ({detail})" if detail else ""
            lines.append(f"# line {mutant.line}, {mutant.kind}{note}\n{entry_of(mutant)}")
    if named:
        lines += ["", "equivalent, with the reason:", ""]
        for mutant, reason in named:
            lines.append(f"{entry_of(mutant)}= {reason}\n")
    return "\n".join(lines) + "\n"


def folder_of(layer):
    """src/LAYER, or src/ROOM/LAYER."""
    found = [p for p in (ROOT / "src" / layer, *(ROOT / "src").glob(f"*/{layer}")) if p.is_dir()]
    return found[0].relative_to(ROOT) if found else pathlib.Path("src") / layer


def choose(options):
    folder = folder_of(options.layer)
    paths = sorted(p.relative_to(TREE) for p in (TREE / folder).rglob("*")
                   if p.suffix in (".c", ".h") and (not options.file or p.name == options.file) and
                   (p.parent == TREE / folder or TESTED_BY.get(p.parent.name) == (options.layer,)))
    if not paths:
        sys.exit(f"mutants: no source in {folder}/{options.file or ''}; layers: "
                 f"{' '.join(sorted(p.name for p in (ROOT / 'src').rglob('*') if p.is_dir()))}")
    files = {str(p): source_file(str(p)) for p in paths}
    return files, draw(files.values(), options.seed)


def judge_all(options, files, order, workers):
    """Judges in the drawn order until N count; workers take the next one each."""
    results, lock, position = {}, threading.Lock(), [0]
    wanted = options.n

    def counted():
        return sum(r[1] in ("caught", "survived") for r in results.values())

    def work(worker):
        while True:
            with lock:
                if counted() >= wanted or position[0] == len(order):
                    return
                index = position[0]
                position[0] += 1
            mutant = order[index]
            verdict, detail = worker.judge(mutant, files[mutant.path].source)
            with lock:
                results[index] = (mutant, verdict, detail)
                if verdict == "survived":
                    print(f"{mutant.path}:{mutant.line}: {mutant.before}\n    -> {mutant.after}",
                          flush=True)
                done = counted()
                if verdict in ("caught", "survived") and done % 20 == 0:
                    print(f"mutants: {done} of {wanted}", flush=True)

    with concurrent.futures.ThreadPoolExecutor(len(workers)) as pool:
        for future in [pool.submit(work, w) for w in workers]:
            future.result()
    kept, count = [], 0
    for index in sorted(results):  # the first N in order, whichever worker was faster
        count += results[index][1] in ("caught", "survived")
        if count <= wanted:
            kept.append(results[index])
    return kept


def judge_faults(faults, files, tests, workers):
    """Every fault of tests/faults.txt against its layer's tests; returns how many survive."""
    lock, verdicts, waiting, begin = threading.Lock(), {}, list(faults), time.time()

    def work(worker):
        while True:
            with lock:
                if not waiting:
                    return
                mutant = waiting.pop(0)
            layer = pathlib.Path(mutant.path).parent.name
            worker.tests = tests_of(layer, tests)
            verdict, detail = worker.judge(mutant, files[mutant.path].source)
            with lock:
                verdicts[mutant.name] = verdict
                by = f"  [{detail}]" if detail else ""
                print(f"{verdict:8} {mutant.path}: {mutant.name}{by}", flush=True)

    with concurrent.futures.ThreadPoolExecutor(len(workers)) as pool:
        for future in [pool.submit(work, w) for w in workers]:
            future.result()
    caught = sum(v == "caught" for v in verdicts.values())
    print(f"{caught} of {len(faults)} named faults caught; {time.time() - begin:.0f} s")
    return len(faults) - caught


def tests_of(layer, tests):
    return [t for t in tests if t.name.partition("/")[0] in TESTED_BY.get(layer, (layer,))]


def prepare(layers, jobs):
    """Builds the layers' tests, runs each once without a fault; returns them and the workers."""
    tests = build_tests([t for layer in layers for t in TESTED_BY.get(layer, (layer,))], jobs)
    objects = find_objects()
    for test in tests:
        test.members = linked_objects(test, objects)
    used = set().union(*(t.members for t in tests))
    objects = {name: item for name, item in objects.items() if name in used}
    workers = [Worker(k, objects, tests) for k in range(max(1, jobs))]
    measure(tests, workers[0], jobs)
    return tests, workers


def discard(workers):
    for worker in workers:
        shutil.rmtree(worker.folder, ignore_errors=True)


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--layer", default="task", help="a layer: a folder of src/, or one in a room (task)")
    parser.add_argument("-n", type=int, default=200, help="mutants that count (200)")
    parser.add_argument("--seed", default="1", help="the same seed draws the same mutants (1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="at once (all cores)")
    parser.add_argument("--file", help="only this file of the layer, e.g. reward.h")
    parser.add_argument("--again", action="store_true",
                        help="only what survived in the last report of this layer")
    parser.add_argument("--faults", action="store_true",
                        help="the named faults of tests/faults.txt instead; exit 1 if one survives")
    parser.add_argument("--list", action="store_true", help="print the mutants drawn, run nothing")
    return parser.parse_args()


def main():
    options = parse_options()
    begin = time.time()
    TREE.mkdir(parents=True, exist_ok=True)
    lock = open(WORK / "lock", "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit("mutants: another run uses build/mutants; wait for it")
    copy_tree()
    if options.faults:
        entries = read_entries(FAULTS)
        files = {p: source_file(p) for p in sorted({e["at"].partition(" ")[0] for e in entries})}
        faults = [fault_of(entry, files[entry["at"].partition(" ")[0]]) for entry in entries]
        if options.list:
            print("\n".join(f"{m.path}:{m.line}: {m.name}" for m in faults))
            return
        layers = sorted({pathlib.Path(p).parent.name for p in files})
        tests, workers = prepare(layers, options.jobs)
        survivors = judge_faults(faults, files, tests, workers)
        discard(workers)
        sys.exit(1 if survivors else 0)
    files, order = choose(options)
    report = WORK / f"{options.layer}.txt"
    if options.again:
        last = report.read_text() if report.exists() else ""
        last = last.partition("equivalent, with the reason:")[0]
        order = [m for m in order if entry_of(m) + "\n" in last + "\n"]
        report = WORK / f"{options.layer}.again.txt"
    reasons = read_named()
    present = {m.name for m in order}
    for name in reasons:
        if name.startswith(f"{folder_of(options.layer)}/") and not (options.file or options.again or
                                                             name in present):
            print(f"mutants: {NAMED.name} names what is no longer there: {name}", flush=True)
    named = [(m, reasons[m.name]) for m in order if m.name in reasons]
    order = [m for m in order if m.name not in reasons]
    if options.list:
        print("\n".join(f"{m.path}:{m.line}: {m.kind}: {m.before} -> {m.after}"
                        for m in order[:options.n]))
        return
    tests, workers = prepare((options.layer,), options.jobs)
    print(f"mutants: {len(order)} possible in src/{options.layer}; a run of its {len(tests)} tests "
          f"takes {sum(t.seconds for t in tests):.1f} s", flush=True)
    results = judge_all(options, files, order, workers)
    text = report_text(options, results, named, min(options.n, len(order)), time.time() - begin)
    details = "\n".join(f"{v:8} {m.path}:{m.line}: {m.before} -> {m.after}  [{d}]"
                        for m, v, d in results)
    report.write_text(text + "\nall:\n" + details + "\n")
    print("\n" + text + f"report: {report.relative_to(ROOT)}")
    discard(workers)


if __name__ == "__main__":
    main()
