"""Evidence for the detector of lost effectiveness: simulated and recorded flights."""
import collections
import hashlib

from evidence_page import ROOT, Failed, build, circumstances, page, run

PROGRAMS = ROOT / "build/dev/bin"
LOST = ("lost", 0, 1200)
LOSSES = ("0.1", "0.2", "0.3", "0.4", "0.6")
PARTIAL_FLIGHTS = 400
EXCESSES = ("0.2", "0.3", "0.5")
EXCESS_FLIGHTS = 48
MOUNTED, SUDDEN = ("0", "120"), ("10", "1")  # onset and how long it is waited for, s
RETURNS, RETURN_FLIGHTS, RETURN_S = ("0.2", "0.3", "0.4"), 96, 4
SPINS = (0, 96, 80)
HEALTHY = {"flights": ("healthy", 0, 310, 2, 60), "landings": ("healthy", 5000, 24, 20, 10)}


def flown(name, arguments, options=()):
    """Lines of the simulated flights; kept beside the hash of the program, so that a broken run goes on."""
    program = PROGRAMS / "effectiveness_evidence"
    folder = ROOT / "build/evidence/effectiveness" / hashlib.sha256(program.read_bytes()).hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder / f"{name}.txt"
    lines = kept.read_text().splitlines() if kept.exists() else []
    if len(lines) < arguments[2]:
        print(f"evidence: effectiveness {name}, {arguments[2]} flights", flush=True)
        done = run(program, *options, *arguments, capture_output=True)
        if done.returncode != 0:
            raise Failed(done.stderr)
        kept.write_text(done.stdout)
        lines = done.stdout.splitlines()
    return [line.split() for line in lines[:arguments[2]]]


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))]


def delays(rows, rotor_column):
    """Delays of right alarms, and how many flights were missed, alarmed before the fault, or blamed another rotor."""
    right, missed, early, wrong = [], 0, 0, 0
    for row in rows:
        if row[rotor_column] == "-":
            missed += 1
        elif float(row[rotor_column + 1]) < 0:
            early += 1
        elif row[rotor_column] != row[3]:
            wrong += 1
        else:
            right.append(float(row[rotor_column + 1]))
    return right, missed, early, wrong


def delay_row(name, rows, column):
    right, missed, early, wrong = delays(rows, column)
    numbers = " | ".join(f"{quantile(right, share):.0f}" for share in (0.5, 0.95, 0.99)) if right else "– | – | –"
    return f"| {name} | {len(rows)} | {numbers} | {max(right, default=0):.0f} | {missed} | {early} | {wrong} |"


def lost_lines(rows):
    head = ["| flights | n | median ms | 95 % | 99 % | most | missed | before the fault | wrong rotor |",
            "|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    table = [delay_row("ours, all", rows, 6), delay_row("published filter, all", rows, 10)]
    groups = collections.defaultdict(list)
    for row in rows:
        groups[row[1]].append(row)
        groups[row[2]].append(row)
    table += [delay_row(f"ours, {name}", group, 6) for name, group in groups.items()]
    table += [delay_row(f"published filter, {name}", group, 10) for name, group in groups.items()]
    kinds = collections.Counter(row[9] for row in rows)
    judged = sum(row[5] == "1" for row in rows)
    return head + table + ["", f"Judged at the onset: {judged} of {len(rows)} flights. First called a lost propeller: "
                           f"{kinds['propeller_lost']}; a partial loss of at least half, for the time being: "
                           f"{kinds['partial_loss']}."]


def partial_lines():
    lines = ["| loss | flights | found within 10 s | median ms | 95 % | mean | clairvoyant mean ms | ratio | wrong rotor | "
             "before | k read, mean ± deviation | k true |", "|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for loss in LOSSES:
        rows = flown(f"partial_{loss}", ("partial", 0, PARTIAL_FLIGHTS, loss))
        right, missed, early, wrong = delays(rows, 6)
        # The yardstick on the flights that ours found, or it would be compared with other flights.
        known = [float(row[13]) for row in rows if row[6] == row[3] and row[13] != "-" and float(row[7]) >= 0]
        read = [float(row[8]) for row in rows if row[6] == row[3]]
        if not right:
            lines.append(f"| {loss} | {len(rows)} | 0 | – | – | – | – | – | {wrong} | {early} | – | {1 - float(loss):.1f} |")
            continue
        mean, best = sum(right) / len(right), sum(known) / len(known)
        centre = sum(read) / len(read)
        spread = (sum((k - centre) ** 2 for k in read) / len(read)) ** 0.5
        lines.append(f"| {loss} | {len(rows)} | {len(right)} | {quantile(right, .5):.0f} | {quantile(right, .95):.0f} | "
                     f"{mean:.0f} | {best:.0f} | {mean / best:.2f} | {wrong} | {early} | {centre:.2f} ± {spread:.2f} | "
                     f"{1 - float(loss):.1f} |")
    return lines


def excess_table():
    """How often a propeller that gives too much is found, and what it is read to give."""
    lines = ["| excess | flights | found | median s | 95 % | most | wrong rotor or kind | k read, mean ± deviation | k true |",
             "|--:|--:|--:|--:|--:|--:|--:|--:|--:|"]
    by_vehicle = collections.defaultdict(dict)
    for excess in EXCESSES:
        rows = flown(f"over_mounted_{excess}", ("over", 0, EXCESS_FLIGHTS, excess, *MOUNTED))
        said = [row for row in rows if row[5] != "-"]
        right = [row for row in said if row[5] == row[3] and row[8] == "over_effective"]
        for row in rows:
            found, flights = by_vehicle[row[1]].get(excess, (0, 0))
            by_vehicle[row[1]][excess] = (found + (row in right), flights + 1)
        if not right:
            lines.append(f"| {excess} | {len(rows)} | 0 | – | – | – | {len(said)} | – | {1 + float(excess):.1f} |")
            continue
        times, read = [float(row[6]) for row in right], [float(row[7]) for row in right]
        centre = sum(read) / len(read)
        spread = (sum((k - centre) ** 2 for k in read) / len(read)) ** 0.5
        lines.append(f"| {excess} | {len(rows)} | {len(right)} | {quantile(times, .5):.0f} | {quantile(times, .95):.0f} | "
                     f"{max(times):.0f} | {len(said) - len(right)} | {centre:.2f} ± {spread:.2f} | {1 + float(excess):.1f} |")
    lines += ["", f"| found of flights | {' | '.join(EXCESSES)} |", f"|---|{'--:|' * len(EXCESSES)}"]
    return lines + [f"| {name} | " + " | ".join("{} of {}".format(*counts[excess]) for excess in EXCESSES) + " |"
                    for name, counts in by_vehicle.items()]


def sudden_lines():
    lines = ["| excess | flights | another rotor blamed |", "|--:|--:|--:|"]
    for excess in EXCESSES:
        rows = flown(f"over_sudden_{excess}", ("over", 0, EXCESS_FLIGHTS, excess, *SUDDEN))
        lines.append(f"| {excess} | {len(rows)} | {sum(row[5] not in ('-', row[3]) for row in rows)} |")
    return lines


def return_lines():
    lines = ["| loss | flights | loss found | return found | wrong rotor | median ms | 95 % | k read, mean ± deviation |",
             "|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for loss in RETURNS:
        rows = flown(f"returns_{loss}", ("returns", 0, RETURN_FLIGHTS, loss))
        found = [row for row in rows if row[5] == "1"]
        right = [row for row in found if row[6] == row[3]]
        times, read = [float(row[7]) for row in right], [float(row[8]) for row in right]
        centre = sum(read) / len(read)
        spread = (sum((k - centre) ** 2 for k in read) / len(read)) ** 0.5
        lines.append(f"| {loss} | {len(rows)} | {len(found)} | {len(right)} | "
                     f"{sum(row[6] not in ('-', row[3]) for row in found)} | {quantile(times, .5):.0f} | {quantile(times, .95):.0f} | "
                     f"{centre:.2f} ± {spread:.2f} |")
    return lines


def spin_lines():
    lines = ["| vehicle file | flights | named | not named | not noticed | wrongly named | rotors blamed | median s | most |",
             "|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    groups = collections.defaultdict(list)
    for row in flown("spin", ("spin", *SPINS)):
        wrong = int(row[3], 16).bit_count()
        groups[{0: "right", 1: "one rotor", 2: "two neighbours exchanged"}.get(wrong, "all rotors")].append(row)
    for name, rows in groups.items():
        noticed = [row for row in rows if row[4] != "0"]
        named = [row for row in noticed if row[5] == "1"]
        right = sum(row[3] == row[4] for row in named)
        times = [float(row[6]) for row in noticed]
        seconds = f"{quantile(times, .5):.0f} | {max(times):.0f}" if times else "– | –"
        lines.append(f"| {name} | {len(rows)} | {right} | {len(noticed) - len(named)} | {len(rows) - len(noticed)} | "
                     f"{len(named) - right} | {sum(row[8] != '0' for row in rows)} | {seconds} |")
    return lines


def healthy_lines():
    lines = ["| flights | off the ground | judged | take-offs | false alarms, ours | published filter |",
             "|---|--:|--:|--:|--:|--:|"]
    found = []
    for name, arguments in HEALTHY.items():
        rows = flown(name, arguments)
        total = [sum(float(row[i]) for row in rows) for i in range(3, 8)]
        lines.append(f"| {name}: {len(rows)} of {arguments[3]} × {arguments[4]} s | {total[0] / 3600:.2f} h | "
                     f"{total[1] / 3600:.2f} h | {total[2]:.0f} | {total[3]:.0f} | {total[4]:.0f} |")
        found += [" ".join(row) for row in rows if len(row) > 8]
    return lines + (["", "Every alarm (rotor @ s; spin: rotors said to turn the other way):", ""] + [f"- {line}" for line in found] if found else [])


def effectiveness(_):
    build("dev", "effectiveness_evidence")
    lost = flown("lost", LOST)
    page("evidence_effectiveness.md", [
        "# Lost propellers and partial losses", "",
        "Written by `tools/evidence effectiveness`. Simulated at *hard* realism (`sim/realism.toml`: mass, inertia and thrust",
        "wrong by 10 %, 10 % and 7 %, telemetry 8 to 11 ms late at 100 Hz), mean wind drawn from 0 to 10 m/s, all shipped",
        "multirotors, hover, circle and random set-points in turn. The detector knows the vehicle file, latencies of 5 ms for",
        "commands and 10 ms for telemetry, and that the rotors are numbered as described; one threshold, from 1e-4 false",
        "alarms per hour. Delays count from the physical loss to the arrival of the message that decided, so that waiting for",
        "commands and late telemetry is inside. Of the delay, 1 ms is the inertial unit's stamp and about 1.3 ms its low-pass.",
        "The published filter gets the same synchronised speeds, a pull to 1 (0.02 a step) in what its rows do not see, and the",
        "reading of a single fault, measured from the mean of its last 3 s of flight, that leaves at most a fifth unexplained and",
        "lasts 12 ms: longer than one report of the speeds.",
        "Seeds are 1000 + number of the flight.", "", circumstances(), "",
        "## A propeller comes off", "", *lost_lines(lost), "",
        "## A part of the thrust is lost", "",
        "Clairvoyant: a cumulative sum that knows rotor and size, on the same innovations, its threshold for the same rate of",
        "false alarms; on the flights that ours found.", "", *partial_lines(), "",
        "## A part of the thrust comes back", "",
        f"After {RETURN_S} s of a partial loss the rotor gives all of its thrust again. A verdict right after it says that of the",
        "same rotor; wrong would be the loss of another.", "", *return_lines(), "",
        "## A rotor gives too much thrust", "",
        "A wrong propeller, mounted on the ground; times since lift-off. Two minutes are waited for.", "",
        *excess_table(), "",
        "The same beginning in flight, which no propeller does, is never named. It must not be called a loss of the opposite",
        "rotor, which has the same moments and differs in the lift alone; 1 s is waited for.", "", *sudden_lines(), "",
        "## A vehicle file with a wrong sense of rotation", "",
        f"Healthy flights of {SPINS[2]} s, times since lift-off.", "", *spin_lines(), "",
        "## Healthy flights", "", *healthy_lines(), "",
        "Recorded flights: [evidence_effectiveness_recorded.md](evidence_effectiveness_recorded.md)."])
