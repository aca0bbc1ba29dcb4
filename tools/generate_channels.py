#!/usr/bin/python3
"""Generates everything that knows the channels from lcmtypes/channels.toml.

  generate_channels.py header CHANNELS.toml    the C++ constants
  generate_channels.py docs CHANNELS.toml      the page docs/channels.md
  generate_channels.py regex CHANNELS.toml ROLE VEHICLE
                                               regular expression of all channels with a role, for lcm-logplayer -e
Every fault of the table is reported, then the exit code is 1.
"""
import pathlib
import re
import sys
import tomllib

KEYS = {"name": str, "type": str, "role": str, "producer": str, "nominal_Hz": float, "staleness_ms": int, "about": str}
ROLES = ("input", "derived", "truth")


def load(path):
    table = tomllib.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    errors, names = [], set()
    for number, row in enumerate(table.get("channel", []), start=1):
        where = f"{path}: channel {number} ({row.get('name', 'no name')})"
        errors += [f"{where}: {key}: missing" for key in KEYS if key not in row]
        errors += [f"{where}: {key}: unknown key" for key in row if key not in KEYS]
        errors += [f"{where}: {key}: must be {kind.__name__}" for key, kind in KEYS.items()
                   if key in row and not isinstance(row[key], kind)]
        if not re.fullmatch(r"[A-Z_]{1,40}", str(row.get("name", ""))):
            errors.append(f"{where}: name: must be 1 to 40 of A-Z and _")
        if row.get("name") in names:
            errors.append(f"{where}: name: given twice")
        names.add(row.get("name"))
        if row.get("role") not in ROLES:
            errors.append(f"{where}: role: must be one of {', '.join(ROLES)}")
        if not (pathlib.Path(path).parent / f"{row.get('type')}.lcm").exists():
            errors.append(f"{where}: type: no file {row.get('type')}.lcm beside the table")
    if not table.get("channel"):
        errors.append(f"{path}: no [[channel]] entry")
    if errors:
        sys.exit("\n".join(errors))
    return table["channel"]


def constant(name):
    return "k" + "".join(part.capitalize() for part in name.split("_"))


def header(channels):
    out = ["// Generated from lcmtypes/channels.toml by tools/generate_channels.py; change that table instead.",
           "#pragma once", "", "#include <array>", ""]
    out += sorted({f'#include "airworthy/{row["type"]}.hpp"' for row in channels})
    out += ['#include "runtime/bus/channel.h"']
    out += ["", "namespace airworthy::channel {", ""]
    for row in channels:
        out += [f"/// {row['about']}",
                f"inline constexpr rt::Channel<{row['type']}> {constant(row['name'])}{{",
                f"    {{\"{row['name']}\", rt::Role::k{row['role'].capitalize()}, \"{row['producer']}\", "
                f"{row['nominal_Hz']}, Duration{{{row['staleness_ms'] * 1000}}}}}}};", ""]
    out.append(f"inline constexpr std::array<rt::ChannelInfo, {len(channels)}> kAll{{")
    out += [f"    {constant(row['name'])}.info," for row in channels]
    out += ["};", "", "}  // namespace airworthy::channel"]
    return "\n".join(out)


def docs(channels):
    out = ["# Channels", "",
           "Generated from `lcmtypes/channels.toml` by `tools/generate_channels.py docs`. On the bus every name is",
           "prefixed by the vehicle: `<vehicle>/<channel>`. A replay plays the channels whose role is `input`.", "",
           "| channel | type | role | producer | nominal | stale after | carries |", "|---|---|---|---|--:|--:|---|"]
    for row in channels:
        rate = f"{row['nominal_Hz']:g} Hz" if row["nominal_Hz"] else "as it comes"
        stale = f"{row['staleness_ms']} ms" if row["staleness_ms"] else "–"
        out.append(f"| {row['name']} | [{row['type']}](../lcmtypes/{row['type']}.lcm) | {row['role']} | "
                   f"{row['producer']} | {rate} | {stale} | {row['about']} |")
    return "\n".join(out)


def regex(channels, role, vehicle):
    if role not in ROLES:
        sys.exit(f"role '{role}' must be one of {', '.join(ROLES)}")
    return f"^{vehicle}/({'|'.join(row['name'] for row in channels if row['role'] == role)})$"


def main(arguments):
    if len(arguments) == 2 and arguments[0] in ("header", "docs"):
        print({"header": header, "docs": docs}[arguments[0]](load(arguments[1])))
    elif len(arguments) == 4 and arguments[0] == "regex":
        print(regex(load(arguments[1]), *arguments[2:]))
    else:
        sys.exit(__doc__.strip())


if __name__ == "__main__":
    if sys.argv[1:] in (["-h"], ["--help"]):
        print(__doc__.strip())
    else:
        main(sys.argv[1:])
