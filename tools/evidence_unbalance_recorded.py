"""Rotor unbalance on recorded flights: docs/evidence_unbalance_recorded.md and its figures."""
import json
import lzma
import math

import matplotlib
import numpy as np

import crazypad
from evidence_page import ROOT, Failed, build, circumstances, page, run
from evidence_response import recorded_data

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of the backend)

REASONS = ("judged", "not flying", "no inertial data", "converging", "speed unknown", "speed implausible",
           "unfit inertial data", "confounded")
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728")


def section(name):
    print(f"evidence: unbalance_recorded {name}", flush=True)
    done = run(ROOT / "build/dev/evidence/unbalance_recorded", name, capture_output=True)
    if done.returncode != 0:
        raise Failed(f"unbalance_recorded {name} failed:\n{done.stderr}")
    return json.loads(done.stdout)


def noise_at_rest(folder):
    """The low-pass of the thrown quadrotors' accelerometer, by the spectrum of its noise while nothing turns."""
    size, rate = 256, 504.2
    window = np.hanning(size)
    spectra = []
    for path in sorted(folder.glob("*.csv.xz")):
        with lzma.open(path, "rt", encoding="utf-8") as file:
            names = file.readline().strip().split(",")
            table = np.loadtxt(file, delimiter=",")
        stands = table[:, [names.index(f"w{i}_radps") for i in range(1, 5)]].max(1) <= 0
        for start in range(0, len(table) - size, size // 2):
            piece = slice(start, start + size)
            for axis in "xyz":
                values = table[piece, names.index(f"a{axis}_mps2")]
                # Still: less than a step and a half of the recording's resolution.
                if stands[piece].all() and 0 < values.std() < 0.006:
                    ramp = np.arange(size)
                    values = values - np.polyval(np.polyfit(ramp, values, 1), ramp)
                    spectra.append(np.abs(np.fft.rfft(values * window)) ** 2)
    power, frequency = np.mean(spectra, 0), np.fft.rfftfreq(size, 1 / rate)
    chosen = frequency > 6
    fits = []
    for name, gain, at_rotor in (("one pole", lambda x: 1 / (1 + x**2), lambda x: 1 / math.sqrt(1 + x**2)),
                                 ("two poles of first order", lambda x: 1 / (1 + x**2) ** 2, lambda x: 1 / (1 + x**2)),
                                 ("Butterworth of second order", lambda x: 1 / (1 + x**4),
                                  lambda x: 1 / math.sqrt(1 + x**4))):
        best = None
        for pole in np.arange(5.0, 120.0):
            model = np.stack([gain(frequency / pole), np.ones_like(frequency)], 1)[chosen] / power[chosen, None]
            parts = np.maximum(np.linalg.lstsq(model, np.ones(chosen.sum()), rcond=None)[0], 0)
            misfit = float(np.sum((model @ parts - 1) ** 2))
            if best is None or misfit < best[0]:
                best = (misfit, pole)
        fits.append((name, best[1], best[0], at_rotor(314.0 / best[1])))
    return len(spectra), fits


def bebop_figure(bebop):
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 3.6))
    rows = bebop["detuning"]
    left.plot([row["scale"] for row in rows], [100 * row["explained_in_blocks"] for row in rows], "o-", ms=3, color="0.6",
              label="constant in blocks of 1 s")
    left.plot([row["scale"] for row in rows], [100 * row["explained"] for row in rows], "o-", ms=3, color="k",
              label="order tracker, one step ahead")
    left.set(xlabel="speeds times", ylabel="energy explained, %")
    left.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, 0.9))
    moments = bebop["moments"]
    time = np.array([moment["time_s"] for moment in moments])
    time[1:][np.diff(time) > 1] = np.nan  # between the halves
    for rotor in range(4):
        for axes, key in ((middle, "with"), (right, "phase_rad")):
            values = np.array([moment[key][rotor] for moment in moments])
            if key == "phase_rad":
                values = np.unwrap(values)
            axes.plot(time, values, color=COLOURS[rotor], label=f"rotor {rotor + 1}")
        middle.plot(time, [moment["against"][rotor] for moment in moments], ":", color=COLOURS[rotor])
    middle.set(xlabel="time, s", ylabel="amplitude, m/s² (dotted: against)")
    right.set(xlabel="time, s", ylabel="phase against own rotor, rad")
    middle.legend(fontsize=8)
    save(figure, "unbalance_bebop.png")


def save(figure, name):
    figure.tight_layout()
    figure.savefig(ROOT / "docs/figures" / name, dpi=110, metadata={"Software": None})
    plt.close(figure)


def added_figure(added):
    figure, panels = plt.subplots(1, len(added), figsize=(6 * len(added), 3.6))
    for axes, item in zip(np.atleast_1d(panels), added):
        for link in item["links"]:
            rows = [row for row in link["rows"] if row["amplitude_m_s2"] > 0]
            shares = [100 * row["right"] / max(1, trials(row)) for row in rows]
            axes.plot([mg(item) * row["amplitude_m_s2"] for row in rows], shares, "o-", label=link["link"])
        axes.set(xscale="log", xlabel="mass added at the tip, mg", ylabel="right rotor named, %", title=item["set"])
    np.atleast_1d(panels)[0].legend(fontsize=7)
    save(figure, "unbalance_added.png")


def trials(row):
    return row["right"] + row["wrong"] + row["several"] + row["nobody"] + row["early"]


def mg(item):
    """mg at the tip of a propeller for 1 m/s² of the whole vehicle at hover."""
    return 1e3 * item["g_mm_per_m_s2_and_kg"] * item["mass_kg"] / item["radius_mm"]


def bebop_lines(bebop):
    at = {row["scale"]: row for row in bebop["detuning"]}
    followed = bebop["clocks_followed"]
    best = max(bebop["latency"], key=lambda row: row["explained"])
    late = {row["latency_ms"]: row["explained"] for row in bebop["latency"]}
    yield from [
        "## Bebop 2 before the ejection: the phase is there, behind a clock error", "",
        "2.5 to 12.2 s, 500 Hz, rotors at 118 to 133 Hz. Explained is the share of the energy of the horizontal acceleration,",
        "high-passed at 12 Hz, that the order tracker predicts one step ahead (beside it: constant amplitudes fitted to",
        "blocks of 1 s, no filter involved). The reported speeds are 0.50 % too high against the clock of the samples, all",
        "four alike; scale 1 is after that correction.", "",
        "| speeds times | " + " | ".join(f"{row['scale']:g}" for row in bebop["detuning"]) + " |",
        "|---|" + "--:|" * len(bebop["detuning"]),
        "| explained, % | " + " | ".join(f"{100 * row['explained']:.0f}" for row in bebop["detuning"]) + " |",
        "| in blocks, % | " + " | ".join(f"{100 * row['explained_in_blocks']:.0f}" for row in bebop["detuning"]) + " |", "",
        f"With the true speeds {100 * at[1.0]['explained']:.0f} %. At 0.90 and 0.93 one rotor's detuned speed meets the true",
        "speed of another, which is no control; beyond 2 % elsewhere nothing is left. As reported, without following",
        f"the clocks, {100 * followed['explained_as_reported']:.0f} % are explained; following them from a start at 0,",
        f"{100 * followed['explained']:.0f} %, the time to settle included. The four errors are found independently as "
        + ", ".join(f"{100 * one:+.2f}" for one in followed["speed_error_ratio"]) + " %, within 0.05 % of",
        "the end after " + ", ".join(f"{one:.1f}" for one in followed["settled_after_s"]) + " s.", "",
        f"Latency: best with telemetry {-best['latency_ms']} ms ahead of the samples ({100 * best['explained']:.1f} %: the accelerometer is",
        f"filtered too); {100 * late[0]:.1f} % at 0, {100 * late[20]:.1f} % at 20 ms, {100 * late[50]:.1f} % at 50 ms. In a calm hover it hardly matters.", "",
        "![Bebop](figures/unbalance_bebop.png)", "",
        "Natural unbalance, each half tracked from nothing (95 % intervals over four blocks of 0.8 s). The conversion takes the",
        f"mount for stiff: 1 m/s² is {bebop['g_mm_per_m_s2']:.2f} g·mm of a 500 g vehicle. Y/X is the complex ratio of the two",
        "axes; a stiff airframe has 1 ∠ +90° for a counter-clockwise rotor (1 and 3), 1 ∠ −90° for a clockwise one.", "",
        "| rotor | half | with the rotor, m/s² | against it, m/s² | g·mm | Y/X |", "|---|---|---|---|---|---|"]
    for rotor in range(4):
        for name, half in zip(("first", "second"), bebop["halves"]):
            one = half["rotors"][rotor]
            amplitude, against, scale = one["with_m_s2"], one["against_m_s2"], bebop["g_mm_per_m_s2"]
            yield (f"| {rotor + 1} | {name} | {amplitude['mean']:.2f} ({amplitude['low']:.2f} to {amplitude['high']:.2f}) | "
                   f"{against['mean']:.2f} ({against['low']:.2f} to {against['high']:.2f}) | "
                   f"{scale * amplitude['mean']:.2f} ({scale * amplitude['low']:.2f} to {scale * amplitude['high']:.2f}) | "
                   f"{one['y_over_x']:.2f} ∠ {math.degrees(one['y_over_x_phase_rad']):.0f}° |")
    yield from [
        "",
        "Each rotor has an ellipse of its own that repeats from half to half. Rotor 2 shakes the sensor along a line, rotor 4",
        "turns it against its own sense, at 128 to 132 Hz where rotors 1 and 3 at 120 Hz do not: the mount resonates nearby.",
        "The sense of rotation is no evidence on such a vehicle; `against_ratio` is 1 for it below. How much of the",
        "amplitude is unbalance and how much the resonance cannot be told from one flight, so the g·mm are what a stiff",
        "vehicle would need, not what the propellers have.", ""]


def silence_lines(healthy):
    yield from [
        "## Healthy flights", "",
        "Each flight is judged without a baseline, and with the baseline and clock errors of all the *other* flights. Seconds",
        "are means of the rotors. Amplitudes of the thrown quadrotors are as the recorded acceleration has them, behind",
        "its low-pass.", ""]
    for item in healthy:
        flights = item["flights"]
        for mode in ("without_baseline", "with_baseline"):
            if mode == "with_baseline" and not flights[0]["has_baseline"]:
                yield from [f"{item['set']}, with baseline: none can be learned, nothing is judged.", ""]
                continue
            seconds = np.sum([flight[mode]["seconds_by_reason"] for flight in flights], 0)
            reports = sum(len(flight[mode]["reports"]) for flight in flights)
            several = sum(len(flight[mode]["ambiguities_s"]) for flight in flights)
            told = ", ".join(f"{second:.1f} s {reason}" for reason, second in zip(REASONS, seconds) if second > 0.05)
            yield from [f"{item['set']}, {mode.replace('_', ' ')}, {len(flights)} flights: **{reports} rotors blamed, "
                        f"{several} unbalances of nobody**; {told}. Threshold {item['smallest_m_s2']} m/s².", ""]
        if not flights[0]["has_baseline"]:
            continue
        yield from ["| flight | judged s | not flying s | other reasons s | amplitude of rotors 1 to 4, mm/s² | clock errors, % | NIS |",
                    "|---|--:|--:|--:|---|---|--:|"]
        for flight in flights:
            one = flight["with_baseline"]
            seconds = one["seconds_by_reason"]
            amplitude = ", ".join("–" if value is None else f"{1e3 * value:.0f}" for value in one["amplitude_m_s2"])
            clocks = ", ".join(f"{100 * value:.2f}" for value in flight["without_baseline"]["speed_error_ratio"][:4])
            yield (f"| {one['flight']} | {seconds[0]:.1f} | {seconds[1]:.1f} | {sum(seconds[2:]):.1f} | {amplitude} | {clocks} | "
                   f"{one['nis']:.2f} |")
        yield ""
    yield from [
        "The clock errors are those found in each flight from a start at 0, rotor by rotor: the same motor controllers show",
        "the same errors over three weeks where they had time to settle. On 27 February (LOG00230, LOG00232) rotor 3 shakes",
        "three to four times more than later; its propeller or motor was evidently another. A report there is a true difference,",
        "though no fault that anybody injected.", "",
        "The Crazyflie sends an accelerometer filtered at 30 Hz 100 times a second, while its rotors turn at 309 Hz: the filter",
        "leaves 1 %, and the time stamps come by radio. Nothing is judged, and the reason is given.", ""]


def added_lines(added):
    yield from [
        "## An unbalance added to recorded acceleration", "",
        "Phase: the recorded speed smoothed to both sides (Gaussian, 4 ms), its clock error taken out, plus a random walk of",
        "0.1 rad/√s. Sensor: two poles of first order at 40 Hz for the thrown quadrotors (see above; this leaves 1.6 % at",
        "hover), then rounding to 4.8 mm/s²; nothing for the Bebop, where half as much turns against the rotor. The",
        "tracker gets the recorded speeds, or those at 50 Hz, rounded to 1.5 rad/s (100 electrical rev/min of 7 pole",
        "pairs), 8 or 50 ms late. Thrown: every rotor of every flight with 4 s left after the onset 3 s into the",
        "flight; baseline and clock errors from all other flights. Bebop: baseline from the first half, onset at the middle, ten",
        "phases per rotor. A row without any added mass counts false alarms.", ""]
    clean_wrong = clean = 0
    for item in added:
        scale = mg(item)
        yield from [f"### {item['set']}: 1 m/s² at hover is {scale:.1f} mg at the tip ({item['radius_mm']:.0f} mm, {1e3 * item['mass_kg']:.0f} g)", "",
                    "| speeds | added m/s² | mg | right | wrong | one of several | nobody | alarm before | right by rotor | s, median | s, 95 % |",
                    "|---|--:|--:|--:|--:|--:|--:|--:|---|--:|--:|"]
        for link in item["links"]:
            for row in link["rows"]:
                none = row["amplitude_m_s2"] == 0
                alarms = row["right"] + row["wrong"]
                if ";" not in link["link"] and "told" not in link["link"]:
                    clean_wrong += alarms if none else row["wrong"]
                    clean += trials(row)
                delay = ["–" if none or row[key] is None else f"{row[key]:.1f}" for key in ("delay_median_s", "delay_95_s")]
                yield (f"| {link['link']} | {row['amplitude_m_s2']:g} | {scale * row['amplitude_m_s2']:.0f} | "
                       f"{'–' if none else row['right']} | {alarms if none else row['wrong']} | {row['several']} | {row['nobody']} | "
                       f"{row['early']} | {'–' if none else ', '.join(map(str, row['right_by_rotor']))} | {delay[0]} | {delay[1]} |")
        yield ""
        for link in item["links"]:
            found = [row for row in link["rows"] if row["amplitude_m_s2"] > 0 and row["right"] >= 0.9 * trials(row)]
            least = f"{scale * found[0]['amplitude_m_s2']:.0f} mg" if found else "not reached"
            alone = []
            for rotor in range(4):
                named = [row for row in link["rows"] if row["amplitude_m_s2"] > 0
                         and row["right_by_rotor"][rotor] >= 0.9 * trials(row) / 4]
                alone.append(f"{scale * named[0]['amplitude_m_s2']:.0f}" if named else "–")
            yield f"- {link['link']}: smallest named in 90 % of the runs: {least}; of rotors 1 to 4 alone: {', '.join(alone)} mg."
        yield ""
    yield from [
        "![Added unbalance](figures/unbalance_added.png)", "",
        f"With clocks followed and the latency told truly {clean_wrong} of {clean} runs blame a wrong rotor. Those are of the Bebop, whose",
        "rotors 1 and 3 turn within 8 to 11 rad/s of each other and shake 3.4 m/s² each already: what is added to one shows in",
        "the other. That is too many, and such a pair should be reported as one of two. A latency told wrongly by 42 ms makes",
        "the Bebop's baseline worthless (rotor 3 is blamed without any fault) and costs mass on the thrown quadrotors. Without",
        "following the clocks the second rotor of the thrown quadrotors (0.3 %) is hardly ever found, and the Bebop's baseline is",
        "worthless too.", ""]


def crazypad_lines(folder, monitored):
    seconds = np.sum([flight["seconds_by_reason"] for flight in monitored], 0)
    told = ", ".join(f"{second:.0f} s {reason}" for reason, second in zip(REASONS, seconds) if second > 0.5)
    flights = crazypad.load(folder)
    judged = list(crazypad.results(flights))
    figure, axes = plt.subplots(figsize=(6.5, 3.6))
    for vehicle, marker in (("E8", "o"), ("E9", "s")):
        for fault, colour in (("none", "k"), ("cut", COLOURS[0]), ("tape", COLOURS[3])):
            chosen = [(flight, verdict) for flight, verdict in judged
                      if flight.vehicle == vehicle and flight.fault == fault and flight.damaged in ("", "M3")]
            lost = [sum(map(float, flight.detail.split(":")[1].split("/"))) if fault == "cut" else 0 for flight, _ in chosen]
            axes.plot(lost, [100 * (math.exp(flight.commands[2]) - 1) for flight, _ in chosen], marker, color=colour, mfc="none",
                      label=f"{vehicle}, {fault}")
    axes.set(xlabel="cut off both blades of M3 together, mm", ylabel="M3's command over the mean, %")
    axes.legend(fontsize=7)
    save(figure, "unbalance_crazypad.png")
    large = [(flight, verdict) for flight, verdict in judged if "2.5 mm and more" in flight.kind]
    small = [(flight, verdict) for flight, verdict in judged if "up to 1 mm" in flight.kind or flight.kind == "tape"]
    yield from [
        "## CrazyPAD: cut and taped propellers, no rotor speed", "",
        "101 Hz behind a low-pass of some tens of Hz, rotors at 250 to 350 Hz: no phase, no order tracking, and no power of",
        f"vibration to fall back on. The monitor, fed the {len(monitored)} flights of folder motor/, blames "
        f"{sum(len(flight['reports']) for flight in monitored)} rotors, damaged or not: {told}.", "",
        "What two plain numbers of a whole flight tell, judged against the normal flights of the same vehicle alone (a normal",
        "flight against the others): the command each motor needs beside the mean of the four (thrust loss), and the scatter of",
        "the vertical acceleration (vibration). Student's t for a new flight, 1 % false alarms for each number; nothing else",
        "was chosen.", "",
        "| vehicle | damage | flights | right motor by command | wrong motor | vibration alarm | command, median t | vibration, median t |",
        "|---|---|--:|--:|--:|--:|--:|--:|", *crazypad.table(judged), "",
        "![CrazyPAD](figures/unbalance_crazypad.png)", "",
        f"- Cuts of M3 by 2.5 mm and more (5 % of the blade): {sum(verdict[0] == 2 for _, verdict in large)} of {len(large)} flights on the right motor. "
        f"Of 1 mm or less, and tape: {sum(verdict[0] is not None for _, verdict in small)} of {len(small)}.",
        "- Vibration alone finds nothing at this rate of false alarms: the normal flights of E8 fall into two groups whose vibration",
        "  differs threefold (0.006 to 0.010 and 0.017 g) and whose M3 command differs by 8 %, more than any small damage makes. With",
        "  5 and 7 normal flights of evidently different occasions that is the baseline there is. Judged within one occasion more",
        "  would be seen, but the recordings do not tell which flights share one.",
        "- The series of E9 with M1 and M2 cut was flown with an M3 that needs more command than in the normal flights; where the cuts",
        "  are small, M3 is blamed. It cannot be told from thrust loss of M3.",
        "- A weight under the body near M3 raises M3's command as a lost blade tip does; a median of commands cannot tell them apart.", ""]


def unbalance_recorded(_):
    build("dev", "unbalance_recorded")
    data = recorded_data()
    bebop, healthy, added, monitored = (section(name) for name in ("bebop", "healthy", "added", "crazypad"))
    pieces, fits = noise_at_rest(data / "indiflight_throw")
    judged_s = sum(flight["with_baseline"]["seconds_by_reason"][0] for item in healthy for flight in item["flights"])
    bebop_figure(bebop)
    added_figure(added)
    page("evidence_unbalance_recorded.md", [
        "# Rotor unbalance on recorded flights", "",
        "Written by `tools/evidence unbalance_recorded` (tests/evidence/unbalance_*.cpp, tools/crazypad.py).", "",
        circumstances(), "",
        *bebop_lines(bebop),
        "## What the thrown quadrotors' accelerometer leaves", "",
        f"The noise of {pieces} still moments before take-off shows the low-pass it has passed; the rotors turn at 314 Hz, beyond",
        "half the sampling rate. The fits differ threefold in what is left there, so masses below carry that factor.", "",
        "| low-pass | at Hz | misfit | left at 314 Hz |", "|---|--:|--:|--:|",
        *(f"| {name} | {pole:.0f} | {misfit:.2f} | {100 * left:.1f} % |" for name, pole, misfit, left in fits), "",
        *silence_lines(healthy), *added_lines(added), *crazypad_lines(data / "crazypad", monitored),
        "## What to hold against this page", "",
        "- The clock errors used to place the added phase were fitted to the same recordings, as was the high-pass corner: the structure",
        "  was chosen while looking at these flights, though baselines and thresholds are held out.",
        "- An added sinusoid is a clean fault: a real chipped blade also loses thrust, shakes at twice the speed, and excites the frame's",
        "  own ellipse, which is taken as a circle for the thrown quadrotors.",
        f"- The thrown flights are 8 to 43 s of one or two vehicles, {judged_s:.0f} s judged in all: no alarm bounds the rate at "
        f"{3 * 3600 / judged_s:.0f} an hour (95 %), no better.",
        "- Masses assume the vehicles' mass (0.35 kg estimated for the thrown ones) and a stiff mount.",
        "- The Bebop is one flight of ten seconds; its halves share the day, the battery and the propellers."])
