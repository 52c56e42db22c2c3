"""The limit_surface node under load for half a minute: nothing lost, nothing wrong, nothing grows.

Usage: python benchmarks/bench_soak.py [SECONDS]

1 kHz of wrenches of which 1 % are bad, four clients that check every answer against the library,
and a reload each second. The exit code is 1 if an answer was lost or wrong.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from ament_index_python.packages import get_package_share_directory
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import WrenchToTwist
from node_processes import OURS, isolate, process, resident, wrench_message
from std_srvs.srv import Trigger

from limit_surface_ros.files.surface_file import SurfaceModel, read_surface_model
from limit_surface_ros.nodes.service_client import ServiceClient

SECONDS = 30.0
WARM_UP = 5.0
RATE = 1000.0
CLIENTS = 4
MODEL = "triangle_patch"
PREFIX = "/limit_surface"


@dataclass
class Tally:
    """What was seen."""

    calls: int = 0
    lost: int = 0
    wrong: int = 0
    sent: int = 0
    bad: int = 0
    reloads: int = 0
    due: dict[tuple[int, int], float] = field(default_factory=dict)
    delays: list[float] = field(default_factory=list)


def ask(tally: Tally, model: SurfaceModel, seed: int, end: float) -> None:
    """Call until the end and check each answer."""
    rng = np.random.default_rng(seed)
    with ServiceClient(f"soak_client_{seed}") as client:
        while time.perf_counter() < end:
            wrench = rng.normal(size=3) * [2.0, 2.0, 0.1]
            request = WrenchToTwist.Request(
                model=model.name, wrench=wrench_message(wrench, model.frame_id)
            )
            try:
                answer = client.call(WrenchToTwist, f"{PREFIX}/wrench_to_twist", request)
            except TimeoutError:
                tally.lost += 1
                continue
            tally.calls += 1
            found = answer.twist.twist
            twist = [found.linear.x, found.linear.y, found.angular.z]
            expected = model.surface.twist_of_wrench(wrench)
            factor = float(model.surface.load_factor(wrench))
            right = np.allclose(twist, expected, rtol=1e-9, atol=1e-9)
            if not right or not math.isclose(answer.load_factor, factor, rel_tol=1e-9):
                tally.wrong += 1


def reload(tally: Tally, end: float) -> None:
    """Reload the models once a second."""
    with ServiceClient("soak_reloader") as client:
        while time.perf_counter() < end:
            answer = client.call(Trigger, f"{PREFIX}/reload", Trigger.Request())
            tally.reloads += answer.success
            time.sleep(1.0)


def stream(tally: Tally, publisher: Any, frame: str, end: float) -> None:
    """Publish wrenches at a steady rate, one in a hundred of them bad."""
    due = time.perf_counter()
    while due < end:
        time.sleep(max(0.0, due - time.perf_counter()))
        number, due = tally.sent, due + 1.0 / RATE
        message = wrench_message([2.0, 1.0, 0.05], frame)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(number, 1000)
        tally.sent += 1
        if number % 100 == 99:
            message.wrench.force.x = math.nan
            tally.bad += 1
        else:
            tally.due[number // 1000, number % 1000] = time.perf_counter()
        publisher.publish(message)


def main() -> int:
    """Load the node and print what became of it."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    isolate()
    share = get_package_share_directory("limit_surface_ros")
    model = read_surface_model(f"{share}/config/models/{MODEL}.yaml")
    tally = Tally()
    command = [*OURS, "--ros-args", "-p", f"default_model:={MODEL}"]
    with process(command) as node, ServiceClient("soak") as client:

        def take(message: TwistStamped) -> None:
            stamp = message.header.stamp
            tally.delays.append(time.perf_counter() - tally.due.pop((stamp.sec, stamp.nanosec)))

        client.node.create_subscription(TwistStamped, f"{PREFIX}/predicted_twist", take, 100)
        publisher = client.node.create_publisher(WrenchStamped, f"{PREFIX}/wrench", 100)
        client.call(Trigger, f"{PREFIX}/reload", Trigger.Request())
        while not publisher.get_subscription_count():
            time.sleep(0.01)
        end = time.perf_counter() + WARM_UP + seconds
        threads = [
            threading.Thread(target=ask, args=(tally, model, seed, end)) for seed in range(CLIENTS)
        ]
        threads.append(threading.Thread(target=reload, args=(tally, end)))
        threads.append(
            threading.Thread(target=stream, args=(tally, publisher, model.frame_id, end))
        )
        for thread in threads:
            thread.start()
        time.sleep(WARM_UP)
        before, skipped = resident(node.pid), len(tally.delays)
        for thread in threads:
            thread.join()
        after = resident(node.pid)
        alive = node.poll() is None
    delays = np.array(tally.delays[skipped:]) * 1e3
    good = tally.sent - tally.bad
    print(f"### {seconds:g} s after {WARM_UP:g} s of warming up\n")
    print("| what | seen | goal |")
    print("|---|---|---|")
    print(f"| service calls answered | {tally.calls} | |")
    print(f"| answers lost | {tally.lost} | 0 |")
    print(f"| answers that differ from the library | {tally.wrong} | 0 |")
    print(f"| reloads | {tally.reloads} | |")
    print(f"| good wrenches sent / answered | {good} / {len(tally.delays)} | |")
    print(f"| bad wrenches sent | {tally.bad} | |")
    print(f"| topic path p50 / p99 [ms] | {np.median(delays):.2f} / ", end="")
    print(f"{np.quantile(delays, 0.99):.2f} | p99 < 5 |")
    print(f"| resident memory [MB] | {before / 1e3:.1f} -> {after / 1e3:.1f} ", end="")
    print(f"({(after / before - 1) * 100:+.2f} %) | < 1 % |")
    return 0 if alive and not tally.lost and not tally.wrong else 1


if __name__ == "__main__":
    sys.exit(main())
