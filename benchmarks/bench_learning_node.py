# SPDX-License-Identifier: Apache-2.0
"""A node that learns from a stream at 100 Hz: what it learns, and what its services pay for it.

Usage: python benchmarks/bench_learning_node.py

Pushes of a simulated body, 0.4 s each with a rest of 0.1 s, wrench and twist with noise; the
prior is a sphere, and half-way another body takes the first one's place. Round trips of
`~/wrench_to_twist`, asked of the model that is learnt, are timed in turns while the stream runs
and while it rests.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import WrenchToTwist
from node_processes import OURS, isolate, process, timed, wrench_message

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.clients.service_client import ServiceClient
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.08, 5.0)
LIMITS = [2.0, 1.0, 1.5]
BODIES = [
    PointContacts(
        np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]) + shift, LIMITS, SCALING
    )
    for shift in (0.0, np.array([0.04, 0.0]))
]
RATE, MOVING, RESTING = 100.0, 40, 10
# Of a push's direction, shared by its samples, and of each sample, in scaled variables.
OF_PUSH, OF_SAMPLE = 0.07, 0.05
PHASES, SECONDS = 4, 15.0
NODE = "/limit_surface"


def stream(body: int, seconds: float, seed: int) -> None:
    """Publish pushes of a body for so long; in a process of its own."""
    rng = np.random.default_rng(seed)
    rclpy.init()
    node = rclpy.create_node("robot")
    wrenches = node.create_publisher(WrenchStamped, f"{NODE}/measured_wrench", 100)
    twists = node.create_publisher(TwistStamped, f"{NODE}/measured_twist", 100)
    while not (wrenches.get_subscription_count() and twists.get_subscription_count()):
        time.sleep(0.01)
    time.sleep(0.3)
    begin = time.monotonic()
    unit = SCALING.twist_unit
    for sample in range(round(seconds * RATE)):
        time.sleep(max(0.0, begin + sample / RATE - time.monotonic()))
        place = sample % (MOVING + RESTING)
        if place == 0:
            pair = random_loads(BODIES[body], 1, rng)
            load = pair.wrenches[0]
            motion = pair.twists[0] / unit + OF_PUSH * rng.normal(size=3)
            motion *= 0.02 / np.linalg.norm(motion)
        wrench, twist = wrench_message(np.zeros(3)), TwistStamped()
        if place < MOVING:
            wrench = wrench_message(load * (1.0 + 0.02 * rng.normal(size=3)))
            noisy = unit * (motion + 0.02 * OF_SAMPLE * rng.normal(size=3))
            twist.twist.linear.x, twist.twist.linear.y, twist.twist.angular.z = noisy.tolist()
        twist.header.frame_id = wrench.header.frame_id
        wrench.header.stamp = twist.header.stamp = node.get_clock().now().to_msg()
        wrenches.publish(wrench)
        twists.publish(twist)
    rclpy.shutdown()


def angle(client: ServiceClient, model: str, body: int) -> float:
    """Return the mean angle [deg] between the twists of a served model and a body's."""
    angles = []
    for load, twist in zip(*vars_of(random_loads(BODIES[body], 60, 9)), strict=True):
        request = WrenchToTwist.Request(model=model, wrench=wrench_message(load))
        told = client.call(WrenchToTwist, f"{NODE}/wrench_to_twist", request).twist.twist
        found = np.array([told.linear.x, told.linear.y, told.angular.z]) / SCALING.twist_unit
        expected = twist / SCALING.twist_unit
        cosine = found @ expected / np.linalg.norm(found) / np.linalg.norm(expected)
        angles.append(np.arccos(min(1.0, cosine)))
    return float(np.degrees(np.mean(angles)))


def vars_of(pairs):
    """Return wrenches and twists of pairs."""
    return pairs.wrenches, pairs.twists


def round_trips(client: ServiceClient, going: object, seconds: float) -> list[float]:
    """Return round trips [s], some hundred a second, as long as told or something goes on."""
    request = WrenchToTwist.Request(model="body_learnt", wrench=wrench_message([2.0, 1.0, 0.05]))
    found, end = [], time.monotonic() + seconds
    while time.monotonic() < end and (going is None or going.poll() is None):
        found.append(timed(client.call, WrenchToTwist, f"{NODE}/wrench_to_twist", request))
        time.sleep(0.002)
    return found


def main() -> None:
    """Measure and print."""
    if len(sys.argv) > 1:
        stream(int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]))
        return
    print(__doc__)
    isolate()
    told: dict[str, str] = {}

    def note(message: DiagnosticArray) -> None:
        for value in message.status[0].values:
            told[value.key] = value.value

    with tempfile.TemporaryDirectory() as folder, ServiceClient("bench") as client:
        path = Path(folder) / "prior.yaml"
        write_surface_model(SurfaceModel("body", Dissipation(np.eye(3)[None], SCALING)), path)
        served = ["--ros-args", "-p", "learn:=true", "-p", f"model_files:=['{path}']"]
        client.node.create_subscription(DiagnosticArray, "/diagnostics", note, 10)
        with process([*OURS, *served]):
            print("| after | pushes | the body's twists by the prior [deg] | by what is learnt |")
            print("|---|---|---|---|")
            times: dict[str, list[float]] = {"resting": [], "learning": []}
            round_trips(client, None, 2.0)
            for phase in range(PHASES):
                body = int(phase >= PHASES // 2)
                command = [sys.executable, __file__, str(body), str(SECONDS), str(phase)]
                with subprocess.Popen(command) as running:
                    # It takes a while to begin.
                    time.sleep(3.0)
                    times["learning"] += round_trips(client, running, SECONDS - 3.0)
                time.sleep(2.5)
                pushes = re.search(r"(\d+) pushes", told.get("learning", "0 pushes"))
                prior, learnt = (angle(client, name, body) for name in ("body", "body_learnt"))
                name = f"{(phase + 1) * SECONDS:.0f} s" + (", another body" if body else "")
                print(f"| {name} | {pushes[1]} | {prior:.1f} | {learnt:.1f} |", flush=True)
                times["resting"] += round_trips(client, None, SECONDS - 3.0)
    print("\n| stream | calls | p50 [ms] | p99 [ms] | most [ms] |\n|---|---|---|---|---|")
    for name, found in times.items():
        p50, p99, most = (1e3 * np.quantile(found, share) for share in (0.5, 0.99, 1.0))
        print(f"| {name} | {len(found)} | {p50:.2f} | {p99:.2f} | {most:.1f} |")
    more = 1e3 * (np.quantile(times["learning"], 0.99) - np.quantile(times["resting"], 0.99))
    print(f"\nThe 99th percentile is {more:.1f} ms later beside the learning (goal < 10 ms).")
    print(f"Diagnostics at the end: {told.get('learning')}; {told.get('last pushes')}.")


if __name__ == "__main__":
    main()
