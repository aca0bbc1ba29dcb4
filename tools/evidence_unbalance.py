"""How well the signal-power filter finds unbalance in simulated flights: the page docs/evidence_unbalance_power.md."""
import concurrent.futures
import os
import statistics

from evidence_page import ROOT, Failed, build, circumstances, page, run

SEEDS = 20
DAMAGED = 1  # the second rotor, counted from 0
EXPERIMENTS = {"small": "39 g", "medium": "690 g", "hexa": "1170 g"}
FIELDS = ("experiment", "seed", "flight", "damage", "source", "paper_rotor", "paper_s", "bands_rotor", "bands_s", "bands_more",
          "paper_mg", "bands_mg", "nis")
WORDS = ("experiment", "flight", "source")
PAPER_S = {"small": 15.0, "medium": 100.0}  # the paper's times


def flights(job):
    name, seed = job
    done = run("nice", "-n", "10", ROOT / "build/dev/evidence/unbalance_power", name, seed, 1, capture_output=True)
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


def in_time(rows, experiment):
    """Of the damaged flights, those in which the bands name the rotor within the paper's time."""
    if experiment not in PAPER_S:
        return "–"
    within = sum(row["bands_rotor"] == DAMAGED and row["bands_s"] <= PAPER_S[experiment] for row in rows)
    return f"{within} in {PAPER_S[experiment]:.0f} s"


def table(rows):
    for experiment, title in EXPERIMENTS.items():
        for flight in ("random", "circle"):
            for source in ("command", "telemetry"):
                same = [row for row in rows if (row["experiment"], row["flight"], row["source"]) ==
                        (experiment, flight, source)]
                damaged, healthy = ([row for row in same if (row["damage"] > 0) == is_damaged] for is_damaged in (True, False))
                paper, paper_s = named(damaged, "paper")
                bands, bands_s = named(damaged, "bands")
                false = " / ".join(str(sum(row[f"{method}_rotor"] >= 0 for row in healthy)) for method in ("paper", "bands"))
                more = sum(row["bands_more"] for row in damaged)
                yield (f"| {title} | {flight} | {source} | {paper} | {paper_s} | {bands} | {bands_s} | "
                       f"{in_time(damaged, experiment)} | {more:.0f} | {false} | "
                       f"{damaged[0]['damage']:g} | {middle([row['paper_mg'] for row in damaged])} | "
                       f"{middle([row['bands_mg'] for row in damaged])} | "
                       f"{statistics.mean(row['nis'] for row in healthy):.2f}, "
                       f"{statistics.mean(row['nis'] for row in damaged):.2f} |")


def unbalance_power(arguments):
    build("dev", "unbalance_power")
    seeds = arguments.flights or SEEDS
    jobs = [(name, seed) for seed in range(1, seeds + 1) for name in EXPERIMENTS]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = [parsed(line) for lines in pool.map(flights, jobs) for line in lines]
    write(rows, seeds)


def write(rows, seeds):
    page("evidence_unbalance_power.md", [
        "# Unbalance by signal power in simulated flights", "",
        "Written by `tools/evidence unbalance_power`: the experiments of [ghalamchi2020](equations/references.md) at *hard*",
        f"realism (`sim/realism.toml`), seeds 1 to {seeds}, each with another vehicle: mass, thrust, inertia and vibration",
        "response off by what that table says, every propeller with an unbalance of its own, gusts of 5 m/s. Rotor 2 lacks the",
        "mass given. The filters know the vehicle file, and one healthy flight of the same vehicle on another plan; the bands",
        "also the low-pass of the accelerometer. Flights of 60 s (39 g), 150 s (690 g) and 240 s (1170 g) after take-off.", "",
        circumstances(), "",
        "- *paper*: the source's extended Kalman filter on the power of the whole vibration; it leaves the decision open: a rotor",
        "  is named when it has grown by half of U₀ (1 mg, 10 mg) more than any other since the healthy flight at the same age",
        "  of the filter, for 2 s.",
        "- *bands*: the filter in bands that follow the rotors (`core/estimators/unbalance/rotor_bands.h`), named by the rule of",
        "  `core/detectors/unbalance/power_policy.h`, as in the monitor. Its numbers were chosen on seeds 101 to 110.",
        "- r / w / –: the first rotor named is right, wrong, none is named. Times in s after take-off: median, 95 %. *in time*:",
        "  right within the paper's time. *more*: another rotor is named after the right one.",
        "- false: healthy flights in which a rotor was named, paper / bands.",
        "- growth of the damaged rotor since the healthy flight as read at the end, mg at the tip: median (10 to 90 %).",
        "- NIS of the paper's filter: mean of healthy and of damaged flights.", "",
        "| vehicle | flight | speeds from | paper r / w / – | s | bands r / w / – | s | in time | more | false | true mg | "
        "paper reads | bands read | NIS |",
        "|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|", *table(rows), "",
        *REMARKS])


REMARKS = (
    "## What it shows", "",
    "- **Frequencies tell rotors apart, forces hardly do.** The power of the whole vibration goes with ω⁴, and forces of all",
    "  rotors vary together. In hover at *hard* the speeds of the rotors differ by several per cent, more than a band is wide,",
    "  and each rotor is read by itself.",
    "- **The 39 g vehicle turns at 242 Hz**, above the 180 Hz filter of its accelerometer and just below half of its rate. What",
    "  is left of the power goes with ω⁴/(1 + (ω/ω_c)⁴), which hardly depends on the force: the paper's filter has nothing to",
    "  go by. In bands the rotor is named within the paper's time; the sense of rotation splits the rotors further, even where",
    "  one sense is seen beyond half the rate.",
    "- **Commands do** instead of telemetry, at some cost: their errors, about 1 % of the speed, widen the lines, and the sag of",
    "  the battery (1 % a minute) is followed as a scale that all rotors share.",
    "- **Readings are scaled** by the vibration response (30 % per axis), by the true mass, and by how well the speeds are known:",
    "  a line narrower than a band reads high, a wider one low. All are the same before and after; growth has their scale.", "",
    "## Remaining limits", "",
    "- Two rotors of one sense that turn within a band of each other pass for each other until they part. On the six rotors of",
    "  the 1170 g vehicle in a circle at steady speed some never part in the time flown, and no name is given.",
    "- The scale of the speeds is found from about 3 % away. From further off, a strong line may be taken for that of another",
    "  rotor and the scale be drawn to it: where one rotor alone shakes, a wrong scale and a wrong rotor explain the same.",
    "- A band holds a line to about 2 % of its frequency. Speeds that are wrong for one rotor alone by more than that hide it.",
    "- The baseline is one healthy flight and counts as exact. What that flight dealt out wrongly between two rotors that turned",
    "  alike, the next may deal out otherwise: of this come the names of healthy rotors.",
)
