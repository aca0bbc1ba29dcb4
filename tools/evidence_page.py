"""What every piece of evidence needs: running programs, building presets, writing a page of docs/."""
import datetime
import os
import pathlib
import platform
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]


class Failed(Exception):
    """A piece of evidence came out against us, or could not be had; says why."""


def run(*command, **options):
    return subprocess.run([str(word) for word in command], cwd=ROOT, text=True, check=False, **options)


def output(*command):
    return run(*command, capture_output=True).stdout.strip()


def build(preset, target="all"):
    for command in (["cmake", "--preset", preset],
                    ["cmake", "--build", f"build/{preset}", "--parallel", os.cpu_count(), "--target", target]):
        if run(*command, stdout=sys.stderr).returncode != 0:
            raise Failed(f"'{' '.join(map(str, command))}' failed")


def circumstances():
    """Who did this to what: two lines for the head of a page."""
    dirty = " with uncommitted changes" if output("git", "status", "--porcelain", "--untracked-files=no") else ""
    model = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    return (f"Commit {output('git', 'rev-parse', '--short=12', 'HEAD')}{dirty}, "
            f"{datetime.datetime.now(datetime.timezone.utc):%Y-%m-%d}, {model.group(1) if model else platform.machine()}, "
            f"{os.cpu_count()} cores, {platform.freedesktop_os_release()['PRETTY_NAME']}.")


def page(name, lines):
    (ROOT / "docs" / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"evidence: wrote docs/{name}")
