# SPDX-License-Identifier: Apache-2.0
"""From process start to the first answered call: our node against an empty one, and many models.

Needs a sourced ROS 2 with this package built; `make bench` sees to it.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np
import rclpy
from limit_surface_interfaces.srv import WrenchToTwist
from node_processes import OURS, isolate, process, resident, wrench_message
from std_srvs.srv import Trigger

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.clients.service_client import AGAIN
from limit_surface_ros.surface.kinds.power_sum import PowerSum

if TYPE_CHECKING:
    from collections.abc import Sequence

ROUNDS = 9
GOAL = 0.3
# How many, and the kind: whether thesis's exponents give a convex surface is looked at when read.
MODELS = ((1, "norms"), (1_000, "norms"), (10_000, "norms"), (1_000, "thesis"))
PATIENCE = 120.0
SLOW_MODULES = ("scipy", "scipy.optimize", "matplotlib", "limit_surface_ros.fitting")
EMPTY = [sys.executable, str(Path(__file__).with_name("empty_node.py"))]
QUESTION = (
    WrenchToTwist,
    "limit_surface/wrench_to_twist",
    WrenchToTwist.Request(wrench=wrench_message((1.0, 0.0, 0.0))),
)


def first_answer(
    service_type: Any, name: str, request: Any, command: Sequence[str]
) -> tuple[float, float, Any]:
    """Start a node, call a service of it until it answers, end it.

    Who asks is new each time: an old participant finds one that takes the place of another only
    after seconds.

    Returns:
        Time from process start to the answer [s], resident memory then [MB], and the answer.
    """
    rclpy.init()
    asker = rclpy.create_node("asker")
    client = asker.create_client(service_type, name)
    try:
        begin = time.perf_counter()
        with process(command) as running:
            while not client.service_is_ready():
                if running.poll() is not None or time.perf_counter() - begin > PATIENCE:
                    raise RuntimeError(f"{shlex.join(command)} does not answer")
                time.sleep(0.002)
            answer = None
            while answer is None and time.perf_counter() - begin < PATIENCE:
                # A node that has not discovered who asks yet drops its answer: ask again.
                future = client.call_async(request)
                rclpy.spin_until_future_complete(asker, future, timeout_sec=AGAIN)
                answer = future.result()
            seconds = time.perf_counter() - begin
            return seconds, resident(running.pid) / 1024, answer
    finally:
        asker.destroy_node()
        rclpy.shutdown()


def write_models(folder: Path, count: int, family: str) -> None:
    """Write `count` models of three terms that differ in their names."""
    surface = getattr(PowerSum, family)([np.eye(3), 2.0 * np.eye(3), 3.0 * np.eye(3)])
    first = folder / "object_00000.yaml"
    write_surface_model(SurfaceModel("object_00000", surface), first)
    text = first.read_text()
    for i in range(1, count):
        name = f"object_{i:05d}"
        (folder / f"{name}.yaml").write_text(text.replace("object_00000", name))


def import_time(module: str) -> float:
    """Return how long a fresh process takes to start and import a module [s]."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", f"import {module}"], check=True)
    return time.perf_counter() - begin


def imports() -> None:
    """Print import times, and what the node's import brings."""
    modules = ["sys", "numpy", "rclpy.node", "limit_surface_ros.files.surface_file"]
    modules += ["limit_surface_ros.nodes.limit_surface_node"]
    modules += ["scipy.optimize", "limit_surface_ros.tools.fit_surface"]
    times: dict[str, list[float]] = {module: [] for module in modules}
    for _ in range(3):
        for module in modules:
            times[module].append(import_time(module))
    base = median(times.pop("sys"))
    print("### Import times\n")
    print("Of a fresh process, less that of one that imports nothing.\n")
    print("| module | time [s] |\n|---|---|")
    for module, values in times.items():
        print(f"| {module} | {median(values) - base:.2f} |")
    code = (
        "import sys, limit_surface_ros.nodes.limit_surface_node;"
        f"print(*[name for name in {SLOW_MODULES} if name in sys.modules])"
    )
    brought = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    found = brought.stdout.decode().strip() or "none"
    print(f"\nOf {', '.join(SLOW_MODULES)}, the node's import brings: {found} (goal: none).\n")


def start_up() -> None:
    """Print the time to the first answer of the node and of an empty one."""
    times: dict[str, list[float]] = {"empty": [], "ours": []}
    for _ in range(ROUNDS):
        times["empty"].append(first_answer(Trigger, "empty", Trigger.Request(), EMPTY)[0])
        times["ours"].append(first_answer(*QUESTION, OURS)[0])
    middle = {name: median(values) for name, values in times.items()}
    more = middle["ours"] - middle["empty"]
    print("### From process start to the first answered call\n")
    print("| node | median [s] | least [s] | most [s] |\n|---|---|---|---|")
    for name, label in (("empty", "empty rclpy node"), ("ours", "limit_surface")):
        values = times[name]
        print(f"| {label} | {middle[name]:.2f} | {min(values):.2f} | {max(values):.2f} |")
    verdict = "met" if more <= GOAL else "missed"
    print(f"\nOurs takes {more:.2f} s more (goal: at most {GOAL} s: {verdict}).\n", flush=True)


def many_models() -> None:
    """Print start-up time and memory with few and with many models."""
    print("### Many models in one node\n")
    print("| models | first answer [s] | resident memory [MB] | each model [ms] | [kB] |")
    print("|---|---|---|---|---|")
    base = (0.0, 0.0)
    for count, family in MODELS:
        with tempfile.TemporaryDirectory() as name:
            write_models(Path(name), count, family)
            command = [*OURS, "--ros-args", "-p", f"model_files:=[{name}]"]
            seconds, memory, answer = first_answer(*QUESTION, command)
        assert answer.error_code == 0, answer.error_msg
        base = base if any(base) else (seconds, memory)
        each = ((seconds - base[0]) / count * 1e3, (memory - base[1]) / count * 1e3)
        print(
            f"| {count} of 3 {family} terms | {seconds:.2f} | {memory:.0f} | {each[0]:.2f} "
            f"| {each[1]:.1f} |"
        )


def main() -> None:
    """Print all tables."""
    imports()
    isolate()
    start_up()
    many_models()


if __name__ == "__main__":
    main()
