"""What CrazyPAD's logs (101 Hz, strongly filtered, no rotor speed) tell of cut and taped propellers, flight by flight,
against the normal flights of the same vehicle."""
import csv
import lzma
import math
import re

import numpy as np

FALSE_ALARM = 0.01  # of a normal flight, by each of the two tests; the only number chosen


def columns(path):
    with lzma.open(path, "rt", encoding="utf-8") as file:
        rows = csv.reader(file)
        names = next(rows)
        values = np.array([[float(cell) if cell else math.nan for cell in row] for row in rows])
    return {name: values[:, k] for k, name in enumerate(names)}


def student_quantile(upper, degrees):
    """x with P(t > x) = upper, by Simpson's rule and bisection."""
    scale = math.exp(math.lgamma((degrees + 1) / 2) - math.lgamma(degrees / 2)) / math.sqrt(degrees * math.pi)

    def tail(x):
        # t = x/u on 0 < u <= 1 covers x <= t < infinity.
        u = np.linspace(1e-6, 1.0, 4001)
        density = scale * (1 + (x / u) ** 2 / degrees) ** (-(degrees + 1) / 2) * x / u**2
        weights = np.ones_like(u)
        weights[1:-1:2], weights[2:-1:2] = 4, 2
        return float(np.sum(weights * density) * (u[1] - u[0]) / 3)

    low, high = 0.01, 200.0
    for _ in range(80):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if tail(middle) > upper else (low, middle)
    return high


class Flight:
    """commands: ln of each motor's median command less the mean of the four; vibration: ln of the robust scatter of the
    vertical acceleration's first difference."""

    def __init__(self, folder, row):
        self.vehicle, self.fault, self.damaged, self.detail = row["vehicle"], row["fault"], row["damaged"], row["detail"]
        table = columns(folder / row["file"])
        if "m1" in table:
            motors = np.stack([table[f"m{i}"] for i in range(1, 5)], 1)
            vertical = table["az_g"]
        else:
            thrust, roll, pitch, yaw = (table[f"cmd_{axis}"] for axis in ("thrust", "roll", "pitch", "yaw"))
            motors = np.stack([thrust - roll / 2 + pitch / 2 + yaw, thrust - roll / 2 - pitch / 2 - yaw,
                               thrust + roll / 2 - pitch / 2 + yaw, thrust + roll / 2 + pitch / 2 - yaw], 1)
            vertical = table["accz_g"]
        high = np.flatnonzero(table["z_m"] > 0.35)
        flies = slice(high[0] + 100, high[-1] - 50)  # a second after reaching the square, half a second before leaving it
        command = np.log(np.median(np.clip(motors[flies] / 65535, 1e-3, 1), axis=0))
        self.commands = command - command.mean()
        steps = np.diff(vertical)[flies][np.diff(table["t_s"])[flies] < 0.012]
        self.vibration = math.log(1.4826 * np.median(np.abs(steps - np.median(steps))))

    @property
    def kind(self):
        """Damage and its size: of a cut, what both blades lost, and the difference between them, in mm."""
        if self.fault != "cut":
            return self.fault if self.fault in ("none", "tape") else "weight"
        if self.damaged != "M3":
            return "cut, M1 and M2" if "M1" in self.damaged else "cut, M2"
        first, second = map(float, re.fullmatch(r"M3:([\d.]+)/([\d.]+)", self.detail).groups())
        size = "up to 1 mm" if first <= 1 else "1.5 to 2 mm" if first <= 2 else "2.5 mm and more"
        return f"cut, M3, {size}, " + ("both blades alike" if first == second else "blades unlike")


def load(folder):
    with open(folder / "index.csv", encoding="utf-8") as file:
        return [Flight(folder, row) for row in csv.DictReader(file)]


def judge(flight, normal):
    """(motor blamed by its command or None, vibration alarm), from normal flights of the same vehicle."""
    count = len(normal)
    spread = math.sqrt(1 + 1 / count)  # of a new flight about a mean of few
    commands = np.array([one.commands for one in normal])
    sigma = math.sqrt(np.sum((commands - commands.mean(0)) ** 2) / (3 * (count - 1)) * 3 / 4)
    z = (flight.commands - commands.mean(0)) / (sigma * spread)
    blamed = int(np.argmax(z)) if z.max() > student_quantile(FALSE_ALARM / 4, 3 * (count - 1)) else None
    vibration = np.array([one.vibration for one in normal])
    z_vibration = (flight.vibration - vibration.mean()) / (vibration.std(ddof=1) * spread)
    return blamed, z_vibration > student_quantile(FALSE_ALARM, count - 1), float(np.max(z)), float(z_vibration)


def results(flights):
    """Of every flight, judged by the other normal ones: (flight, what judge() says)."""
    for flight in flights:
        normal = [one for one in flights if one.vehicle == flight.vehicle and one.fault == "none" and one is not flight]
        yield flight, judge(flight, normal)


def table(judged):
    """Rows of Markdown: vehicle, kind, flights, the right motor blamed, a wrong one, vibration alarms, medians of both."""
    groups = {}
    for flight, verdict in judged:
        groups.setdefault((flight.vehicle, flight.kind), []).append((flight, verdict))
    for (vehicle, kind), members in sorted(groups.items(), key=lambda item: (item[0][0], item[0][1] != "none", item[0][1])):
        blamed = [(flight, verdict[0]) for flight, verdict in members if verdict[0] is not None]
        right = sum(f"M{motor + 1}" in flight.damaged for flight, motor in blamed)
        shaken = sum(verdict[1] for _, verdict in members)
        yield (f"| {vehicle} | {kind} | {len(members)} | {right} | {len(blamed) - right} | {shaken} | "
               f"{np.median([verdict[2] for _, verdict in members]):.1f} | {np.median([verdict[3] for _, verdict in members]):.1f} |")
