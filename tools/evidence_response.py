"""How well the response detector does on recorded flights: the pages docs/evidence_alfa.md and evidence_response_sets.md."""
import csv
import json
import lzma
import os
import pathlib
import tempfile
import time

from evidence_page import ROOT, Failed, build, circumstances, page, run

FLIGHT = r"(\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d)"  # parts of one flight share the time it began
BINARIES = ROOT / "build/release/bin"
NOT_JUDGED = 66  # airworthy eval: of a flight nothing was judged
AFTER_FAULT_S = 10.0  # an alarm so soon after a fault was taken back is still its alarm


def recorded_data():
    folder = pathlib.Path(os.environ.get("AIRWORTHY_DATA") or ROOT.parent / "shared/data")
    if not folder.is_dir():
        raise Failed(f"no recorded flights in {folder} (set AIRWORTHY_DATA)")
    return folder


def tool(name, *arguments, accepted=(0,)):
    done = run(BINARIES / f"airworthy-{name}", *arguments, capture_output=True)
    if done.returncode not in accepted:
        raise Failed(f"airworthy {name} failed:\n{done.stderr}")
    return done.stdout


def described(vehicle):
    """Names a shipped vehicle's file to evaluate()."""
    return "--set", f"vehicle={ROOT / 'config/vehicles' / vehicle}.toml"


def evaluate(vehicle, config, logs, *options):
    return json.loads(tool("eval", "--json", "--vehicle", vehicle, "--config", ROOT / "config" / config, *options, *logs,
                           accepted=(0, NOT_JUDGED)))


def number(value, digits=2):
    return "–" if value is None else f"{value:.{digits}f}"


def totals_row(name, source, result):
    totals = result["totals"]
    low, high = totals["false_alarms_per_hour_95"]
    counts = " | ".join(str(totals[key]) for key in ("tp", "named_right", "named_another", "fp", "fn", "tn", "not_judged"))
    return (f"| {name} | {source} | {counts} | "
            f"{number(totals['precision'])} | {number(totals['recall'])} | {number(totals['accuracy'])} | "
            f"{totals['found_within_10_s']} | {number(totals['median_delay_s'])}, {number(totals['mean_delay_s'])}, "
            f"{number(totals['max_delay_s'])} | {number(totals['false_alarms_per_hour'], 1)} "
            f"({number(low, 1)} to {number(high, 1)}) in {totals['judged_healthy_h']:.3f} h |")


def by_fault(result):
    """Per kind of fault: found, named right, all, delays."""
    kinds = {}
    for flight in result["flights"]:
        if flight["outcome"] not in ("found", "missed", "early"):
            continue
        found, right, count, delays = kinds.get(flight["truth"], (0, 0, 0, []))
        if flight["outcome"] == "found":
            found, right, delays = found + 1, right + (flight["named"] == "right"), delays + [flight["delay_s"]]
        kinds[flight["truth"]] = (found, right, count + 1, delays)
    return kinds


def how_found(found, right, count, delays):
    return f"{found} of {count}" + (f", right {right}: {sum(delays) / len(delays):.2f}, {max(delays):.2f}" if delays else "")


def what_happened(flight):
    if flight["outcome"] != "found":
        return flight["outcome"]
    remark = {"right": "", "one of several": " (one of several)", "another": " (not what failed)"}[flight["named"]]
    return f"{flight['delay_s']:.2f} s, {flight['first_alarm']['component']}{remark}"


def alfa(_):
    data = recorded_data()
    build("release")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        tool("import", "alfa", *sorted((data / "alfa").glob("carbonZ*")), "-o", folder / "csv")
        tool("import", "tlog", *sorted((data / "alfa_mavlink").glob("*.tlog.xz")), "--vehicle", "alfa",
             "--truth", data / "alfa/index.csv", "-o", folder / "mavlink")
        logs = {source: [log for log in sorted((folder / source).glob("*.lcm")) if "no_ground_truth" not in log.name]
                for source in ("csv", "mavlink")}
        nested = ("--nested", "--flight-name", FLIGHT)
        rows = [totals_row("published method, to the letter", "CSV", evaluate("alfa", "response_arx.toml", logs["csv"]))]
        results = {}
        for source, title in (("csv", "CSV"), ("mavlink", "MAVLink")):
            calibration = folder / f"{source}.toml"
            tool("calibrate", "--config", ROOT / "config/response.toml", "--vehicle", "alfa", "--flight-name", FLIGHT,
                 "-o", calibration, *logs[source])
            results[source] = {
                "cold": evaluate("alfa", "response.toml", logs[source]),
                "warm, in-sample": evaluate("alfa", "response.toml", logs[source], "--calibration", calibration),
                "warm, nested": evaluate("alfa", "response.toml", logs[source], *nested)}
            rows += [totals_row(method, title, result) for method, result in results[source].items()]
        rates = [totals_row(f"{rate} per hour", "CSV", evaluate("alfa", "response.toml", logs["csv"], *nested,
                                                                 "--false-alarms-per-hour", rate))
                 for rate in ("0.1", "0.03", "0.01", "0.003", "0.001")]
    header = ["| method | input | TP | right | another | FP | FN | TN | not judged | precision | recall | accuracy "
              "| within 10 s | delay median, mean, max s | false alarms per judged hour (95 %) |",
              "|---|---|" + "--:|" * 11 + "---|---|"]
    kinds = {method: by_fault(result) for method, result in results["csv"].items()}
    kind_rows = [f"| {kind} | " + " | ".join(how_found(*kinds[method].get(kind, (0, 0, 0, []))) for method in kinds) + " |"
                 for kind in sorted(kinds["cold"])]
    flights = {method: {flight["flight"]: flight for flight in result["flights"]}
               for method, result in results["csv"].items()}
    flight_rows = [f"| {name} | " + " | ".join(what_happened(flights[method][name]) for method in flights) + " |"
                   for name in sorted(flights["cold"])]
    page("evidence_alfa.md", [
        "# Response detector on the ALFA flights", "",
        "Written by `tools/evidence alfa`. Scored by the first alarm of a flight ([evaluation.md](evaluation.md)): before the onset",
        "it is a false positive *and* a miss; after it the fault is found, TP, whatever part it names. Of TP, \"right\" are those",
        "in which it names the failed part or its control, \"another\" those in which it names a part that is well. Alarms of the",
        "first 20 s, and that time, do not count; false alarms are counted in the time that was judged. `nested` learns prior and",
        "thresholds anew for every flight from the other flights alone; parts of one flight are left out together. The structure of",
        "the channels was chosen while looking at these flights, so even the nested figures are optimistic. Inputs that the fault",
        "injection leaks into (servo outputs, throttle) are not used.", "",
        circumstances(), "", *header, *rows, "",
        "Nested, with thresholds for other false-alarm rates of each channel (0.01 per hour is the default):", "",
        *header, *rates, "",
        "Found, of these named right by the first alarm, and delay mean and maximum in seconds (CSV):", "",
        "| fault | " + " | ".join(kinds) + " |", "|---" * (len(kinds) + 1) + "|", *kind_rows, "",
        "| flight (CSV) | " + " | ".join(flights) + " |", "|---" * (len(flights) + 1) + "|", *flight_rows])


def eval_throughput(binaries):
    """Lines for the page of benchmarks: flight hours a minute, by number of jobs."""
    data = recorded_data()
    copies, repetitions = 20, 5
    lines = ["", "## airworthy eval", "",
             f"The ALFA flights {copies} times over, shipped configuration, cold; the fastest of {repetitions} runs.", "",
             "| jobs | flight hours | time | flight hours per minute | ratio to one job |", "|--:|--:|--:|--:|--:|"]
    with tempfile.TemporaryDirectory() as name:
        run(binaries / "airworthy-import", "alfa", *sorted((data / "alfa").glob("carbonZ*")), "-o", name, capture_output=True)
        logs = []
        for flight in sorted(pathlib.Path(name).glob("*.lcm")):
            logs += [flight.with_name(f"{i}_{flight.name}") for i in range(copies)]
            for copy in logs[-copies:]:
                copy.hardlink_to(flight)  # eval takes no log twice
        single = None
        for jobs in sorted({1, 2, os.cpu_count()}):
            durations = []
            for _ in range(repetitions):
                begun = time.monotonic()
                done = run(binaries / "airworthy-eval", "--json", "--jobs", jobs, "--vehicle", "alfa", "--config",
                           ROOT / "config/response.toml", *logs, capture_output=True)
                durations.append(time.monotonic() - begun)
                if done.returncode != 0:
                    raise Failed(f"airworthy eval failed:\n{done.stderr}")
            hours = sum(flight["duration_s"] for flight in json.loads(done.stdout)["flights"]) / 3600
            rate = hours / (min(durations) / 60)
            single = single or rate
            lines.append(f"| {jobs} | {hours:.1f} | {min(durations):.2f} s | {rate:.0f} | {rate / single:.2f} |")
    return lines


def rows_of(path):
    opener = lzma.open if path.suffix == ".xz" else open
    with opener(path, "rt", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def injected_faults(folder):
    """Intervals in which an elevon was not itself: (from, until, what), in the flight's seconds."""
    now = {"fault_right_gain": 1.0, "fault_left_gain": 1.0, "fault_right_offset": 0.0, "fault_left_offset": 0.0}
    faults, begun, worst = [], None, {}
    for row in rows_of(folder / "fault_settings.csv"):
        now[row["setting"]] = float(row["value"])
        wrong = {key: value for key, value in now.items()
                 if (value != 1.0 if key.endswith("gain") else abs(value) > 100.0)}
        if wrong:
            begun = begun if begun is not None else float(row["t_s"])
            worst.update(wrong)
        elif begun is not None:
            faults.append((begun, float(row["t_s"]), dict(worst)))
            begun, worst = None, {}
    return faults


def autonomous_s(folder, intervals):
    """Seconds in mode 2, outside the intervals."""
    rows = [(float(row["t_s"]), float(row["f0"])) for row in rows_of(folder / "PPRZ_MODE.csv.xz")]
    return sum(min(after - before, 30.0) for (before, mode), (after, _) in zip(rows, rows[1:])
               if mode == 2 and not any(begin <= before <= end for begin, end in intervals))


def imported(table_map, sources, folder):
    folder.mkdir()
    logs = []
    for source in sources:
        log = folder / f"{source.parent.name}_{source.name.split('.')[0]}.lcm"
        tool("import", "table", source, "--map", ROOT / "config/import" / table_map, "-o", log)
        logs.append(log)
    return logs


def elevon_rows(data, folder):
    """Table of the injected faults, and what else was raised."""
    rows, alarms_elsewhere, healthy_s, found, count = [], [], 0.0, 0, 0
    for source in sorted(path for path in (data / "daredevil_faults").iterdir() if path.is_dir()):
        log, = imported("daredevil_faults.toml", [source], folder / source.name)
        flight, = evaluate("daredevil", "response_elevon.toml", [log])["flights"]
        alarms = [(alarm["time_us"] / 1e6, alarm["component"]) for alarm in flight["alarms"]]
        faults = injected_faults(source)
        for begin, end, what in faults:
            mine = [(time - begin, component) for time, component in alarms if begin <= time <= end]
            count, found = count + 1, found + bool(mine)
            settings = ", ".join(f"{key.removeprefix('fault_').replace('_', ' ')} {value:g}" for key, value in what.items())
            rows.append(f"| {source.name} | {settings} | {end - begin:.0f} s | "
                        f"{f'{mine[0][0]:.1f} s, {mine[0][1]}' if mine else 'not found'} |")
        spans = [(begin, end + AFTER_FAULT_S) for begin, end, _ in faults]
        alarms_elsewhere += [time for time, _ in alarms if not any(begin <= time <= end for begin, end in spans)]
        healthy_s += autonomous_s(source, spans)
    return rows, f"{found} of {count} found; {len(alarms_elsewhere)} false alarms in {healthy_s / 3600:.2f} h"


def response_sets(_):
    data = recorded_data()
    build("release")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        faults, elevon_summary = elevon_rows(data, folder)
        runs = imported("rflymad_sim.toml", sorted((data / "rflymad_sim").glob("TestCase*")), folder / "rflymad")
        rotor = evaluate("rflymad", "response_multirotor.toml", runs, *described("rflymad"))
        sets = {"crazyflie_brushless_rpm": ("crazyflie", "crazyflie_brushless_rpm.toml", "*.csv.xz",
                                            described("crazyflie_brushless")),
                "crazypad/controller": ("crazyflie", "crazypad_controller.toml", "normal*.csv.xz", ()),
                "crazypad/motor": ("crazyflie", "crazypad_motor.toml", "normal*.csv.xz", ()),
                "indiflight_throw": ("indiflight", "indiflight_throw.toml", "*.csv.xz", described("indiflight_throw"))}
        lift = []
        for set_name, (vehicle, table_map, pattern, description) in sets.items():
            logs = imported(table_map, sorted((data / set_name).glob(pattern)), folder / set_name.replace("/", "_"))
            result = evaluate(vehicle, "response_lift.toml", logs, *description)
            totals = result["totals"]
            low, high = totals["false_alarms_per_hour_95"]
            alarms = sum(len(flight["alarms"]) for flight in result["flights"])
            lift.append(f"| {set_name} | {len(logs)} | {totals['not_judged']} | {alarms} | "
                        f"{totals['false_alarms']} in {totals['judged_healthy_h']:.3f} h | "
                        f"{number(low, 0)} to {number(high, 0)} |")
    page("evidence_response_sets.md", [
        "# Response detector on other vehicles", "",
        "Written by `tools/evidence response_sets`. All with a cold start: everything is learned in the flight itself.",
        "Multirotors but the crazypad have a vehicle file in `config/vehicles`, and are judged in flight only.", "",
        circumstances(), "",
        "## Flying wing with injected elevon faults (daredevil_faults, real)", "",
        "`config/response_elevon.toml`: roll and pitch rate, as differences of 8 Hz attitude, against attitude errors and",
        "set-points; autonomous flight only. Gains are what is left of an elevon, offsets are of 9600; times from the first",
        "request. A gain of 0.5, and a fault of four seconds, the controller hides from these pairs.", "",
        f"{elevon_summary}.", "",
        "| flight | fault | lasted | first alarm |", "|---|---|--:|---|", *faults, "",
        "## Simulated quadrotors losing rotor 1 (rflymad_sim)", "",
        "`config/response_multirotor.toml`: attitude errors against set-points. The axis is named; which rotor is for the",
        "effectiveness detector to say: all are candidates.", "",
        "| run | first alarm |", "|---|---|", *(f"| {flight['flight']} | {what_happened(flight)} |" for flight in rotor["flights"]),
        "", "## A pair of several inputs on healthy multirotors (real)", "",
        "`config/response_lift.toml`: vertical acceleration against the commands of all rotors. These sets carry no attitude",
        "set-point, so there is no attitude pair to try; bebop2_prop_eject has set-points of rates only, which no pair uses.",
        "Violent throws of 6 to 25 s are not what a cold start of 10 s is for, and flights this short say little about hours.",
        "Not judged are flights in which, after the 20 s that `airworthy eval` leaves out, nothing was: their silence says nothing.", "",
        "| set | flights | not judged | alarms, any time | false alarms after 20 s, in the time judged | per hour, 95 % |",
        "|---|--:|--:|--:|--:|---|", *lift])
