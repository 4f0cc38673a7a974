"""The shipped policy on many grounds: clearance, energy, grounds that nobody trained on; and whether a measurement repeats."""
import figures
from measure import ALONE, NINE, OF_PAPER, SEVEN, UNSEEN, evaluate, mean, mild, read, save, together
from page import Cell, Claim, Section, Table


def grounds(given):
    """Force against depth of the robot's sole on every preset."""
    curves = {}
    for name in NINE[1:]:
        path = given.out / f"press_{name}.csv"
        mild("press", "--ground", name, "--plate", "sole", "--depth", 0.05, "--csv", path)
        curves[name] = [(1e3 * float(row["depth_m"]), float(row["force_n"])) for row in read(path)]
    text = """The sole of the robot pressed 50 mm deep at 10 mm/s and drawn out again. The paper shows its materials by their names and
densities; the numbers are ours (docs/model.md, section 10)."""
    return Section("The grounds", text, [figures.lines(curves, "depth [mm]", "force on one sole [N]")], there="hardware",
                   csv=[f"press_{name}.csv" for name in curves])


KEPT = ("ground", "speed", "trials", "success", "velocity", "cot", "cot_deviation", "energy", "seconds", "clearance", "penetration",
        "drift_forward", "drift_left")


def terrains(given):
    """Foot clearance, cost of transport and power by ground and speed."""
    speeds = [0.3, 0.6, 0.9, 1.2]

    def work(ground):
        return evaluate(given, given.policy, [ground], speeds, "--config", given.config)

    rows = [r for found in together(given, work, NINE) for r in found]
    save(given, "terrains", [{k: r[k] for k in KEPT} for r in rows])
    at = {(r["ground"], r["speed"]): r for r in rows}
    high = {g: 1e3 * at[g, 0.6]["clearance"] for g in NINE}
    power = {g: [at[g, v]["energy"] / at[g, v]["seconds"] for v in speeds] for g in NINE}
    rises = high["foam28"] > high["foam60"] > high["rubber"] > high["rigid"]
    soft, fast = mean(power["foam28"]) > mean(power["rigid"]), all(p[-1] > p[0] for p in power.values())
    table = [[g, f"{high[g]:.0f}", *(f"{at[g, v]['cot']:.2f} ± {at[g, v]['cot_deviation']:.2f}" for v in speeds),
              *(f"{p:.0f}" for p in power[g])] for g in NINE]
    text = """Clearance: apex of the lowest sole point above the undisturbed ground, at 0.6 m/s. Cost of transport: sum of |torque x speed|
over weight x distance. Energy: integral of |sum of torque x speed|, of a whole trial, per second."""
    ends = ", ".join(f"{g} {power[g][0]:.0f} to {power[g][-1]:.0f} W" for g in ("rigid", "foam28"))
    claims = [Claim("clearance is higher on softer ground", "rises (figure)",
                    ", ".join(f"{g} {high[g]:.0f}" for g in ("rigid", "rubber", "foam60", "foam45", "foam28", "foam25")) + " mm", rises,
                    "hardware"),
              Claim("energy rises with speed and on softer ground", "rises (in a comment of its source)",
                    ends, soft and fast)]
    return Section("Clearance and energy by ground", text, [figures.bars(high, "clearance [mm]"), figures.grouped(
        power, [f"{v} m/s" for v in speeds], "energy per second [W]")],
        [Table(["ground", "clearance [mm]", *(f"cost at {v}" for v in speeds), *(f"W at {v}" for v in speeds)], table)], claims,
        "hardware", ["terrains.csv"])


def unseen(given):
    """Grounds that nobody trained on, with z~ and with its mean."""
    tasks = [(*kind, part) for kind in UNSEEN for part in (None, "z")]

    def work(task):
        _, grounds_of, more, part = task
        ablated = ["--ablate", part] if part else []
        return evaluate(given, given.policy, grounds_of, [0.3, 0.6, 1.0], "--config", given.config, *more, *ablated)

    rows = [{"kind": kind, "without": part or "nothing", **{k: r[k] for k in ("ground", "speed", "trials", "success", "velocity", "cot")}}
            for (kind, _, _, part), found in zip(tasks, together(given, work, tasks)) for r in found]
    save(given, "unseen", rows)
    table, upright, trials = [], 0, 0
    for kind, _, _ in UNSEEN:
        for ground in dict.fromkeys(r["ground"] for r in rows if r["kind"] == kind):
            row = [kind, ground]
            for part in ("nothing", "z"):
                own = [r for r in rows if r["kind"] == kind and r["ground"] == ground and r["without"] == part]
                up, all_of = sum(r["success"] for r in own), sum(r["trials"] for r in own)
                stood = [r for r in own if r["success"]]
                row += [Cell(f"{up} of {all_of}", "worse" if up < all_of else ""),
                        f"{mean(abs(r['velocity'] - r['speed']) for r in stood):.3f}" if stood else "-",
                        f"{mean(r['cot'] for r in stood):.2f}" if stood else "-"]
                if part == "nothing":
                    upright, trials = upright + up, trials + all_of
            table.append(row)
    text = """The shipped policy at 0.3, 0.6 and 1.0 m/s on ground laws, soils and changes of ground of which it never saw one in training; then
with the mean of z in its place (over the grounds of one kind). Speed error and cost: of rows in which anybody stayed up."""
    claims = [Claim("adapts to abrupt changes and grounds never met in training", "stated", f"{upright} of {trials} upright",
                    upright >= 0.95 * trials, "hardware")]
    heads = ["upright", "speed error [m/s]", "cost of transport"]
    return Section("Grounds that nobody trained on", text, [], [Table(["", "ground", *heads, *(f"{h}, without z" for h in heads)], table)],
                   claims, "hardware", ["unseen.csv"])


def repeat(given):
    """The same walks twice, on one thread and on several, with every stance."""
    texts = []
    for threads in (1, 1, max(2, given.jobs)):
        path = given.raw / "repeat.csv"
        printed = mild("eval", "--seed", given.seed, "--policy", given.policy, "--config", given.config, *ALONE, *OF_PAPER, "--ground", "foam45,sand_loose", "--speed", "0.6,1.2",
                       "--trials", 4, "--threads", threads, "--stances", path, "--json", "-")
        texts.append(printed + path.read_text())
    same = texts[0] == texts[1] == texts[2]
    compared = "the same bytes" if same else "other bytes"
    return Section("Repeatable to the bit", f"16 walks, three times: twice on one thread, once on several. Table and every stance: {compared}.",
                   claims=[Claim("the same seed gives the same numbers on this machine", "-", compared, same, "-")])
