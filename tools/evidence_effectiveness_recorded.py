"""Evidence for the detector of lost effectiveness on recorded flights: what was judged, what was found without rotor
speeds, and healthy flights with a rotor scaled out."""
import collections
import csv
import json
import lzma
import os
import pathlib

from evidence_effectiveness import PROGRAMS, delay_row, delays, flown, quantile
from evidence_page import ROOT, Failed, build, circumstances, page, run

CONFIG = ROOT / "config/effectiveness.toml"
FOLDER = ROOT / "build/evidence/effectiveness_recorded"
THROWS = ("00230 00257 00261 00266 00271 00276 00279 00340", "00232 00259 00264 00267 00273 00277 00281 00342")
CRAZYFLIES = ("1", "2", "4")
RFLYMAD = {"HIL": ("1_2000000000", "3_2000000002", "5_2000000004", "7_2000000006"),
           "SIL": ("1_1000000000", "3_1000000002", "5_1000000004", "7_1000000006")}
# What is not as in config/effectiveness.toml: the vehicle file, and keys.
OVERRIDES = {
    "thrown quadrotors": ("indiflight_throw",),
    "Crazyflie": ("crazyflie_brushless", "input.imu_rate_Hz=80", "input.inertial_delay_learned=true"),
    "Bebop": ("bebop2", "input.telemetry_latency_ms=0", "input.rotor_mapping_checked=true"),
    "PX4 HIL": ("rflymad", "input.imu_rate_Hz=225"),
    "PX4 SIL": ("rflymad", "input.imu_rate_Hz=180")}
CALIBRATED_ON = {"thrown quadrotors": "the other half of the set", "Crazyflie": "the two other runs",
                 "Bebop": "nothing: as its vehicle file describes it", "PX4 HIL": "the three other HIL runs",
                 "PX4 SIL": "all four HIL runs"}
LOSSES = ("0.2", "0.3", "0.4", "0.6", "1.0")
SIMULATED = 240
HEALTHY = ("healthy", 0, 120, 2, 60)


def options_of(flights):
    vehicle, *keys = OVERRIDES[flights]
    words = [f"vehicle={ROOT}/config/vehicles/{vehicle}.toml", *keys]
    return [word for one in words for word in ("--set", one)]


def override_lines():
    lines = ["| flights | vehicle file | other keys set | calibrated on |", "|---|---|---|---|"]
    for flights, (vehicle, *keys) in OVERRIDES.items():
        lines.append(f"| {flights} | {vehicle}.toml | {', '.join(f'`{key}`' for key in keys) or '–'} | {CALIBRATED_ON[flights]} |")
    return lines


def imported(source, name):
    log = FOLDER / f"{source.name.split('.')[0]}.lcm"
    if run(PROGRAMS / "airworthy-import", "table", source, "--map", ROOT / f"config/import/{name}.toml", "-o", log,
           capture_output=True).returncode != 0:
        raise Failed(f"cannot import {source}")
    return log


def calibrated(logs, options, name):
    """The calibration file, and what was printed on learning it."""
    target = FOLDER / f"{name}.toml"
    done = run(PROGRAMS / "airworthy-calibrate", "effectiveness", *logs, "--config", CONFIG, *options, "-o", target,
               capture_output=True)
    if done.returncode != 0:
        raise Failed(done.stderr)
    return target, done.stdout.splitlines()


def evaluated(logs, options, calibration=None):
    taught = ["--set", f"calibration={calibration}"] if calibration else []
    done = run(PROGRAMS / "airworthy-eval", *logs, "--detector", "effectiveness", "--config", CONFIG, *options, *taught,
               "--json", capture_output=True)
    if done.returncode != 0:
        raise Failed(done.stderr)
    return json.loads(done.stdout)["flights"]


def scaled_out(log, options, judging, truth):
    done = run(ROOT / "build/dev/bin/scaled_out_evidence", CONFIG, judging, truth, log,
               *[word for word in options if word != "--set"], capture_output=True)
    if done.returncode != 0:
        raise Failed(done.stderr)
    return [line.split() for line in done.stdout.splitlines()]


def muted_lines(flights):
    """A table of sums, and below it the intervals."""
    causes = list(dict.fromkeys(cause["why"] for flight in flights for cause in flight["muted"]))
    short = {cause: chr(ord("a") + i) for i, cause in enumerate(causes)}
    lines = [f"| flight | s | judged | alarms | {' | '.join(short.values())} |", f"|---|--:|--:|--:|{'--:|' * len(causes)}"]
    for flight in flights:
        seconds = {cause["why"]: cause["seconds"] for cause in flight["muted"]}
        cells = " | ".join(f"{seconds[cause]:.2f}" if cause in seconds else "" for cause in causes)
        alarms = "; ".join(f"{alarm['component']} {alarm['fault_kind']}" for alarm in flight["alarms"]) or "none"
        lines.append(f"| {flight['flight']} | {flight['duration_s']:.1f} | {flight['judged_s']:.2f} | {alarms} | {cells} |")
    lines += [""] + [f"- {letter}: {cause}" for cause, letter in short.items()]
    lines += ["", "Which seconds, from the start of the flight:", "", "```"]
    for flight in flights:
        lines.append(flight["flight"])
        for cause in flight["muted"]:
            spans = " ".join(f"{a:.2f}-{b:.2f}" for a, b in cause["intervals_s"])
            lines.append(f"  {short[cause['why']]}: {spans}")
    return lines + ["```"]


def scaled_lines(rows):
    lines = ["| lost | cases | found | median ms | 95 % | most | wrong rotor | not found | k read, mean ± deviation | k true |",
             "|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for loss in LOSSES:
        cases = [row for row in rows if row[0] == "scaled" and row[4] == loss]
        right = [row for row in cases if row[5] == row[3]]
        wrong = [row for row in cases if row[5] not in ("-", row[3])]
        times = [float(row[6]) for row in right]
        read = [float(row[8]) for row in right]
        centre = sum(read) / len(read)
        spread = (sum((k - centre) ** 2 for k in read) / len(read)) ** 0.5
        lines.append(f"| {loss} | {len(cases)} | {len(right)} | {quantile(times, .5):.0f} | {quantile(times, .95):.0f} | "
                     f"{max(times):.0f} | {len(wrong)} | {len(cases) - len(right) - len(wrong)} | "
                     f"{centre:.2f} ± {spread:.2f} | {1 - float(loss):.1f} |")
    healthy = [row for row in rows if row[0] == "healthy"]
    onsets = len({(row[1], row[2]) for row in rows if row[0] == "scaled"})
    return lines + ["", f"{onsets} onsets in {len(healthy)} flights; {sum(int(row[4]) for row in healthy)} more were left out, "
                    f"as nothing was judged then. False alarms before the onset: {sum(int(row[3]) for row in healthy)} in "
                    f"{sum(float(row[2]) for row in healthy):.0f} s judged."]


def motion(run_folder, label_us):
    """When after the label the body first moves (roll rate leaves 6 sigma for three samples), and what share of one rotor's
    thrust the accelerometer misses 20 to 30 ms later."""
    with lzma.open(run_folder / "imu.csv.xz", "rt") as table:
        rows = [(float(row["t_us"]) - label_us, float(row["gx_radps"]), float(row["az_mps2"])) for row in csv.DictReader(table)]
    calm = [row for row in rows if -3e6 < row[0] < -0.3e6]
    mean = sum(row[1] for row in calm) / len(calm)
    sigma = (sum((row[1] - mean) ** 2 for row in calm) / len(calm)) ** 0.5
    weight = sum(row[2] for row in calm) / len(calm)
    late = [row for row in rows if row[0] > -0.3e6]
    first = next(k for k in range(len(late)) if all(abs(row[1] - mean) > 6 * sigma for row in late[k:k + 3]))
    start_us = late[first][0]
    felt = [row[2] for row in late if 20e3 <= row[0] - start_us <= 30e3]
    return start_us / 1e3, (sum(felt) / len(felt) - weight) / (-weight / 4)


def rflymad(data):
    with open(data / "index.csv", encoding="utf-8") as table:
        index = {row["run"]: row for row in csv.DictReader(table)}
    logs = {kind: [imported(data / f"TestCase_{name}", "rflymad_sim") for name in names] for kind, names in RFLYMAD.items()}
    options = {kind: options_of(f"PX4 {kind}") for kind in RFLYMAD}
    flights, said = [], []
    for log in logs["HIL"]:
        target, printed = calibrated([other for other in logs["HIL"] if other != log], options["HIL"], "hil")
        flights += evaluated([log], options["HIL"], target)
        said = said or printed
    target, _ = calibrated(logs["HIL"], options["HIL"], "hil")
    flights += evaluated(logs["SIL"], options["SIL"], target)
    lines = ["| run | gain by the label | ms after the label | the body moves at, ms | ms after that | rotor | k read | "
             "k by the accelerometer |", "|---|--:|--:|--:|--:|---|---|--:|"]
    for flight in flights:
        row = index[flight["flight"]]
        moves_ms, missing = motion(data / flight["flight"], float(row["fault_t_us"]))
        first = flight["alarms"][0] if flight["alarms"] else None
        after_ms = (first["time_us"] - flight["onset_us"]) / 1e3 if first else float("nan")
        read = ", ".join(f"{alarm['magnitude']:.2f}" for alarm in flight["alarms"])
        lines.append(f"| {row['hw']} {flight['flight']} | {row['motor1_gain']} | {after_ms:.0f} | {moves_ms:.0f} | "
                     f"{after_ms - moves_ms:.0f} | {', '.join(alarm['component'] for alarm in flight['alarms'])} | {read} | "
                     f"{1 - missing:.2f} |")
    return lines, flights, said


def simulated_lines():
    lines = ["| flights | n | median ms | 95 % | 99 % | most | missed | before the fault | wrong rotor |",
             "|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for name, options in (("reported", ()), ("commands alone", ("--without-telemetry",))):
        lines.append(delay_row(f"propeller lost, {name}", flown(f"lost_{name.split()[0]}", ("lost", 0, SIMULATED), options), 6))
        for loss in ("0.2", "0.3", "0.6"):
            rows = flown(f"partial_{loss}_{name.split()[0]}", ("partial", 0, 40, loss), options)
            lines.append(delay_row(f"{float(loss):.0%} lost, {name}", rows, 6))
    rows = flown("healthy_commands", HEALTHY, ("--without-telemetry",))
    alarms = sum(float(row[6]) for row in rows)
    per_vehicle = collections.Counter(row[1] for row in rows)
    return lines + ["", f"Healthy, commands alone: {sum(float(row[4]) for row in rows) / 3600:.2f} h judged in {len(rows)} flights "
                    f"of {len(per_vehicle)} vehicles, {alarms:.0f} false alarms."]


def throws(data):
    options = options_of("thrown quadrotors")
    halves = [[imported(data / f"LOG{n}.csv.xz", "indiflight_throw") for n in half.split()] for half in THROWS]
    taught = [calibrated(half, options, f"half_{k}") for k, half in enumerate(halves)]
    flights, rows = [], []
    for k, half in enumerate(halves):
        flights += evaluated(half, options, taught[1 - k][0])
        for log in half:
            rows += scaled_out(log, options, taught[1 - k][0], taught[k][0])
    return flights, rows, [line for _, said in taught for line in said]


def crazyflies(data):
    options = options_of("Crazyflie")
    logs = {n: imported(data / f"square_run{n}.csv.xz", "crazyflie_brushless_rpm") for n in CRAZYFLIES}
    flights, rows, said = [], [], []
    for n, log in logs.items():
        others, printed = calibrated([other for m, other in logs.items() if m != n], options, f"without_{n}")
        flights += evaluated([log], options, others)
        # One flight alone teaches its vertical axis too little, so that all three are what is scaled out.
        truth, _ = calibrated(logs.values(), options, "all_runs")
        rows += scaled_out(log, options, others, truth)
        said += printed
    return flights, rows, said


def bebop(data):
    options = options_of("Bebop")
    return evaluated([imported(data / "flight01_11-43-10.csv.xz", "bebop2_prop_eject")], options)


def effectiveness_recorded(_):
    data = pathlib.Path(os.environ.get("AIRWORTHY_DATA", ROOT / "../shared/data"))
    if not data.is_dir():
        raise Failed(f"no recorded flights in {data}: set AIRWORTHY_DATA")
    for target in ("effectiveness_evidence", "scaled_out_evidence", "airworthy-import", "airworthy-calibrate", "airworthy-eval"):
        build("dev", target)
    FOLDER.mkdir(parents=True, exist_ok=True)
    thrown, thrown_rows, thrown_said = throws(data / "indiflight_throw")
    small, small_rows, small_said = crazyflies(data / "crazyflie_brushless_rpm")
    ejected = bebop(data / "bebop2_prop_eject")
    table, simulated, simulated_said = rflymad(data / "rflymad_sim")
    alarm = ejected[0]["alarms"][0]
    after_ms = (alarm["time_us"] - ejected[0]["onset_us"]) / 1e3
    page("evidence_effectiveness_recorded.md", [
        "# Lost propellers and partial losses: recorded flights", "",
        "Written by `tools/evidence effectiveness_recorded`; the sets are described beside the data. Simulated flights are",
        "those of [evidence_effectiveness.md](evidence_effectiveness.md).", "", circumstances(), "",
        "## What is set", "",
        "`config/effectiveness.toml`, but for what it must be told of each vehicle and its link:", "",
        *override_lines(), "",
        "A calibration replaces the latencies of the configuration, and shows how the rotors are numbered if roll and pitch were",
        "excited. The Bebop only hovers before the ejection, so nothing of its motion can show that: without",
        "`rotor_mapping_checked=true` it would be muted to the end. The simulated flights at hard are told latencies of 5 and",
        "10 ms and that the numbering is known.", "",
        "## What was judged, and what was not", "",
        "Every healthy flight is judged after a calibration on other flights: the throws on the other half of their set, each",
        "Crazyflie run on the two others. Until their fault, the simulated PX4 runs are healthy flights too; after it they are",
        "muted by the loss. The table is that of `airworthy eval --muted`. The rules for collisions were made on seeing alarms in",
        "two of the throws (LOG00230, LOG00340), and the uncertainty of stamps of arrival on seeing them in the Crazyflie's.", "",
        *muted_lines(thrown + small + ejected + simulated), "",
        "The Crazyflie sends 69 to 91 inertial samples a second by radio. That rate is no limit of physics: losses are found at it",
        "below. What hid them was time: stamps are those of arrival, the inertial ones 3 to 30 ms later than those of the speeds,",
        "another delay in every flight. It is learned in flight (`input.inertial_delay_learned`), for which the detector waits 2 to",
        "3 s of manoeuvres, and a stamp is taken to be uncertain by half a step. Below 50 samples a second nothing is judged: the",
        "filters of the axes hold for steps of up to 50 ms, and the usual gaps of such a stream, two or three samples, are longer.", "",
        "One cause is no physics: from 1.7 to 2.5 s the throws are 3 m high, turning by up to 20 rad/s in pulses of single motors,",
        "and the flight phase takes what it cannot explain of the accelerometer there for the ground (landing, 0.4 to 0.8 s each).",
        "",
        "What the calibrations learned:", "", "```", *thrown_said, *small_said, "```", "",
        "## A propeller that came off", "",
        f"The Bebop, as its vehicle file describes it: {alarm['component']} {alarm['fault_kind']}, {after_ms:.0f} ms after 12.39 s, "
        f"{after_ms - 60:.0f} ms after 12.45 s,",
        "between which the propeller left; nothing before.", "",
        "## Without rotor speeds", "",
        "The simulated PX4 runs have commands alone: the thrust is predicted from them through lag and delay, which `calibrate`",
        "learned from other hardware-in-the-loop flights. The software-in-the-loop runs log ten commands a second: too few to",
        "learn from (refused), enough to judge by. The label is when the injection was logged; the body begins to move before it,",
        "so delays also count from its first motion (roll rate beyond 6 sigma). Whatever the label's gain, the body shows about the",
        "same loss: the accelerometer, 20 to 30 ms after the first motion, misses what the last column says of one rotor of four.",
        "The gain cannot be a share of thrust. k is read 30 to 60 ms after the first motion, when the last drops are still under way:",
        "0.2 to 0.4, then less, in all runs alike; like the accelerometer it does not follow the label.", "", *table, "",
        "Learned for the first of them:", "", "```", *simulated_said, "```", "",
        "Simulated at hard, the same flights with reported speeds and with commands alone, uncalibrated:", "",
        *simulated_lines(), "",
        "## One rotor scaled out of real healthy flights", "",
        "From an onset on, (1 − k) times what rotor i contributes is taken from the recorded inertial data: from roll, pitch and",
        "yaw rate by integrating its angular acceleration with Euler's equations, from the accelerometer its force. What it",
        "contributes is B·ω² with the reported speed and the effectiveness learned from the flight's own half of the set (the",
        "Crazyflie: from all three runs); the detector is calibrated on the other half (the two other runs). Real are noise,",
        "vibration, gusts, telemetry and manoeuvres. Not real is that nothing answers: neither controller nor air nor the freed motor.",
        "After 0.1 s a rotor's whole loss is 10 rad/s and more of error that a vehicle would not have; so only alarms within 0.5 s",
        "count, and of great losses only the first tenths say anything. An onset each second wherever something was judged, all",
        "rotors, so all manoeuvres of the set, free fall just ahead included. Delays count from the stamp of the first changed sample.",
        "What is changed passes no filter of a sensor and begins within a sample: a real loss takes some milliseconds more.",
        "What fits a lost propeller is said at once; a partial loss only after 30 ms.", "",
        "The thrown quadrotors, 504 samples a second:", "", *scaled_lines(thrown_rows), "",
        "The Crazyflie, 69 to 91 samples a second:", "", *scaled_lines(small_rows)])
