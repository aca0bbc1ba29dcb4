"""Which rotor is out of balance, in simulated flights: the page docs/evidence_unbalance.md.

Flies all rows, or those of the conditions that are asked for; the others stay as the page has them, each row with its commit.
"""
import concurrent.futures
import os
import statistics

from evidence_page import ROOT, Failed, build, circumstances, output, page, run

SEEDS = 20
HOURS = 10.0
FLIGHT_S = 600.0  # of the condition "hours"
SEEN_M_S2 = 0.3  # growth that is reported
PAGE = "evidence_unbalance.md"
VEHICLES = {"small": "39 g", "medium": "690 g", "hexa": "1170 g"}
# condition: (title, manoeuvres)
CONDITIONS = {
    "in_phase": ("unbalance grown by 5 or 40 mg", ("random", "circle")),
    "in_phase_trial_mass": ("the same; calibrated with a trial mass", ("random", "circle")),
    "damaged": ("damaged at any angle", ("random", "circle")),
    "healthy": ("healthy", ("random", "circle")),
    "trial_mass": ("damaged; calibrated with a trial mass", ("random", "circle")),
    "mid_flight": ("damaged in mid-flight", ("random", "circle")),
    "two_rotors": ("two rotors damaged", ("random", "circle")),
    "file_30_heavier": ("vehicle file 30 % too heavy", ("random",)),
    "file_30_lighter": ("vehicle file 30 % too light", ("random",)),
    "late_50ms": ("telemetry 50 ms late", ("random", "circle")),
    "dropouts_20": ("20 % of the reports lost", ("random", "circle")),
    "slow_coarse": ("telemetry at 50 Hz in steps of 100 rev/min", ("random", "circle")),
    "averaged_200Hz": ("inertial data averaged, 200 Hz", ("random", "circle")),
    "averaged_200Hz_healthy": ("the same, healthy", ("random", "circle")),
    "still_air": ("hover in still air", ("hover",)),
}
ALIKE = {
    "rotors_alike": "",
    "rotors_alike_x5": " · 5",
}
NO_SPEEDS = {
    "no_speeds": ("no rotor speeds: signal power", ("random", "circle")),
    "no_speeds_healthy": ("the same, healthy", ("random", "circle")),
}
NO_SPEEDS_HEADING = "## Without rotor speeds"
FIELDS = ("condition", "vehicle", "manoeuvre", "seed", "truth", "named", "true_mg", "felt_m_s2", "reading_mg", "low_mg", "high_mg",
          "candidates", "judged_s", "confounded_s")
LISTS = ("true_mg", "felt_m_s2", "reading_mg", "low_mg", "high_mg")


def flights(job):
    vehicle, seed, chosen = job
    done = run("nice", "-n", "10", ROOT / "build/dev/evidence/unbalance_isolation", vehicle, seed, *chosen, capture_output=True)
    if done.returncode != 0:
        raise Failed(f"unbalance_isolation {vehicle} {seed} failed:\n{done.stderr}")
    return [parsed(line) for line in done.stdout.splitlines()]


def parsed(line):
    row = dict(zip(FIELDS, line.split(";"), strict=True))
    row["named"] = {int(rotor): float(time) for rotor, time in (one.split("@") for one in row["named"].split())}
    for key in ("truth", "candidates"):
        row[key] = {int(rotor) for rotor in row[key].split()}
    for key in LISTS:
        row[key] = [float(value) for value in row[key].split()]
    for key in ("judged_s", "confounded_s"):
        row[key] = float(row[key])
    # A propeller whose damage makes up for its own unbalance shakes no more than before.
    row["seen"] = {rotor for rotor in row["truth"] if row["felt_m_s2"][rotor - 1] >= SEEN_M_S2}
    row["is_hidden"] = bool(row["truth"]) and not row["seen"]
    return row


def quantile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def is_right(row):
    return bool(row["seen"]) and row["seen"] <= set(row["named"]) <= row["truth"]


def result(rows):
    """The columns of one row of the table."""
    hidden = [row for row in rows if row["is_hidden"]]
    shown = [row for row in rows if not row["is_hidden"]]
    named_wrong = sum(bool(set(row["named"]) - row["truth"]) for row in shown)
    hidden_wrong = sum(bool(set(row["named"]) - row["truth"]) for row in hidden)
    right = [row for row in shown if is_right(row)]
    nobody = sum(not row["named"] for row in shown)
    partly = len(shown) - len(right) - named_wrong - nobody
    # Of two rotors the later one counts.
    times = [max(row["named"].values()) for row in right]
    read = [(row, rotor - 1) for row in shown for rotor in row["seen"] & set(row["named"])]
    ratios = [row["reading_mg"][i] / row["true_mg"][i] for row, i in read]
    within = sum(abs(ratio - 1) <= 0.2 for ratio in ratios)
    inside = sum(row["low_mg"][i] <= row["true_mg"][i] <= row["high_mg"][i] for row, i in read)
    half = [50 * (row["high_mg"][i] - row["low_mg"][i]) / row["reading_mg"][i] for row, i in read]
    time = f"{statistics.median(times):.1f}, {quantile(times, 0.95):.1f}" if times else "–"
    mass = (f"{statistics.median(ratios):.2f} ({quantile(ratios, 0.05):.2f} to {quantile(ratios, 0.95):.2f}), "
            f"{100 * within / len(ratios):.0f} %" if ratios else "–")
    interval = f"± {statistics.median(half):.0f} %, {100 * inside / len(read):.0f} %" if read else "–"
    counts = f"{len(right)} / {named_wrong} / {partly} / {nobody}"
    return (f"{len(shown)} | {counts} | {sum(bool(row['candidates']) for row in shown)} | {time} | {mass} | {interval} | "
            f"{f'{len(hidden)}, {hidden_wrong}' if rows[0]['truth'] else '–'}")


def table(rows, conditions, kept, commit):
    """Rows of the table, those not flown as the page has them."""
    for condition, (title, manoeuvres) in conditions.items():
        for manoeuvre in manoeuvres:
            for vehicle, mass in VEHICLES.items():
                start = f"| {title} | {manoeuvre} | {mass} |"
                same = [row for row in rows
                        if (row["condition"], row["manoeuvre"], row["vehicle"]) == (condition, manoeuvre, vehicle)]
                old = [line for line in kept if line.startswith(start)]
                if same:
                    yield f"{start} {result(same)} | {commit} |"
                elif old:
                    yield old[0]


def alike_table(rows, kept, commit):
    for condition, times in ALIKE.items():
        for vehicle, mass in VEHICLES.items():
            start = f"| {mass}{times} |"
            same = [row for row in rows if (row["condition"], row["vehicle"]) == (condition, vehicle)]
            if not same:
                old = [line for line in kept if line.startswith(start)]
                if any(line.count("|") != ALIKE_HEADER[0].count("|") for line in old):
                    raise Failed(f"{PAGE}: the row '{start}' has other columns: fly it again, --rows {' '.join(ALIKE)}")
                yield from old
                continue
            seen = [row for row in same if row["seen"]]
            hidden = [row for row in same if not row["seen"]]
            wrong = sum(bool(set(row["named"]) - row["truth"]) for row in same)
            named = sum(bool(row["named"]) for row in same)
            several = [row for row in seen if len(row["candidates"]) > 1]
            hidden_several = sum(len(row["candidates"]) > 1 for row in hidden)
            listed = sum(row["truth"] <= row["candidates"] for row in several)
            one = sum(len(row["candidates"]) == 1 for row in same)
            cannot = sum(row["confounded_s"] for row in same) / sum(row["judged_s"] for row in same)
            size = f"{statistics.mean(len(row['candidates']) for row in several):.1f}" if several else "–"
            yield (f"{start} {len(same)} | {named}, {wrong} | {one} | {len(several)} of {len(seen)} | {listed} | {size} | "
                   f"{hidden_several} of {len(hidden)} | "
                   f"{100 * cannot:.1f} % | {commit} |")


def hours_table(rows, kept, commit):
    for vehicle, mass in VEHICLES.items():
        same = [row for row in rows if row["condition"] == "hours" and row["vehicle"] == vehicle]
        if not same:
            yield from [line for line in kept if line.startswith(f"| {mass} |")]
            continue
        flown_h = len(same) * FLIGHT_S / 3600
        alarms = sum(len(row["named"]) + bool(row["candidates"]) for row in same)
        # 95 % upper limit of a Poisson rate with no event, else its rough one.
        limit = 3.0 / flown_h if alarms == 0 else (alarms + 2 * alarms**0.5 + 2) / flown_h
        yield (f"| {mass} | {flown_h:.1f} | {sum(row['judged_s'] for row in same) / 3600:.1f} | {alarms} | "
               f"{limit:.2f} | {commit} |")


def kept_sections():
    """Heading: lines of the page as it is."""
    sections, heading = {}, ""
    path = ROOT / "docs" / PAGE
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        heading = line if line.startswith("## ") else heading
        sections.setdefault(heading, []).append(line)
    return sections


def jobs_of(chosen, vehicles, seeds):
    plans = {**CONDITIONS, **{condition: ("", ("hover",)) for condition in ALIKE}, **NO_SPEEDS}
    words = [f"{condition}:{manoeuvre}" for condition, (_, manoeuvres) in plans.items() for manoeuvre in manoeuvres
             if condition in chosen]
    if words:
        yield from ((vehicle, seed, words) for seed in range(1, seeds + 1) for vehicle in vehicles)
    if "hours" in chosen:
        for seed in range(round(HOURS * 3600 / FLIGHT_S)):
            yield from ((vehicle, 1000 + seed, [f"hours:{('random', 'circle', 'hover')[seed % 3]}"]) for vehicle in vehicles)


HEADER = ["| experiment | manoeuvre | vehicle | flights | r / w / p / – | amb. | s | reading / true | stated, holds | hidden, w | commit |",
          "|---|---|---|--:|--:|--:|--:|--:|--:|--:|---|"]


ALIKE_HEADER = ["| vehicle | flights | named, wrong | one listed | reported | with it | listed | hidden | cannot isolate | commit |",
                "|---|--:|--:|--:|--:|--:|--:|--:|--:|---|"]


def unbalance(arguments):
    known = [*CONDITIONS, *ALIKE, *NO_SPEEDS, "hours"]
    chosen = known if arguments.rows is None else arguments.rows
    unknown = [condition for condition in chosen if condition not in known]
    if unknown:
        raise Failed(f"no rows called {', '.join(unknown)}; there are {', '.join(known)}")
    vehicles = arguments.vehicles or VEHICLES
    if unknown := [vehicle for vehicle in vehicles if vehicle not in VEHICLES]:
        raise Failed(f"no vehicle called {', '.join(unknown)}; there are {', '.join(VEHICLES)}")
    build("dev", "unbalance_isolation")
    where, commit = circumstances(), output("git", "rev-parse", "--short=8", "HEAD")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = [row for found in pool.map(flights, jobs_of(chosen, vehicles, arguments.flights or SEEDS)) for row in found]
    kept = kept_sections()
    newest = f"Newest rows: {where}"
    if not rows:
        newest = next((line for line in kept.get("", []) if line.startswith("Newest rows: ")), newest)
    write(rows, kept, newest, commit)


def write(rows, kept, newest, commit):
    no_speeds = list(table(rows, NO_SPEEDS, [], commit))
    page(PAGE, [
        "# Unbalance in simulated flights", "",
        "Written by `tools/evidence unbalance`: the experiments of [ghalamchi2020](equations/references.md) at *hard* realism",
        "(`sim/realism.toml`), each seed another vehicle, judged by the unbalance monitor as the service runs it:",
        "order tracking on telemetry (100 Hz, 8 ms late with 3 ms of jitter, 0.3 % noise, steps of 15 rev/min), calibrated on a",
        "healthy flight of 60 s of the same vehicle in other gusts (180 s where a rotor could be judged for less than 20 s of that).",
        "Damage is 5 mg at the tip of the 39 g vehicle, else 40 mg, of a rotor that changes with the seed. In the first rows it adds",
        "to the unbalance that every propeller has of its own in phase, so that this grows by the whole of it; in the others it is at any",
        "angle to that. 40 s of flight, 120 s without rotor speeds. One set of parameters for all three: growth of 0.3 m/s² at hover",
        "is reported. Seeds 1 to 20.", "",
        newest, "",
        "**What is the truth.** A propeller with the unbalance n that loses the mass d shakes by |n + d|, in the plane of the",
        "rotor. The monitor knows |n| from the calibration and sees |n + d|, as the phase of a rotor begins anywhere in each flight:",
        "the true growth is |n + d| − |n|, in mg at the tip. Damage that lies opposite to n makes up for it. Flights whose growth",
        f"is less than the {SEEN_M_S2:g} m/s² that are looked for are *hidden* and counted apart, with those that named a rotor which",
        "has no damage.", "",
        "- r / w / p / –: the right rotor or rotors and no other; a wrong one; a part of them; nobody. *amb.*: flights in which",
        "  an unbalance was reported that could not be pinned on a rotor.",
        "- s: from being in flight, or from the onset: median, 95 %.",
        "- Reading / true growth at the end of the flight: median (5 to 95 %), share within 20 %.",
        "- stated, holds: half of the 95 % interval that is given with the reading, median; share of the flights in which the truth",
        "  is inside.", "",
        *HEADER, *table(rows, CONDITIONS, kept.get("", []), commit), "",
        "The accelerometer is not in the centre of mass, and the force at a hub turns the vehicle: on the 39 g vehicle what is felt of a",
        "rotor differs by up to 16 % of an axis for that alone. `rigid_body_response.h` takes that from the vehicle file; without it",
        "readings after a trial on rotor 1 would be low by 6 to 12 % on every other rotor. What is left is how unevenly the",
        "airframe answers its axes, which is in the stated interval. Without a trial mass the reading carries the error of the",
        "vehicle file: at *hard* the airframe answers with 30 % more or less in either axis and the mass is 10 % off. Two flights",
        "with a known mass, once on either blade (`airworthy calibrate unbalance --trial`), measure both.", "",
        "Nobody is named for growth near the 0.3 m/s² that are looked for: it must exceed them by two sigma and by what a neighbour may",
        "leak. 40 mg are 0.9 m/s² on the 1170 g vehicle beside propellers of 1 m/s² rms, so that many of its flights are of that kind,",
        "or hidden; on the 39 g vehicle 5 mg are 8 m/s² and hardly depend on the angle.", "",
        "Averages over 5 ms leave 16 % of the 242 Hz at which the 39 g vehicle turns, its accelerometer half of that, and 200 samples a",
        "second fold it to 42 Hz, among the motion of the vehicle: 8 % of the amplitude. Its healthy propellers cannot be judged (the",
        "status says that the inertial data are unfit, and `airworthy calibrate unbalance` refuses), so that it flies uncalibrated",
        "there: readings are of the whole unbalance, and a healthy propeller beyond 0.9 m/s² is reported if it is",
        "seen (seed 2, 2.4 m/s²: the wrong rotor here and, for the same reason, at 50 Hz). Damage of 8 m/s² is told all the same. The larger vehicles turn at 75 to 80 Hz, of which the average",
        "leaves 79 %: they lose nothing but some time.", "",
        *kept_no_speeds(no_speeds, kept),
        "## Rotors of one speed", "",
        "Hover in still air of a vehicle whose rotors are alike (`airworthy sim --rotors-alike`), calibrated in flight as above; damage as",
        "above, and five times that. Rotors of one speed have one phase: which of them shakes cannot be told, only that those of",
        "one sense make more together than they could as calibrated, the sum of their baselines, however they stand. Less than",
        "that is hidden by nature: healthy propellers shake alike when theirs happen to point one way.", "",
        "- named, wrong: flights in which one rotor was blamed; the wrong one. *one listed*: an unbalance reported with a single rotor.",
        "- reported: flights in which an unbalance was reported that may be one of several rotors, of those with growth above",
        f"  {SEEN_M_S2:g} m/s². *with it*: of the reported, those whose list has the damaged rotor. *listed*: rotors listed, mean.",
        "- hidden: the same reports of flights whose damage makes up for the propeller's own unbalance, of all such flights.",
        "- cannot isolate: share of the time in which the status says so, with the rotors that turn alike.", "",
        *ALIKE_HEADER, *alike_table(rows, kept.get("## Rotors of one speed", []), commit), "",
        "Five times the damage shakes the 690 g vehicle so that its rate loop drives the two senses at speeds up to 8 rad/s apart, and",
        "those of one sense at some 0.3 rad/s: a rotor named there was named in the first seconds of such a flight. A list without",
        "the damaged rotor is of the other sense: an airframe more uneven than its baselines showed.", "",
        "## False alarms", "",
        "Healthy flights of 10 minutes, calibrated as above, gusts of 5 m/s mean wind, random, circle and hover in turn.", "",
        "| vehicle | hours flown | hours judged | alarms | per hour, 95 % upper limit | commit |", "|---|--:|--:|--:|--:|---|",
        *hours_table(rows, kept.get("## False alarms", []), commit)])


def kept_no_speeds(flown, kept):
    """The section as the page has it, unless it was flown."""
    if not flown:
        return kept.get(NO_SPEEDS_HEADING, [])
    return [NO_SPEEDS_HEADING, "", "Damage in phase with the propeller's own unbalance.", "", *HEADER, *flown, ""]
