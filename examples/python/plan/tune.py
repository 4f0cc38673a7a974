"""Searches the numbers of plan.json for a robot on a GPU: a cross-entropy search whose candidates are walks on several grounds. Prints a
line of JSON for each candidate, and the best ones so far; with --out they are kept, and a later call goes on from there.

    python examples/python/plan/tune.py --robot sa01 --device cuda --minutes 8 --out runs/plan_sa01.jsonl"""
import argparse
import copy
import json
import math
import os
import pathlib
import subprocess
import sys
import threading
import time
import traceback
import types

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
# place in plan.json, low, high, on a logarithmic scale or not, whole numbers or not; * stands for every name that is there
SPACE = [("planner.horizon", 0.3, 1.0, 0, 0), ("planner.knots", 3, 10, 0, 1), ("planner.keep", 0.7, 1, 0, 0), ("planner.noise.*", 0.01, 0.4, 1, 0),
         ("planner.elite", 0.01, 0.5, 1, 0), ("planner.temperature", 0.05, 3, 1, 0), ("planner.fall", 2, 200, 1, 0),
         ("planner.speed", 0.5, 100, 1, 0), ("planner.heading", 0.5, 50, 1, 0), ("planner.side", 0.5, 50, 1, 0), ("gait.period", 0.3, 1.0, 0, 0), ("gait.bend", 0.1, 1.2, 0, 0),
         ("gait.speed_gain", 0, 1.6, 0, 0), ("gait.sway.*", -0.2, 0.2, 0, 0), ("gait.lean.*", -0.2, 0.2, 0, 0),
         ("keys.reward\\.linear_velocity", 1, 40, 1, 0), ("keys.reward\\.yaw_rate", 0.3, 10, 1, 0), ("keys.reward\\.orientation", 0.3, 20, 1, 0),
         ("keys.reward\\.base_height", 0.1, 20, 1, 0), ("keys.reward\\.base_motion", 0.1, 20, 1, 0), ("keys.reward\\.gait", 0.1, 20, 1, 0),
         ("keys.reward\\.feet_clearance", 0.1, 20, 1, 0), ("keys.reward\\.reference_motion", 0.05, 10, 1, 0),
         ("keys.reward\\.default_pose", 0.05, 10, 1, 0), ("keys.reward\\.tracking_time", 0.02, 0.6, 1, 0)]
DEFAULTS = {"keys.reward\\.linear_velocity": 2, "keys.reward\\.yaw_rate": 1.1, "keys.reward\\.orientation": 1.5, "keys.reward\\.base_height": 0.2,
            "keys.reward\\.base_motion": 0.5, "keys.reward\\.gait": 1.4, "keys.reward\\.feet_clearance": 2.4, "keys.reward\\.reference_motion": 2.2,
            "keys.reward\\.default_pose": 1.2, "keys.reward\\.tracking_time": 0.4}


def parts(place):
    return [part.replace("\0", ".") for part in place.replace("\\.", "\0").split(".")]


def dimensions(numbers, gait):
    """gait: bool, with that of the gait, which gait.py searches. (path, low, high, log, whole) of every number that is searched, and where it is now in [0, 1]."""
    found = []
    for place, low, high, log, whole in SPACE:
        *path, last = parts(place)
        if path[0] == "gait" and not gait:
            continue
        node = numbers
        for part in path:
            node = node.setdefault(part, {})
        names = list(node) if last == "*" else [last]
        for name in names:
            node.setdefault(name, DEFAULTS.get(place, 0))
            value = min(max(node[name], low), high)
            at = math.log(value / low) / math.log(high / low) if log else (value - low) / (high - low)
            found.append(((*path, name), low, high, log, whole, at))
    for kind in ("posture", "step") if gait else ():
        for error, joints in numbers["gait"][kind].items():
            for joint, value in joints.items():
                reach = 0.3 + abs(value)
                found.append((("gait", kind, error, joint), value - reach, value + reach, 0, 0, 0.5))
    return found


def numbers_at(numbers, dims, point):
    numbers = copy.deepcopy(numbers)
    for (path, low, high, log, whole, _), x in zip(dims, np.clip(point, 0, 1)):
        value = low * (high / low) ** x if log else low + x * (high - low)
        node = numbers
        for part in path[:-1]:
            node = node[part]
        node[path[-1]] = int(round(value)) if whole else float(f"{value:.4g}")
    return numbers


def score_of(result, seconds):
    """1 for walks at the speed, straight ahead; falls count by the time until them."""
    total = 0
    for t in result["trials"]:
        share = min(1, t["upright"] / seconds)
        wanted = result["speed"] * max(t["upright"], 0.3)
        slow = min(1, abs(t["forward"] - wanted) / wanted)
        total += share * (1 - 0.8 * slow - 0.1 * min(1, abs(t["turned"])) - 0.1 * min(1, abs(t["side"])))
    return total / len(result["trials"])


def evaluate(given, numbers, seed):
    import plan
    scores, results = [], []
    for ground in given.grounds.split(","):
        of = types.SimpleNamespace(robot=given.robot, ground=ground, believes=None, speed=given.speed, seconds=given.seconds, samples=given.samples,
                                   trials=given.trials, seed=seed, device=given.device, threads=1)
        result, _ = plan.walk(of, numbers, log=None)
        scores.append(score_of(result, given.seconds))
        results.append({"ground": ground, "score": round(scores[-1], 4), "walked": result["walked"], "upright": result["upright"],
                        "plan_ms": round(result["plan_ms"], 2), "forward": round(float(np.mean([t["forward"] for t in result["trials"]])), 3)})
        if scores[-1] < 0.25:  # the others would not help
            scores += [0] * (len(given.grounds.split(",")) - len(scores))
            break
    return float(np.mean(scores)), results


def serialize():
    """Opens, closes and captures one after the other: these wait for the whole device, and a graph must not be captured beside."""
    import plan
    lock = threading.RLock()

    def locked(function):
        def call(*arguments, **keys):
            with lock:
                return function(*arguments, **keys)
        return call

    plan.Robots.__init__, plan.Robots.close = locked(plan.Robots.__init__), locked(plan.Robots.close)
    plan.Arrays.graph = locked(plan.Arrays.graph)


class Search:
    """Candidates around the mean of the best so far."""

    def __init__(self, given, base):
        self.given, self.base, self.dims = given, base, dimensions(base, given.gait)
        self.lock, self.random = threading.Lock(), np.random.default_rng(given.seed + int(time.time()))
        self.done, self.first = [], np.array([d[-1] for d in self.dims])
        if given.out and os.path.exists(given.out):
            for line in open(given.out):
                row = json.loads(line)
                if row.get("score") is not None and len(row["point"]) == len(self.first):
                    self.done.append((row["score"], np.array(row["point"])))
        self.tried = len(self.done)

    def ask(self):
        with self.lock:
            self.tried += 1
            best = sorted(self.done, key=lambda row: -row[0])[:self.given.parents]
            if self.tried == 1:
                return self.first
            if len(self.done) < self.given.parents or self.random.random() < 0.1:
                return np.clip(self.first + self.given.width * self.random.standard_normal(len(self.first)), 0, 1)
            points = np.array([point for _, point in best])
            center = points[self.random.integers(max(1, len(points) // 2))] if self.random.random() < 0.5 else points.mean(0)
            moves = self.random.random(len(self.first)) < max(0.3, 3 / len(self.first))
            return np.clip(center + moves * (points.std(0) + 0.03) * self.random.standard_normal(len(self.first)), 0, 1)

    def tell(self, point, score, row):
        with self.lock:
            top = not self.done or score > max(s for s, _ in self.done)
            self.done.append((score, point))
            line = json.dumps({"score": round(score, 4), **row, "point": [round(float(x), 4) for x in point],
                               **({"numbers": numbers_at(self.base, self.dims, point)} if top else {})})
            print(("BEST " if top else "") + line, flush=True)
            if top and self.given.best:
                everything = json.loads(pathlib.Path(self.given.numbers).read_text())
                everything[self.given.robot] = numbers_at(self.base, self.dims, point)
                pathlib.Path(self.given.best).write_text(json.dumps(everything, indent=1) + "\n")
            if self.given.out:
                with open(self.given.out, "a") as out:
                    out.write(line + "\n")


def worker(search, given, end):
    stream = None
    if given.device != "cpu":
        import torch
        torch.cuda.set_device(torch.device(given.device).index or 0)
        stream = torch.cuda.Stream()
    while time.time() < end:
        point = search.ask()
        before = time.time()
        try:
            numbers = numbers_at(search.base, search.dims, point)
            if stream is not None:
                with torch.cuda.stream(stream):
                    score, results = evaluate(given, numbers, given.seed + search.tried % 7)
            else:
                score, results = evaluate(given, numbers, given.seed + search.tried % 7)
            search.tell(point, score, {"seconds": round(time.time() - before, 1), "grounds": results})
        except Exception as error:
            text = traceback.format_exc()
            print(json.dumps({"failed": str(error)[:300], "where": text[-600:]}), flush=True)
            if "CUDA" in text or "GPU" in text:  # the context may be broken: the parent starts another child
                os._exit(3)


def child(given, end):
    base = json.loads(pathlib.Path(given.numbers).read_text())[given.robot]
    search = Search(given, base)
    serialize()
    print(f"{len(search.dims)} numbers, {len(search.done)} candidates so far", flush=True)
    threads = [threading.Thread(target=worker, args=(search, given, end), daemon=True) for _ in range(given.workers)]
    for thread in threads:
        thread.start()
        time.sleep(0.5)
    while any(thread.is_alive() for thread in threads) and time.time() < end + 15:
        time.sleep(0.5)
    if search.done:
        score, point = max(search.done, key=lambda row: row[0])
        print("RESULT " + json.dumps({"score": round(score, 4), "robot": given.robot, "candidates": len(search.done),
                                      "numbers": numbers_at(base, search.dims, point)}), flush=True)
    os._exit(0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="go1")
    parser.add_argument("--grounds", default="rigid,foam45,sand_loose")
    parser.add_argument("--speed", type=float, default=0.5)
    parser.add_argument("--seconds", type=float, default=4, help="of a walk")
    parser.add_argument("--trials", type=int, default=4, help="side by side")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--workers", type=int, default=4, help="candidates at once, each in a thread and stream")
    parser.add_argument("--parents", type=int, default=8)
    parser.add_argument("--width", type=float, default=0.12, help="of the first candidates, of the range")
    parser.add_argument("--minutes", type=float, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--numbers", default=str(HERE / "plan.json"))
    parser.add_argument("--out", help="a file of JSON lines")
    parser.add_argument("--best", help="a file like plan.json, with the best numbers")
    parser.add_argument("--gait", action="store_true", help="the gait's numbers, too, which gait.py finds sooner")
    parser.add_argument("--end", type=float, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.end:
        child(given, given.end)
    end = time.time() + 60 * given.minutes
    while time.time() < end - 10:  # a broken context ends a child, not the search
        left = max(5, end - time.time() + 25)
        try:
            code = subprocess.run([sys.executable, "-u", __file__, *sys.argv[1:], "--end", str(end)], timeout=left).returncode
        except subprocess.TimeoutExpired:
            print("the child did not end", flush=True)
            break
        if code == 0:
            break
        print(f"child ended with {code}; again", flush=True)
        time.sleep(1)


if __name__ == "__main__":
    main()
