#!/usr/bin/python3
"""Plants a violation of every kind in a temporary tree and expects tools/check_layers.py to name it."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]

# file, its text, what the checker must say; an empty expectation means: nothing.
CASES = {
    "core includes its own and Eigen": (
        "core/a/a.h", '#include <array>\n#include <Eigen/Core>\n#include "core/time/time.h"\n', ""),
    "core includes a container": (
        "core/a/a.h", "#pragma once\n#include <vector>\n",
        "core/a/a.h:2: layer core may not include the standard header vector "),
    "core includes a clock's layer": (
        "core/a/a.h", '#include "runtime/clock/clock.h"\n', "core/a/a.h:1: layer core may not include runtime: "),
    "core includes a message": (
        "core/a/a.cpp", '#include "airworthy/imu_t.hpp"\n', "layer core may not include lcmtypes: airworthy/imu_t.hpp"),
    "an include in a comment": (
        "core/a/a.h", "// #include <vector>\n/*\n#include <string>\n*/\n", ""),
    "an include in a raw string": (
        "tests/core/a_test.cpp", 'const char* code = R"(\n#include "nowhere.h"\n)";\n', ""),
    "an include after a comment keeps its line": (
        "core/a/a.h", "/* one\n two\n*/\n#include <string>\n", "core/a/a.h:4: "),
    "runtime includes a service": (
        "runtime/bus/a.cpp", '#include "services/response/response_service.h"\n',
        "layer runtime may not include services: "),
    "runtime includes ZeroMQ": ("runtime/a.cpp", "#include <zmq.hpp>\n", "layer runtime may not include zeromq: zmq.hpp"),
    "runtime includes its libraries": (
        "runtime/a.cpp", "#include <toml++/toml.h>\n#include <lcm/lcm-cpp.hpp>\n#include <CLI/CLI.hpp>\n"
        "#include <systemd/sd-daemon.h>\n#include <spdlog/spdlog.h>\n#include <sys/socket.h>\n#include <thread>\n", ""),
    "a driver includes LCM itself": (
        "drivers/mavlink/a.cpp", "#include <lcm/lcm-cpp.hpp>\n", "layer drivers may not include lcm: "),
    "a driver includes toml++": ("drivers/can/a.cpp", "#include <toml++/toml.h>\n", "layer drivers may not include toml: "),
    "a service includes another": (
        "services/response/a.cpp", '#include "services/limits/limits_service.h"\n',
        "layer services: response may not include services/limits/limits_service.h "),
    "a service includes its own folder": ("services/response/a.cpp", '#include "services/response/a.h"\n', ""),
    "a service opens a socket": ("services/response/a.cpp", "#include <sys/socket.h>\n", "layer services may not include posix: "),
    "a service includes the exit codes": ("services/response/main.cpp", "#include <sysexits.h>\n", ""),
    "a service includes the gateway": (
        "services/response/a.cpp", '#include "gateway/health/model.h"\n', "layer services may not include gateway_health: "),
    "the gateway includes its health model": ("gateway/main.cpp", '#include "gateway/health/model.h"\n', ""),
    "the health model includes a container": ("gateway/health/model.h", "#include <map>\n#include <string>\n", ""),
    "the health model includes a message": (
        "gateway/health/model.h", '#include "airworthy/tick_t.hpp"\n', "layer gateway_health may not include lcmtypes: "),
    "the health model includes the gateway": (
        "gateway/health/model.h", '#include "gateway/feed.h"\n', "layer gateway_health may not include gateway: "),
    "the health model includes a thread": (
        "gateway/health/model.h", "#include <thread>\n", "layer gateway_health may not include the standard header thread "),
    "ground includes a message": ("ground/a.cpp", "#include <airworthy/imu_t.hpp>\n", "layer ground may not include lcmtypes: "),
    "the gateway includes Beast": ("gateway/a.cpp", "#include <boost/beast.hpp>\n", "layer gateway may not include beast: "),
    "sim includes a detector": (
        "sim/a.cpp", '#include "core/detectors/gate.h"\n', "layer sim may not include core/detectors/gate.h "),
    "sim includes a codec": ("sim/a.cpp", '#include "core/protocol/crc.h"\n', ""),
    "a command includes a service": (
        "cli/doctor/a.cpp", '#include "services/response/a.h"\n', "layer cli may not include services: "),
    "evaluation includes a service": ("cli/eval/a.cpp", '#include "services/response/a.h"\n', ""),
    "watch includes a message": ("cli/watch/a.cpp", '#include "airworthy/imu_t.hpp"\n', "layer cli_watch may not include lcmtypes: "),
    "watch includes the feed's libraries": ("cli/watch/a.cpp", "#include <zmq.hpp>\n#include <nlohmann/json.hpp>\n", ""),
    "firmware includes runtime": ("firmware/a.cpp", '#include "runtime/error.h"\n', "layer firmware may not include runtime: "),
    "a test is included": ("core/a/a.cpp", '#include "tests/support/a.h"\n', "layer core may not include free: "),
    "a library includes a test framework": ("runtime/a.cpp", "#include <gtest/gtest.h>\n", "layer runtime may not include testing: "),
    "a test includes anything": (
        "tests/system/a.cpp", '#include <gtest/gtest.h>\n#include <rapidcheck.h>\n#include "services/response/a.h"\n', ""),
    "a path that does not start at the root": (
        "runtime/a.cpp", '#include "a.h"\n', "runtime/a.cpp:1: a.h: not a path from the project root"),
    "an unknown library": (
        "runtime/a.cpp", "#include <absl/time/time.h>\n", "absl/time/time.h: unknown header; name it in layers.toml"),
    "a folder without a layer": ("misc/a.cpp", "", "misc/a.cpp:1: belongs to no layer of layers.toml"),
    "a file of a build": ("build/dev/a.cpp", '#include "a.h"\n', ""),
    "words in comments and strings": (
        "core/a/a.cpp", '// throws nothing, new in 2\nconstexpr auto kText = "throw new malloc(";  /* std::vector */\n'
        "constexpr auto kRaw = R\"x(printf(\")\")x\";\nconstexpr char kQuote = '\"';\nconstexpr int kMany = 1'000'000;\n", ""),
    "code after a digit separator": (
        "core/a/a.cpp", "constexpr int kMany = 1'000;\nstd::vector<int> v;\n", "core/a/a.cpp:2: layer core may not use a type that allocates: std::vector "),
    "names that only resemble": (
        "core/a/a.h", "std::string_view renew(TimePoint time);\nA(const A&) = delete;\nauto t = sample.time();\n", ""),
}

POISON = {
    "a clock": ["std::chrono::steady_clock::now()", "system_clock c", "high_resolution_clock c"],
    "the time of day": ["time(nullptr)", "std::time(0)"],
    "the heap": ["auto* a = new int", "delete a", "malloc(4)", "free (a)"],
    "an exception": ["throw 1", "try {", "catch (...)"],
    "run-time type information": ["dynamic_cast<A*>(b)", "typeid(a)"],
    "input or output": ["printf(a)", "std::cout << 1"],
    "a type that allocates": ["std::vector<int> a", "std::string a", "std::function<void()> f"],
    "a matrix that allocates": ["Eigen::MatrixXd m", "Eigen::VectorXf v", "Eigen::Matrix<float, Eigen::Dynamic, 1> v"],
    "chance": ["rand()", "srand(1)"],
    "a thread": ["std::thread t", "std::mutex m", "thread_local int a"],
}


def check(path, text):
    with tempfile.TemporaryDirectory() as root:
        file = pathlib.Path(root, path)
        file.parent.mkdir(parents=True)
        file.write_text(text, encoding="utf-8")
        run = subprocess.run([PROJECT / "tools/check_layers.py", root], capture_output=True, text=True, check=False)
        return run.returncode, run.stdout + run.stderr


class CheckLayers(unittest.TestCase):
    def test_cases(self):
        for name, (path, text, expected) in CASES.items():
            with self.subTest(name):
                code, output = check(path, text)
                self.assertEqual(code, 1 if expected else 0, output)
                self.assertIn(expected, output)
                self.assertEqual(len(output.splitlines()), 1 if expected else 0, output)

    def test_poison(self):
        for what, samples in POISON.items():
            for sample in samples:
                with self.subTest(sample):
                    code, output = check("core/a/a.cpp", f"\n{sample};\n")
                    self.assertEqual(code, 1, output)
                    self.assertIn(f"core/a/a.cpp:2: layer core may not use {what}: ", output)
                    self.assertEqual(check("runtime/a.cpp", f"\n{sample};\n"), (0, ""))

    def test_every_fault_of_a_file_is_named(self):
        code, output = check("core/a/a.cpp", "#include <vector>\n#include <string>\nstd::string s;\n")
        self.assertEqual(code, 1)
        self.assertEqual([line.split(":")[1] for line in output.splitlines()], ["1", "2", "3"])

    def test_the_project_is_clean(self):
        run = subprocess.run([PROJECT / "tools/check_layers.py"], capture_output=True, text=True, check=False)
        self.assertEqual((run.returncode, run.stdout), (0, ""))


if __name__ == "__main__":
    unittest.main(argv=sys.argv)
