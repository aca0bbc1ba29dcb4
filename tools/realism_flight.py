"""What is measured in one flight log, recorded or simulated: spectra, motor lag, control effectiveness."""
import struct

import numpy as np

FILTER_RAD_S, DAMPING = 50.0, 0.55  # of the effectiveness paper
CALM_RAD_S = 1.5
RPM = 30.0 / np.pi


def read_log(path, types):
    """Arrays of one log, by channel: time, then fields. The event format is that of LCM's logger."""
    data, offset = path.read_bytes(), 0
    rows = {"IMU": [], "ESC_STATUS": [], "ROTOR_COMMAND": [], "GROUND_TRUTH": []}
    while offset < len(data):
        _, _, _, name_size, size = struct.unpack_from(">IqqII", data, offset)
        offset += 28
        channel = data[offset:offset + name_size].decode().split("/")[-1]
        payload = data[offset + name_size:offset + name_size + size]
        offset += name_size + size
        if channel not in rows:
            continue
        message = types[channel].decode(payload)
        fields = {"IMU": lambda m: [*m.gyro_rad_s, *m.accel_m_s2], "ESC_STATUS": lambda m: m.speed_rpm,
                  "ROTOR_COMMAND": lambda m: m.command_ratio, "GROUND_TRUTH": lambda m: [m.onset_us / 1e6]}[channel](message)
        rows[channel].append([message.header.time_us / 1e6, *fields])
    return {channel: np.array(values) for channel, values in rows.items()}


def on_grid(grid, rows):
    """Columns of a channel at the times of the grid; what is missing is interpolated."""
    def column(values):
        known = np.isfinite(values)
        return np.interp(grid, rows[known, 0], values[known])
    return np.column_stack([column(values) for values in rows[:, 1:].T])


def low_pass(x, dt):
    """The paper's second-order filter, for rates, accelerations and squared speeds alike."""
    y, position, speed = np.empty_like(x), x[0].copy(), np.zeros_like(x[0])
    for i, value in enumerate(x):
        speed = speed + dt * (FILTER_RAD_S**2 * (value - position) - 2 * DAMPING * FILTER_RAD_S * speed)
        position = position + dt * speed
        y[i] = position
    return y


def first_order(x, dt, time_constant):
    y, state, share = np.empty_like(x), x[0].copy(), 1 - np.exp(-dt / time_constant)
    for i, value in enumerate(x):
        state = state + share * (value - state)
        y[i] = state
    return y


def density(x, rate):
    """Welch: one-sided amplitude density per √Hz of each column, Hann windows of about a second."""
    size = min(int(rate), len(x))
    window = np.hanning(size)
    parts = [x[i:i + size] - x[i:i + size].mean(0) for i in range(0, len(x) - size + 1, max(1, size // 2))]
    power = np.mean([np.abs(np.fft.rfft(part * window[:, None], axis=0))**2 for part in parts], axis=0)
    return np.fft.rfftfreq(size, 1 / rate), np.sqrt(2 * power / (rate * np.sum(window**2)))


def longest(mask):
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    if not len(edges):
        return slice(0, 0)
    begin, end = max(zip(edges[::2], edges[1::2]), key=lambda run_: run_[1] - run_[0])
    return slice(begin, end)


def folded(frequency, rate):
    return np.abs(frequency - rate * np.round(frequency / rate))


def in_band(frequencies, values, low, high):
    return values[(frequencies >= low) & (frequencies <= high)]


class Flight:
    """One log, cut into a hover and the whole of its motion in the air, and everything measured in it.

    `hover_s` and `motion_s` are seconds since the start; without them the longest stretches that look so, from `settled_s` on.
    """

    def __init__(self, log, settled_s=0.0, hover_s=None, motion_s=None):
        imu, esc = log["IMU"], log["ESC_STATUS"]
        self.rate = 1 / np.median(np.diff(imu[:, 0]))
        self.esc_rate = 1 / np.median(np.diff(esc[:, 0]))
        begin = max(imu[0, 0], esc[0, 0])
        end = min(imu[-1, 0], esc[-1, 0])
        onset = log["GROUND_TRUTH"][0, 1]
        self.t = np.arange(begin, min(end, onset - 0.2) if onset > 0 else end, 1 / self.rate)
        samples, self.w = on_grid(self.t, imu), on_grid(self.t, esc) / RPM
        self.gyro, self.accel = samples[:, :3], samples[:, 3:]
        self.filtered = low_pass(np.column_stack([samples, self.w**2 / 1e6]), 1 / self.rate)
        since_start = self.t - imu[0, 0]
        # In the air the rotors carry the weight.
        thrust, lift = self.filtered[:, 6:].sum(1), -self.filtered[:, 5]
        flying = (thrust > 0.5 * np.percentile(thrust, 95)) & (since_start > settled_s)
        calm = flying & (lift > 6.0) & (np.abs(self.filtered[:, :3]).max(1) < CALM_RAD_S)
        calm &= np.abs(self.t[:, None] - imu[np.clip(np.searchsorted(imu[:, 0], self.t)[:, None] + [-1, 0], 0, len(imu) - 1), 0]
                       ).min(1) < 2.5 / self.rate  # not where the recording has holes
        within = lambda span: (since_start > span[0]) & (since_start < span[1])  # noqa: E731
        self.motion = longest(within(motion_s) if motion_s else flying)
        self.hover = longest(within(hover_s) if hover_s else calm)
        command = log["ROTOR_COMMAND"]
        self.u = on_grid(self.t, command) if len(command) else None
        raw = esc[(esc[:, 0] >= self.t[self.hover.start]) & (esc[:, 0] <= self.t[self.hover.stop - 1])]
        # In order, not in time: interpolation between jittering times would smooth the noise away.
        order = np.arange(float(len(raw)))
        self.speed = on_grid(order, np.column_stack([order, raw[:, 1:]])) / RPM
        self.measure()

    def measure(self):
        self.numbers = numbers = {}
        self.f, self.imu_density = density(np.column_stack([self.gyro, self.accel])[self.hover], self.rate)
        high = min(100.0, 0.45 * self.rate)
        quiet = [in_band(self.f, column, 20.0, high) for column in self.imu_density.T]
        numbers["gyro"] = np.median(np.r_[quiet[0], quiet[1]])
        numbers["accel"] = np.median(np.r_[quiet[3], quiet[4]])
        numbers["accel_z"] = np.median(quiet[5])
        lines = folded(self.w[self.hover].mean(0) / (2 * np.pi), self.rate)
        low, top = lines.min() * 0.97, lines.max() * 1.03
        step = self.f[1]
        power = sum(np.sum(in_band(self.f, self.imu_density[:, axis], low, top)**2) for axis in (3, 4))
        numbers["unbalance"] = np.sqrt(power * step) if self.rate > 200 else np.nan
        numbers["gyro_rotor"] = np.sqrt(sum(np.sum(in_band(self.f, self.imu_density[:, axis], low, top)**2)
                                            for axis in (0, 1)) * step) if self.rate > 200 else np.nan
        self.speed_f, speed_density = density(self.speed / self.speed.mean(0), self.esc_rate)
        self.speed_density = np.median(speed_density, axis=1)
        numbers["rpm"] = np.median(in_band(self.speed_f, self.speed_density, 0.35 * self.esc_rate, self.esc_rate)
                                   ) * np.sqrt(self.esc_rate / 2)
        self.fit_lag()
        self.fit_effectiveness()

    def fit_lag(self):
        """speed = first order, after a dead time, of a polynomial in the command; residual over full speed."""
        numbers = self.numbers
        numbers.update(lag=np.nan, dead=np.nan, lag_residual=np.nan)
        self.lag_model = None
        if self.u is None:
            return
        u, w, skip = self.u[self.motion], self.w[self.motion], int(0.5 * self.rate)
        basis = np.concatenate([u, np.sqrt(np.maximum(u, 0)), u**2], axis=1)
        best = (np.inf,)
        for time_constant in np.arange(0.006, 0.08, 0.002):
            lagged = first_order(basis, 1 / self.rate, time_constant)
            for delay in range(int(0.04 * self.rate) + 1):
                x = np.roll(lagged, delay, axis=0)[skip:]
                error, models = 0.0, []
                for i in range(w.shape[1]):
                    columns = np.column_stack([x[:, i::w.shape[1]], np.ones(len(x))])
                    models.append(columns @ np.linalg.lstsq(columns, w[skip:, i], rcond=None)[0])
                    error += np.mean((w[skip:, i] - models[-1])**2) / w.shape[1]
                if error < best[0]:
                    best = (error, time_constant, delay / self.rate, models[0])
        numbers["lag_residual"] = np.sqrt(best[0]) / np.percentile(w, 99.9)
        numbers["lag"], numbers["dead"], self.lag_model = best[1:]
        self.lag_measured = w[skip:, 0]

    def fit_effectiveness(self):
        """ṗ, q̇ and az on the squared speeds of the rotors, telemetry shifted by what fits roll best."""
        derivative = np.gradient(self.filtered[:, :2], 1 / self.rate, axis=0)
        y = np.column_stack([derivative, self.filtered[:, 5]])
        best = None
        for shift in range(-int(0.04 * self.rate), int(0.01 * self.rate) + 1):
            x = np.roll(self.filtered[:, 6:], shift, axis=0)
            columns = np.column_stack([x, np.ones(len(x))])[self.motion]
            roll = np.linalg.lstsq(columns, y[self.motion, 0], rcond=None)[0]
            residual = np.std(y[self.motion, 0] - columns @ roll)
            if best is None or residual < best[0]:
                best = (residual, shift, columns)
        _, shift, columns = best
        numbers, hovering = self.numbers, slice(self.hover.start, self.hover.stop)
        rotors = np.roll(self.filtered[:, 6:], shift, axis=0)
        residuals, coefficients = [], []
        for axis, name in enumerate("pqz"):
            used = columns if name != "z" else columns[:, :-1]  # no force without rotors
            fit = np.linalg.lstsq(used, y[self.motion, axis], rcond=None)[0]
            coefficients.append(fit[:rotors.shape[1]])
            residual = y[self.motion, axis] - used @ fit
            in_hover = y[hovering, axis] - rotors[hovering] @ coefficients[-1]
            residuals.append(in_hover - (in_hover.mean() if name != "z" else 0.0))
            numbers[f"{name}_moving"] = np.sqrt(np.mean(residual**2))
            numbers[f"{name}_hover"] = np.sqrt(np.mean(residuals[-1]**2))
            numbers[f"{name}_r2"] = 1 - np.var(residual) / np.var(y[self.motion, axis])
        numbers["late"] = -shift / self.rate
        sizes = np.abs(coefficients[0])
        numbers["spread"] = np.std(sizes) / np.mean(sizes)
        numbers["z"] = np.mean(self.filtered[self.motion, 5]) / np.mean(columns[:, :-1].sum(1))
        self.residual_f, self.residual_density = density(np.column_stack(residuals), self.rate)
