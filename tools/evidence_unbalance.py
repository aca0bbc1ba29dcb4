"""How well the signal-power filter finds unbalance in simulated flights: the page docs/evidence_unbalance_power.md."""
import concurrent.futures
import os
import statistics

from evidence_page import ROOT, Failed, build, circumstances, page, run

SEEDS = 20
DAMAGED = 1  # the second rotor, counted from 0
EXPERIMENTS = {"small": "39 g", "small_open": "39 g, accelerometer open to 500 Hz", "medium": "690 g", "hexa": "1170 g"}
FIELDS = ("experiment", "seed", "flight", "damage", "source", "ekf_rotor", "ekf_s", "evidence_rotor", "evidence_s",
          "ekf_mg", "others_mg", "culprit_mg", "nis", "lead")
WORDS = ("experiment", "flight", "source")


def flights(job):
    name, seed = job
    done = run("nice", "-n", "10", ROOT / "build/dev/tests/unbalance_power", name, seed, 1, capture_output=True)
    if done.returncode != 0:
        raise Failed(f"unbalance_power {name} failed:\n{done.stderr}")
    return done.stdout.splitlines()


def parsed(line):
    row = dict(zip(FIELDS, line.split(";"), strict=True))
    return {key: value if key in WORDS else float(value) for key, value in row.items()}


def spread(values, digits=1):
    """Median, and what 95 % stay below."""
    if not values:
        return "–"
    ordered = sorted(values)
    highest = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
    return f"{statistics.median(ordered):.{digits}f}, {highest:.{digits}f}"


def middle(values):
    ordered = sorted(values)
    tenth = len(ordered) // 10
    return f"{statistics.median(ordered):.1f} ({ordered[tenth]:.1f} to {ordered[-1 - tenth]:.1f})"


def named(rows, method):
    """Right, wrong, none; and the times of the right ones."""
    right = [row for row in rows if row[f"{method}_rotor"] == DAMAGED]
    none = sum(row[f"{method}_rotor"] < 0 for row in rows)
    return f"{len(right)} / {len(rows) - len(right) - none} / {none}", spread([row[f"{method}_s"] for row in right])


def table(rows):
    for experiment, title in EXPERIMENTS.items():
        for flight in ("random", "circle"):
            for source in ("command", "telemetry", "telemetry, filter known"):
                same = [row for row in rows if (row["experiment"], row["flight"], row["source"]) ==
                        (experiment, flight, source)]
                damaged, healthy = ([row for row in same if (row["damage"] > 0) == is_damaged] for is_damaged in (True, False))
                ekf, ekf_s = named(damaged, "ekf")
                evidence, evidence_s = named(damaged, "evidence")
                false = " / ".join(str(sum(row[f"{method}_rotor"] >= 0 for row in healthy)) for method in ("ekf", "evidence"))
                yield (f"| {title} | {flight} | {source} | {ekf} | {ekf_s} | {evidence} | {evidence_s} | {false} | "
                       f"{damaged[0]['damage']:g} | {middle([row['ekf_mg'] for row in damaged])} | "
                       f"{middle([row['culprit_mg'] for row in damaged])} | "
                       f"{middle([row['others_mg'] for row in damaged])} | "
                       f"{statistics.mean(row['nis'] for row in healthy):.2f}, "
                       f"{statistics.mean(row['nis'] for row in damaged):.2f} |")


def unbalance_power(_):
    build("dev", "unbalance_power")
    jobs = [(name, seed) for seed in range(1, SEEDS + 1) for name in EXPERIMENTS]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = [parsed(line) for lines in pool.map(flights, jobs) for line in lines]
    write(rows)


def write(rows):
    page("evidence_unbalance_power.md", [
        "# Unbalance by signal power in simulated flights", "",
        "Written by `tools/evidence unbalance_power`: the experiments of [ghalamchi2020](equations/references.md) at *hard*",
        f"realism (`sim/realism.toml`), seeds 1 to {SEEDS}, each with another vehicle: mass, thrust, inertia and vibration",
        "response off by what that table says, every propeller with an unbalance of its own, gusts of 5 m/s. Rotor 2 lacks the",
        "mass given. The filter knows the vehicle file, and one healthy flight of the same vehicle on another plan. Flights",
        "of 60 s (39 g), 150 s (690 g) and 240 s (1170 g) after take-off.", "",
        circumstances(), "",
        "- *filter*: the extended Kalman filter; a rotor is named when it has grown by half of U₀ (1 mg, 10 mg) more than any",
        "  other since the healthy flight at the same age of the filter, for 2 s.",
        "- *evidence*: its least squares, Eq. (8); a rotor is named when its evidence is 20 ahead of every other for 2 s, not",
        "  before 15 s. Both numbers were chosen on seeds 101 to 110, which are not in this table, the 15 s also on seed 2.",
        "- r / w / –: right rotor, wrong rotor, none named. Times in s after take-off: median, 95 %.",
        "- false: healthy flights in which a rotor was named, filter / evidence.",
        "- readings at the end in mg at the tip: median (10 to 90 %); *others*: mean of the healthy rotors in the filter.",
        "- NIS: mean of healthy and of damaged flights.", "",
        "| vehicle | flight | speeds from | filter r / w / – | s | evidence r / w / – | s | false | true mg | filter reads | "
        "evidence reads | others | NIS |",
        "|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|", *table(rows), "",
        "## What it shows", "",
        "- **The prior is slow, the least squares are not.** The filter starts with every rotor at U₀ and moves by a few per cent a",
        "  second; the evidence needs no prior, and the same samples name the rotor long before.",
        "- **Absolute readings are scaled** by the vibration response (30 % per axis) and by the true mass, and the rotor's own",
        "  unbalance adds to the damage: see the spread of the readings. Both are the same before and after, so growth against",
        "  a healthy flight is what counts; the filter's healthy rotors still carry the prior at the end.",
        "- **The 39 g vehicle turns at 242 Hz**, above the 180 Hz filter of its accelerometer at *hard*. What is left of the power",
        "  goes with ω⁴/(1 + (ω/ω_c)⁴), which hardly depends on the force: the filter takes 77 % of the signal and 77 % of what",
        "  tells rotors apart. Knowing the filter from the configuration mends the reading in milligrammes, not the isolation.",
        "  With the accelerometer open to 500 Hz, all else at hard, the rotor is named in the paper's time. Sampling at 500 Hz,",
        "  of which the rotor is just below half, does no harm.",
        "- **False names** are left: evidence counts the baseline as exact, which one healthy flight does not make it. A policy must",
        "  ask for more than this rule: a mass worth an event, and agreement over flights.",
        "- **In a circle** forces vary less and in step; the answer takes longer or is not given.",
        "- Commands through the motor lag do about as well as telemetry at 100 Hz that is 8 ms late: power needs no phase."])
