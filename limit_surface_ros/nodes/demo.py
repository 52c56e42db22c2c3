# SPDX-License-Identifier: Apache-2.0
"""Show the two nodes at work.

Starts both nodes in a process of their own and asks the first from this one what a handful of
loads do to the body of the default model, prints a table, and checks each answer: the load that
the answered motion needs must do as much work on it as the limit load of the same direction (the
principle of maximum dissipation, there and back through both services). It has a tip push the
body along a path, and compares the end with the batch service. Then it gives the second an onset,
prints the falling wrench, and compares the time at which sliding stops with its closed form. The
exit code tells whether all agree.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import Twist, TwistStamped, Wrench, WrenchStamped
from limit_surface_interfaces.srv import ListModels, TwistToWrench, WrenchToTwist

from limit_surface_ros.nodes.clients import demo_decay, demo_push
from limit_surface_ros.nodes.clients.service_client import ServiceClient
from limit_surface_ros.nodes.messages import convert

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

TOLERANCE = 1e-6
# How long the nodes may take to start and to answer, on the busiest machine [s].
PATIENCE = 300.0
ACROSS = 0.04  # [m] from the reference point to the turning point of the facet's motion
HEADING = (
    f"{'load':<28}{'fx [N]':>9}{'fy [N]':>9}{'tau [Nm]':>10}{'factor':>9}  {'body':<8}"
    f"{'vx':>8}{'vy':>8}{'omega':>9}{'round trip':>12}"
)


@dataclass(frozen=True)
class Answer:
    """What became of one load."""

    wrench: tuple[float, float, float]
    load_factor: float
    slides: bool
    twist: tuple[float, float, float]
    error: float

    def row(self, name: str) -> str:
        """Return one line of the table."""
        fx, fy, tau = self.wrench
        vx, vy, omega = self.twist if self.slides else (0.0, 0.0, 0.0)
        body = "slides" if self.slides else "sticks"
        return (
            f"{name:<28}{fx:>9.3f}{fy:>9.3f}{tau:>10.4f}{self.load_factor:>9.3f}  {body:<8}"
            f"{vx:>8.3f}{vy:>8.3f}{omega:>9.3f}{self.error:>12.1e}"
        )


class Demo:
    """Asks a running node.

    Args:
        client: Calls its services.
        namespace: The node's namespace.
    """

    def __init__(self, client: ServiceClient, namespace: str) -> None:
        """Find out which model is the default."""
        self._client = client
        self._prefix = f"{namespace}/limit_surface"
        self.model = self._ask(ListModels, "list_models", ListModels.Request()).models[0]

    def limit_load(self, twist: Sequence[float]) -> tuple[float, float, float]:
        """Return the load on the surface that makes a motion."""
        return _planar_wrench(self._needed(_twist(twist)).wrench.wrench)

    def answer(self, wrench: Sequence[float]) -> Answer:
        """Ask what a load does, and there and back again."""
        message = Wrench()
        convert.fill_wrench(message, wrench)
        stamped = WrenchStamped(wrench=message)
        stamped.header.frame_id = self.model.frame_id
        found = self._ask(WrenchToTwist, "wrench_to_twist", WrenchToTwist.Request(wrench=stamped))
        power = self._needed(found.twist.twist).power
        limit, twist = _planar_wrench(found.limit_wrench.wrench), _planar_twist(found.twist.twist)
        work = sum(force * velocity for force, velocity in zip(limit, twist, strict=True))
        return Answer(
            _planar_wrench(message),
            found.load_factor,
            found.slides,
            twist,
            abs(power - work) / power,
        )

    def _needed(self, twist: Twist) -> TwistToWrench.Response:
        stamped = TwistStamped(twist=twist)
        stamped.header.frame_id = self.model.frame_id
        return self._ask(TwistToWrench, "twist_to_wrench", TwistToWrench.Request(twist=stamped))

    def _ask(self, service_type: Any, name: str, request: Any) -> Any:
        answer = self._client.call(service_type, f"{self._prefix}/{name}", request)
        if answer.error_code:
            raise RuntimeError(
                f"{name} answered with error {answer.error_code}: {answer.error_msg}"
            )
        return answer


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demonstration; return 0 if every answer agrees."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(
        description=__doc__,
        epilog="docs/tutorials/first_hour.md takes the same way step by step.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.parse_args(argv)
    namespace = f"/demo_{os.getpid()}"
    try:
        with (
            _running_nodes(namespace) as alive,
            ServiceClient("demo", PATIENCE, alive) as client,
        ):
            demo = Demo(client, namespace)
            agrees = _show(demo)
            push = [3.0 * part for part in demo.limit_load([1.0, 0.0, 0.0])]
            agrees &= demo_push.show(client, namespace, demo.model.frame_id)
            agrees &= demo_decay.show(client, namespace, demo.model.frame_id, push)
    except (RuntimeError, TimeoutError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    if not agrees:
        print("demo: MISMATCH, see above", file=sys.stderr)
    return 0 if agrees else 1


def _show(demo: Demo) -> bool:
    model = demo.model
    print(f"model {model.name} ({model.kind}, {model.terms} terms), frame {model.frame_id}\n")
    print(HEADING)
    straight = demo.limit_load([1.0, 0.0, 0.0])
    rotating = demo.limit_load([0.0, 0.0, 1.0])
    about_corner = demo.limit_load([-ACROSS, ACROSS, 1.0])
    loads = {
        "straight, 1.5 x the limit": [1.5 * part for part in straight],
        "rotating, 1.5 x the limit": [1.5 * part for part in rotating],
        "both, off centre": [a + 0.5 * b for a, b in zip(straight, rotating, strict=True)],
        "inside, half the limit": [0.5 * part for part in straight],
        "at a facet, about a corner": [1.2 * part for part in about_corner],
    }
    answers = {name: demo.answer(load) for name, load in loads.items()}
    for name, answer in answers.items():
        print(answer.row(name))
    wrong = [name for name, answer in answers.items() if not answer.error < TOLERANCE]
    if answers["inside, half the limit"].slides or not answers["straight, 1.5 x the limit"].slides:
        wrong.append("sticking and sliding")
    print()
    if wrong:
        print(f"MISMATCH beyond {TOLERANCE:g}: {', '.join(wrong)}")
        return False
    print(f"all {len(answers)} round trips agree within {TOLERANCE:g}")
    return True


@contextlib.contextmanager
def _running_nodes(namespace: str) -> Iterator[Callable[[], bool]]:
    """Run the nodes in a process of their own, and end it as Ctrl-C would.

    Gives a function that tells whether they still run.
    """
    command = [sys.executable, "-m", "limit_surface_ros.nodes.force_motion_nodes"]
    process = subprocess.Popen([*command, "--ros-args", "-r", f"__ns:={namespace}"])
    try:
        yield lambda: process.poll() is None
        if process.poll() is not None:
            raise RuntimeError(f"the nodes ended early with exit code {process.returncode}")
    finally:
        process.send_signal(signal.SIGINT)
        try:
            code = process.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
    if code:
        raise RuntimeError(f"the nodes ended with exit code {code}")


def _twist(twist: Sequence[float]) -> Twist:
    message = Twist()
    convert.fill_twist(message, twist)
    return message


def _planar_wrench(wrench: Wrench) -> tuple[float, float, float]:
    return wrench.force.x, wrench.force.y, wrench.torque.z


def _planar_twist(twist: Twist) -> tuple[float, float, float]:
    return twist.linear.x, twist.linear.y, twist.angular.z


if __name__ == "__main__":
    sys.exit(main())
