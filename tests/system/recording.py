"""Recording and replaying the bus with LCM's own logger and player, and reading what they wrote."""
import importlib
import pathlib
import struct
import subprocess
import sys
import time

from system_test import PROJECT

TYPES = {"FAULT_EVENT": "fault_event_t", "DRIVER_STATUS": "driver_status_t", "IMU": "imu_t"}


def record(rig, name):
    """Starts lcm-logger; the log is in the rig's folder."""
    log = rig.path / name
    rig.start("lcm-logger", ["lcm-logger", "--quiet", "--force", f"--lcm-url={rig.lcm_url}&recv_buf_size=4000000", log])
    time.sleep(0.3)
    return log


def play_inputs(rig, log, vehicle):
    """Starts lcm-logplayer on the channels that a replay plays."""
    inputs = subprocess.run(["/usr/bin/python3", PROJECT / "tools/generate_channels.py", "regex",
                             PROJECT / "lcmtypes/channels.toml", "input", vehicle],
                            check=True, capture_output=True, text=True).stdout.strip()
    return rig.start("lcm-logplayer", ["lcm-logplayer", "-e", inputs, "-l", rig.lcm_url, log])


def python_bindings(folder):
    """Decoders made by lcm-gen: independent of our C++."""
    subprocess.run(["lcm-gen", "-p", "--ppath", folder, *(PROJECT / "lcmtypes").glob("*.lcm")], check=True)
    sys.path.insert(0, str(folder))
    package = importlib.import_module("airworthy")
    return {channel: getattr(package, name) for channel, name in TYPES.items()}


def read_log(path):
    """Yields (event number, channel, payload) of an LCM log."""
    data, offset = pathlib.Path(path).read_bytes(), 0
    while offset + 28 <= len(data):
        sync, number, _, channel_length, size = struct.unpack(">Iqqii", data[offset:offset + 28])
        assert sync == 0xEDA1DA01, f"{path}: byte {offset}"
        offset += 28
        channel = data[offset:offset + channel_length].decode()
        offset += channel_length
        yield number, channel, data[offset:offset + size]
        offset += size


def lost_messages(path, vehicle):
    """Numbers missing in the headers of each producer and channel: what sender or logger lost."""
    last, lost = {}, 0
    for _, channel, payload in read_log(path):
        if not channel.startswith(f"{vehicle}/"):
            continue  # LCM's own self test
        _, _, seq, length = struct.unpack(">qqqi", payload[8:36])
        producer = payload[36:36 + length]
        session = struct.unpack(">q", payload[36 + length:44 + length])[0]
        key = (channel, producer, session)
        if key in last:
            lost += seq - last[key] - 1
        last[key] = seq
    return lost


def events(path, bindings, vehicle):
    """What was decided, without who decided it and when it was sent."""
    decided = []
    for _, channel, payload in read_log(path):
        if channel != f"{vehicle}/FAULT_EVENT":
            continue
        event = bindings["FAULT_EVENT"].decode(payload)
        decided.append((event.number, event.phase, event.component, event.fault_kind, event.onset_us,
                        event.detected_us, event.header.time_us, event.magnitude,
                        tuple((item.name, item.value) for item in event.evidence)))
    return decided
