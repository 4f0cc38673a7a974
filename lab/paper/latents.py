"""What the terrain latent knows, and what the policy gains by it."""
import math
import random

import figures
import latent_stats
from measure import ALONE, OF_PAPER, SEVEN, evaluate, mean, mild, save, together
from page import Claim, Section, Table

KEPT = ("ground", "speed", "trials", "success", "velocity", "cot", "cot_deviation", "torque_max", "clearance", "stride", "cadence")
HALF_WEIGHT = 33.1 * 9.81 / 2  # [N]


def latent(given):
    """t-SNE of z~, what names the ground, and the controls: phase, command, shuffled names."""
    paths = [given.raw / f"latent_{ground}.csv" for ground in SEVEN]

    def work(item):
        ground, path = item
        mild("eval", "--seed", given.seed, "--policy", given.policy, "--config", given.config, *ALONE, *OF_PAPER, "--ground", ground, "--speed", "0.4,0.8",
             "--trials", max(6, given.trials), "--seconds", 15, "--threads", 1, "--latent", path)

    together(given, work, zip(SEVEN, paths))
    data = latent_stats.read(paths)
    found, periods, moments = latent_stats.latent(data)
    save(given, "latent", [{"of": a, "names": b, "share": value} for (a, b), value in found.items()])
    save(given, "latent_periods", periods)
    share = {key: 100 * value for key, value in found.items()}
    period, instant = ({b: v for (a, b), v in share.items() if a == f"z~, {what}"} for what in ("one gait period", "one instant"))
    near = {a: v for (a, b), v in share.items() if b.startswith("ground of the 10")}
    chance = share["t-SNE of single instants", "the same by chance"]
    text = f"""15 s walks at 0.4 and 0.8 m/s on seven grounds. A linear discriminant is fitted on two thirds of the trials and names the rest.
From the mean of z~ over one gait period it names the ground in {period["ground"]:.0f} %; with the names of the grounds shuffled among the walks, in
{period["ground, shuffled"]:.0f} % (one of seven: 14 %). The command it names in {period["command"]:.0f} % (chance: 50 %), and from one instant the
phase of the gait, in eighths, in {instant["phase"]:.0f} % (chance: 13 %). So z~ holds the ground, and the phase and command too. The upper row
has one embedding three times, coloured by each; the lower row means over a gait period, in which the phase is gone. Of the ten nearest points
of other walks {near["t-SNE of single instants"]:.0f} % are of a point's own ground in the embedding of single instants,
{near["t-SNE of means over a period"]:.0f} % in that of means (by chance {chance:.0f} %).

The control: the eleven estimates (velocities of base and feet, heights of the feet) without z~ name the ground in
{share["the estimates, one gait period", "ground"]:.0f} % of the gait periods and {share["the estimates, one instant", "ground"]:.0f} % of the
instants; z~ at one instant in {instant["ground"]:.0f} %.

Of the variance of z~ at an instant, the ground explains {instant["variance: ground"]:.0f} %, the phase {instant["variance: phase"]:.0f} %, the
command {instant["variance: command"]:.0f} %; of its means over a period the ground {period["variance: ground"]:.0f} %, the command
{period["variance: command"]:.0f} %."""
    table = [[a, b, f"{100 * value:.0f} %"] for (a, b), value in found.items()]
    named = found["z~, one gait period", "ground"]
    ours = f"{100 * named:.0f} % of gait periods named ({period['ground, shuffled']:.0f} % shuffled)"
    claims = [Claim("z~ forms clusters by the ground's stiffness", "clusters (figure)", ours, named > 0.92, "hardware")]
    return Section("What the latent knows", text, figures.embeddings(periods, moments), [Table(["from", "what", "share"], table)], claims,
                   "hardware", ["latent.csv", "latent_periods.csv"])


def parameters(given):
    """Penetration stiffness and conical stress from z~, on grounds drawn between and beyond the presets."""
    draw = random.Random(1)
    known = [(math.exp(draw.uniform(math.log(150), math.log(1400))), math.exp(draw.uniform(math.log(8e4), math.log(2.4e5))),
              draw.choice(["foam45", "grass", "sand_loose"])) for _ in range(min(600, 60 * given.trials))]

    def work(item):
        i, (k_pen, stress, ground) = item
        paths = [given.raw / f"parameters_{i}_{kind}.csv" for kind in ("latent", "actions", "stances")]
        mild("eval", "--policy", given.policy, "--config", given.config, *ALONE, *OF_PAPER, "--ground", ground, f"--ground.k_pen={k_pen}",
             f"--ground.sigma_cone={stress}", "--speed", 0.6, "--trials", 1, "--seed", i + 1000 * (given.seed - 1), "--seconds", 8, "--threads", 1,
             "--latent", paths[0], "--actions", paths[1], "--stances", paths[2])
        seen = latent_stats.walk(*paths)
        for path in paths:  # 1.3 MB each walk
            path.unlink()
        return seen

    def sinkage(item):
        """[m] of one level sole under half of the weight, from a press."""
        k_pen, stress, ground = item
        lines = mild("press", "--ground", ground, f"--ground.k_pen={k_pen}", f"--ground.sigma_cone={stress}", "--plate", "sole",
                     "--depth", 0.09, "--csv", "-").splitlines()[1:]
        return next(depth for depth, force in (map(float, line.split(",")[1:3]) for line in lines) if force >= HALF_WEIGHT)

    seen = together(given, work, enumerate(known))
    truth = [(math.log(k), math.log(s), math.log(u)) for (k, s, _), u in zip(known, together(given, sinkage, known))]
    names = ("log k_pen", "log sigma_cone", "log sinkage")
    rows, found = latent_stats.regression(seen, truth, names)
    save(given, "parameters", rows)
    sources = list(dict.fromkeys(source for source, _ in found))
    table = [[source, *(f"{found[source, name]:.2f}" for name in names)] for source in sources]
    r2 = ", ".join(f"{found['z~', name]:.2f} of {name}" for name in names)
    sensors, state = (" and ".join(f"{found[source, name]:.2f}" for name in names[:2]) for source in sources[1:])
    text = f"""6 s of a walk at 0.6 m/s on each of {len(known)} grounds: foam45, grass or sand_loose with another k_pen and another sigma_cone, each
drawn for itself. R2 of what a regression says of the third that is held out (ridge, support vectors or trees, whichever does best on the
others). The last two rows say what there is to know: the means and deviations of every sensor reading over the phase of the gait, and those
of the true state without noise with the depth and slip of every stance, which no sensor of the robot measures. Beyond the shear bands' reach
the force under a sole is a plateau that k_pen makes plus a slope that sigma_cone makes: one load and one depth do not part them."""
    return Section("Ground parameters from the latent", text, [figures.regression(rows, {name: found["z~", name] for name in names})],
                   [Table(["from", *names], table)],
                   [Claim("z~ is a continuous measure of stiffness, also on grounds never seen", "stated",
                          f"R2 {r2}; of the first two all sensor readings explain {sensors}, the true state and depths {state}",
                          min(found["z~", name] for name in names[:2]) > 0.8, "hardware")],
                   "hardware, in words", ["parameters.csv"])


def course(given):
    """rubber - foam - rubber, forward and backward, with the latent along the way."""
    tracks = {"forward": 0.6, "backward": -0.6}

    def work(way):
        path = given.raw / f"course_{way}.csv"
        mild("eval", "--seed", given.seed, "--policy", given.policy, "--config", given.config, *ALONE, *OF_PAPER, "--ground", "rubber,foam28,rubber+foam28+rubber",
             f"--speed={tracks[way]}", "--trials", 4, "--seconds", 14, "--patch", 2.5, "--threads", 1, "--latent", path)
        return path

    found = dict(zip(tracks, map(latent_stats.course, together(given, work, tracks))))
    save(given, "course", [{"way": way, **r} for way, rows in found.items() for r in rows])
    late = latent_stats.delays(found)
    waits = ", ".join(f"{way} {value:.1f}" for way, value in late.items())
    text = f"""z~ on the axis that separates rubber from foam28 best (walks on either alone), means over one gait period, along a course of rubber,
foam28 and rubber, 2.5 m each, coloured by the ground under the base. Whole gait periods after a border until z~ is past the middle, mean of all
borders and trials: {waits}."""
    claim = Claim("the latent follows a change of ground under way, forward and backward", "distinct tracks (figure)",
                  f"within gait periods: {waits}", max(late.values()) <= 2, "hardware")
    return Section("Rubber, foam, rubber", text, [figures.course(found)], [], [claim], "hardware", ["course.csv"])


def clearances(rows):
    """({ground: [mm] with z, and with its mean}, [mm] how much higher on foam45 than on rigid ground with either) at 0.6 m/s."""
    at = {(r["ground"], r["without"]): 1e3 * r["clearance"] for r in rows if r["speed"] == 0.6}
    found = {g: [at[g, "nothing"], at[g, "z"]] for g in SEVEN}
    return found, [found["foam45"][i] - found["rigid"][i] for i in range(2)]


def ablations(given):
    """The policy without a part."""
    parts = [None, "z", "modulation", "estimates", "history"]

    def work(part):
        return evaluate(given, given.policy, SEVEN, [0.6, 1.0], "--config", given.config, *(["--ablate", part] if part else []))

    rows, table = [], []
    for part, found in zip(parts, together(given, work, parts)):
        rows += [{"without": part or "nothing", **{k: r[k] for k in KEPT}} for r in found]
    save(given, "ablations", rows)
    for part in dict.fromkeys(r["without"] for r in rows):
        own = [r for r in rows if r["without"] == part]
        stood = [r for r in own if r["success"]]
        table.append([part, f"{sum(r['success'] for r in own)} of {sum(r['trials'] for r in own)}",
                      f"{mean(abs(r['velocity'] - r['speed']) for r in stood):.3f}" if stood else "-",
                      f"{mean(r['cot'] for r in stood):.2f}" if stood else "-", f"{mean(r['torque_max'] for r in own):.0f}"])
    whole, without = ([r for r in rows if r["without"] == part] for part in ("nothing", "z"))
    high, rise = clearances(rows)
    falls = sum(r["success"] for r in whole) - sum(r["success"] for r in without)
    error = [mean(abs(r["velocity"] - r["speed"]) for r in own if r["success"]) for own in (whole, without)]
    text = """The shipped policy on seven grounds at 0.6 and 1.0 m/s. z, estimates, and modulation's theta1 and theta2: their means over the same trials
in their place; history: the newest frame in all places. Speed error and cost: of rows in which anybody stayed up."""
    matters = falls > 0.05 * sum(r["trials"] for r in whole) or error[1] > 1.5 * error[0]
    claim = Claim("the latent adapts the walk", "stated",
                  f"without z {falls} more falls, speed error {error[0]:.3f} -> {error[1]:.3f} m/s", matters, "hardware")
    lifts = Claim("the latent lifts the feet higher on softer ground", "stated",
                  f"from rigid to foam45 {rise[0]:+.0f} mm, without z {rise[1]:+.0f} mm", rise[0] > rise[1] + 2)
    heads = ["without", "upright", "speed error [m/s]", "cost of transport", "largest torque [N m]"]
    return Section("Without a part", text, [figures.grouped(high, ["with z", "its mean"], "clearance at 0.6 m/s [mm]")],
                   [Table(heads, table), Table(["", *high], [[name, *(f"{high[g][i]:.0f}" for g in high)]
                                                             for i, name in enumerate(("clearance with z [mm]", "with its mean"))])],
                   [claim, lifts], "no ablation", ["ablations.csv"])
