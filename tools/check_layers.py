#!/usr/bin/python3
"""Checks who includes whom.

  check_layers.py [ROOT]     default: the project this file belongs to

The rules are in tools/layers.toml. Each violation is one line `file:line: layer A may not include B (why)`; the exit
code is then 1.
"""
import pathlib
import re
import sys
import tomllib

RULES = pathlib.Path(__file__).resolve().parent / "layers.toml"
SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".c"}
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:<([^>\n]+)>|"([^"\n]+)")', re.MULTILINE)
# Numbers are tokens so that the ' of 1'000 opens no character; raw strings so that their quotes close nothing.
TOKEN = re.compile(
    r'''(?P<comment>//(?:\\\n|[^\n])*|/\*.*?(?:\*/|\Z))|(?P<number>\b\d(?:[\w.]|'\w)*)'''
    r'''|(?P<string>R"(?P<mark>[^()\\\s]*)\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')''', re.DOTALL)


def blank(text, is_wanted):
    """The text with the wanted tokens turned into spaces: every line keeps its number."""
    return TOKEN.sub(lambda token: re.sub(r"[^\n]", " ", token.group()) if is_wanted(token) else token.group(), text)


def hides_includes(token):
    return token.lastgroup == "comment" or (token.lastgroup == "string" and "\n" in token.group())


def is_no_code(token):
    return token.lastgroup in ("comment", "string")


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


class Rules:
    def __init__(self, table):
        self.layers, self.groups, self.standard = table["layer"], table["group"], table["standard"]
        self.poison = {what: re.compile(pattern) for what, pattern in table["poison"].items()}
        self.prefixes = sorted(((prefix, name) for name, layer in self.layers.items() for prefix in layer["paths"]),
                               key=lambda pair: -len(pair[0]))
        known = {*self.layers, *self.groups, "*"}
        for name, layer in self.layers.items():
            unknown = set(layer["may"]) - known
            if unknown:
                sys.exit(f"{RULES}: layer.{name}: no layer or group called {', '.join(sorted(unknown))}")

    def layer_of(self, path):
        return next((name for prefix, name in self.prefixes if path.startswith(prefix)), None)

    def groups_of(self, header):
        def begins(start):
            return header == start if start.endswith((".h", ".hpp")) else header.startswith(start)
        return [name for name, starts in self.groups.items() if any(map(begins, starts))]

    def is_standard(self, header):
        return any(header in names for names in self.standard.values())

    def fault(self, path, header, quoted):
        """What is wrong with this include in this file, or None."""
        name = self.layer_of(path)
        layer = self.layers[name]
        why = f"({layer['why']})"
        free = "*" in layer["may"]
        target = self.layer_of(header)
        if target:
            if any(header.startswith(prefix) for prefix in layer.get("may_not", [])):
                return f"layer {name} may not include {header} {why}"
            if target == name:
                stranger = layer.get("own_subfolder") and header.split("/")[1] != path.split("/")[1]
                return f"layer {name}: {path.split('/')[1]} may not include {header} {why}" if stranger else None
            allowed = free or target in layer["may"]
            return None if allowed else f"layer {name} may not include {target}: {header} {why}"
        groups = self.groups_of(header)
        if groups:
            allowed = free or set(groups) & set(layer["may"])
            return None if allowed else f"layer {name} may not include {groups[0]}: {header} {why}"
        if self.is_standard(header):
            sets = layer.get("standard", list(self.standard))
            allowed = any(header in self.standard[which] for which in sets)
            return None if allowed else f"layer {name} may not include the standard header {header} {why}"
        if quoted:
            return f"{header}: not a path from the project root"
        return f"{header}: unknown header; name it in {RULES.name}"


def check_file(rules, path, text):
    name = rules.layer_of(path)
    directives = blank(text, hides_includes)
    for match in INCLUDE.finditer(directives):
        fault = rules.fault(path, match.group(1) or match.group(2), match.group(2) is not None)
        if fault:
            yield f"{path}:{line_of(text, match.start())}: {fault}"
    if rules.layers[name].get("poison"):
        code = blank(INCLUDE.sub(lambda match: " " * len(match.group()), directives), is_no_code)
        for what, pattern in rules.poison.items():
            for match in pattern.finditer(code):
                yield (f"{path}:{line_of(code, match.start())}: layer {name} may not use {what}: "
                       f"{match.group().strip()} ({rules.layers[name]['why']})")


def check(root, rules):
    faults = []
    for top in sorted(entry for entry in root.iterdir() if entry.is_dir()):
        if top.name.startswith((".", "build")):
            continue
        for file in sorted(file for file in top.rglob("*") if file.suffix in SUFFIXES and file.is_file()):
            path = file.relative_to(root).as_posix()
            if rules.layer_of(path) is None:
                faults.append(f"{path}:1: belongs to no layer of {RULES.name}")
                continue
            faults += check_file(rules, path, file.read_text(encoding="utf-8", errors="replace"))
    return faults


def main(arguments):
    if len(arguments) > 1 or arguments[:1] in (["-h"], ["--help"]):
        print(__doc__.strip())
        sys.exit(0 if len(arguments) == 1 else 64)
    rules = Rules(tomllib.loads(RULES.read_text(encoding="utf-8")))
    faults = check(pathlib.Path(arguments[0]) if arguments else RULES.parent.parent, rules)
    if faults:
        print("\n".join(faults))
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
