"""Simulated beside recorded flights, by the same analysis of both logs: docs/evidence_realism.md and its figures."""
import pathlib
import sys
import tempfile
import tomllib

import matplotlib
import numpy as np

from evidence_page import ROOT, Failed, build, circumstances, page, run
from evidence_response import recorded_data, tool
from realism_flight import Flight, read_log

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of the backend)

SEEDS = (1, 2, 3)
SCENARIO = "healthy_manoeuvres"
HOVER_S, MOTION_S = (14.0, 29.0), (31.0, 89.0)  # of that scenario

# Recorded set: files, vehicle, seconds until a thrown vehicle has caught itself, options of the simulation.
SETS = {
    "indiflight_throw": ("*.csv.xz", "indiflight_throw", 2.0, ()),
    "bebop2_prop_eject": ("*.csv.xz", "bebop2", 0.0, ()),
    "crazyflie_brushless_rpm": ("square*.csv.xz", "crazyflie_brushless", 0.0, ("--imu-average", 10)),  # sent at 100 Hz
}


# Name, unit, number of Flight, digits, parameter of sim/realism.toml that it supports.
ROWS = (
    ("gyro, broadband, roll and pitch", "rad/s/√Hz", "gyro", 4, "imu.gyro_vibration_rad_s_per_sqrt_Hz"),
    ("gyro, at the rotor speeds, roll and pitch", "rad/s rms", "gyro_rotor", 3, ""),
    ("accelerometer, broadband, horizontal", "m/s²/√Hz", "accel", 3, "imu.accel_vibration_m_s2_per_sqrt_Hz"),
    ("accelerometer, broadband, vertical", "m/s²/√Hz", "accel_z", 3, "imu.accel_vibration_m_s2_per_sqrt_Hz"),
    ("accelerometer, at the rotor speeds, horizontal", "m/s² rms", "unbalance", 2, "rotor.natural_unbalance_m_s2"),
    ("speed noise / speed", "", "rpm", 4, "esc.noise_ratio"),
    ("motor lag", "s", "lag", 3, "motor.time_constant_error_ratio"),
    ("dead time from command to reported speed", "s", "dead", 3, "motor.command_latency_s"),
    ("residual of the lag / full speed", "", "lag_residual", 3, "motor.speed_error_ratio"),
    ("speed reported later than the rate shows it", "s", "late", 3, "esc.latency_s"),
    ("ṗ on squared speeds: R² in motion", "", "p_r2", 2, ""),
    ("q̇: R² in motion", "", "q_r2", 2, ""),
    ("ṗ: residual in motion", "rad/s²", "p_moving", 1, ""),
    ("ṗ: residual in hover", "rad/s²", "p_hover", 1, ""),
    ("q̇: residual in hover", "rad/s²", "q_hover", 1, ""),
    ("spread of the rotors' roll authority", "", "spread", 2, "rotor.thrust_error_ratio"),
    ("az: residual in motion", "m/s²", "z_moving", 2, "airframe.aerodynamics_error_ratio"),
    ("az: residual in hover", "m/s²", "z_hover", 2, "airframe.aerodynamics_error_ratio"),
    ("az over Σω², 10⁻⁶", "m/s²", "z", 3, "airframe.thrust_error_ratio"),
)


def span(flights, name, digits):
    values = [flight.numbers[name] for flight in flights if np.isfinite(flight.numbers[name])]
    if not values:
        return "–"
    middle, low, high = np.median(values), min(values), max(values)
    return f"{middle:.{digits}f}" + (f" ({low:.{digits}f} to {high:.{digits}f})" if len(values) > 1 else "")


def realism_cell(table, key):
    if not key:
        return "–"
    group, name = key.split(".")
    return f"`{key}` {', '.join(f'{table[group][name][level]:g}' for level in ('nominal', 'hard', 'brutal'))}"


def set_rows(real, simulated, table):
    for text, unit, name, digits, key in ROWS:
        yield (f"| {text}{f', {unit}' if unit else ''} | {span(real, name, digits)} | {span(simulated, name, digits)} | "
               f"{realism_cell(table, key)} |")


def band(axis, flights, abscissa, values, colour, label):
    """Median over flights, and their range."""
    x = min((getattr(flight, abscissa) for flight in flights), key=lambda f: f[-1])
    stack = np.array([np.interp(x, getattr(flight, abscissa), values(flight)) for flight in flights])
    axis.fill_between(x, np.maximum(stack.min(0), 1e-9), stack.max(0), color=colour, alpha=0.25, linewidth=0)
    axis.loglog(x, np.median(stack, axis=0), color=colour, linewidth=0.9, label=label)


def draw(axes, flights, colour, label):
    """One group of flights into all panels; of the two that show time, the flight with the longest hover."""
    flight = max(flights, key=lambda one: np.ptp(one.t[one.hover]))
    second = slice(flight.hover.start, flight.hover.start + int(flight.rate))
    axes[0, 0].plot(flight.t[second] - flight.t[second.start], flight.gyro[second, 0], color=colour, linewidth=0.7)
    if flight.lag_model is not None:
        width = int(0.5 * flight.rate)
        begin = max(range(0, len(flight.lag_model) - width, width), key=lambda i: np.ptp(flight.lag_measured[i:i + width]))
        part, time_s = slice(begin, begin + width), np.arange(width) / flight.rate
        axes[1, 3].plot(time_s, flight.lag_measured[part], color=colour, linewidth=0.8)
        axes[1, 3].plot(time_s, flight.lag_model[part], color=colour, linewidth=0.8, linestyle="--")
    band(axes[0, 1], flights, "f", lambda f: np.sqrt(f.imu_density[:, 0] * f.imu_density[:, 1]), colour, label)
    band(axes[0, 2], flights, "f", lambda f: np.sqrt(f.imu_density[:, 3] * f.imu_density[:, 4]), colour, label)
    band(axes[0, 3], flights, "f", lambda f: f.imu_density[:, 5], colour, label)
    band(axes[1, 0], flights, "speed_f", lambda f: f.speed_density, colour, label)
    band(axes[1, 1], flights, "residual_f", lambda f: f.residual_density[:, 0], colour, label)
    band(axes[1, 2], flights, "residual_f", lambda f: f.residual_density[:, 2], colour, label)


def figure(name, real, simulated):
    fig, axes = plt.subplots(2, 4, figsize=(15.5, 6.4))
    draw(axes, real, "black", "recorded")
    draw(axes, simulated, "tab:red", f"simulated, hard, seeds {', '.join(map(str, SEEDS))}")
    titles = ("roll rate in hover, rad/s", "gyro, roll and pitch, rad/s/√Hz", "accelerometer, horizontal, m/s²/√Hz",
              "accelerometer, vertical, m/s²/√Hz", "reported speed / mean, 1/√Hz", "residual of ṗ in hover, rad/s²/√Hz",
              "residual of az in hover, m/s²/√Hz", "speed of rotor 1 and (dashed) its lag model, rad/s")
    for axis, title in zip(axes.flat, titles):
        axis.set_title(title, fontsize=9)
        is_time = axis in (axes[0, 0], axes[1, 3])
        axis.set_xlabel("s" if is_time else "Hz", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.grid(True, which="major", linewidth=0.3)
        if not is_time:
            axis.set_xlim(left=1.0)
            low, high = axis.get_ylim()
            axis.set_ylim(max(low, high * 1e-5), high)
    axes[0, 1].legend(fontsize=7)
    fig.tight_layout()
    (ROOT / "docs/figures").mkdir(exist_ok=True)
    fig.savefig(ROOT / f"docs/figures/realism_{name}.png", dpi=68)
    plt.close(fig)


def message_types(folder):
    """Python classes of the messages, generated from the schema."""
    names = {"IMU": "imu_t", "ESC_STATUS": "esc_status_t", "ROTOR_COMMAND": "rotor_command_t", "GROUND_TRUTH": "ground_truth_t"}
    files = [ROOT / "lcmtypes" / f"{name}.lcm" for name in ("header_t", *names.values())]
    if run("lcm-gen", "-p", "--ppath", folder, *files, capture_output=True).returncode != 0:
        raise Failed("lcm-gen failed")
    sys.path.insert(0, str(folder))
    module = __import__("airworthy")
    return {channel: getattr(module, name) for channel, name in names.items()}


def realism(_):
    data = recorded_data()
    for target in ("airworthy-import", "airworthy-sim"):
        build("release", target)
    with open(ROOT / "sim/realism.toml", "rb") as file:
        table = tomllib.load(file)
    remarks = (ROOT / "tools/evidence_realism_remarks.md").read_text(encoding="utf-8").split("\n## ")[1:]
    said = {part.split("\n", 1)[0]: part.split("\n", 1)[1].strip() for part in remarks}
    sections = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        types = message_types(folder)
        for set_name, (pattern, vehicle, settled_s, options) in SETS.items():
            real, simulated, log = [], [], folder / "flight.lcm"
            for source in sorted((data / set_name).glob(pattern)):
                tool("import", "table", source, "--map", ROOT / f"config/import/{set_name}.toml", "-o", log)
                flight = Flight(read_log(log, types), settled_s)
                print(f"evidence: {set_name} {source.name}: hover {np.ptp(flight.t[flight.hover]):.1f} s", flush=True)
                real.append(flight)
            for seed in SEEDS:
                tool("sim", "--vehicle", ROOT / f"config/vehicles/{vehicle}.toml", "--scenario",
                     ROOT / f"config/scenarios/{SCENARIO}.toml", "--seed", seed, "-o", log, *options)
                simulated.append(Flight(read_log(log, types), hover_s=HOVER_S, motion_s=MOTION_S))
            figure(set_name, real, simulated)
            sections += ["", f"## {set_name}", "", f"{len(real)} recorded, {len(SEEDS)} simulated flights of `{vehicle}`.", "",
                         f"![spectra](figures/realism_{set_name}.png)", "", said[set_name], "",
                         "| number | recorded | simulated, hard | `sim/realism.toml`: nominal, hard, brutal |", "|---|--:|--:|---|",
                         *set_rows(real, simulated, table)]
    page("evidence_realism.md", [
        "# Simulated beside recorded flights", "", "Written by `tools/evidence realism`.", "", circumstances(), "", said["method"].format(
            seeds=", ".join(map(str, SEEDS)), scenario=SCENARIO), *sections])
