# SPDX-License-Identifier: Apache-2.0
"""Messages for the node tests, and processes of the package's programs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped, WrenchStamped

from process_helpers import WAIT

STAMP = Time(sec=7, nanosec=8)


def stamp_message(nanosec):
    """Return a stamp of so many nanoseconds."""
    return Time(sec=1, nanosec=nanosec)


def wrench_message(wrench, frame="object", stamp=STAMP):
    """Return a stamped planar wrench (fx, fy, tau_z)."""
    message = WrenchStamped()
    message.header.frame_id = frame
    message.header.stamp = stamp
    message.wrench.force.x, message.wrench.force.y, message.wrench.torque.z = map(float, wrench)
    return message


def twist_message(twist, frame="object", stamp=STAMP):
    """Return a stamped planar twist (vx, vy, omega_z)."""
    message = TwistStamped()
    message.header.frame_id = frame
    message.header.stamp = stamp
    message.twist.linear.x, message.twist.linear.y, message.twist.angular.z = map(float, twist)
    return message


def planar_wrench(stamped):
    """Return (fx, fy, tau_z)."""
    wrench = stamped.wrench
    return np.array([wrench.force.x, wrench.force.y, wrench.torque.z])


def planar_twist(stamped):
    """Return (vx, vy, omega_z)."""
    twist = stamped.twist
    return np.array([twist.linear.x, twist.linear.y, twist.angular.z])


def handled(health, name):
    """Return how many messages of a topic a node has accepted or refused."""
    # A list at once: the node's thread counts meanwhile.
    refused = list(health.refused.items())
    return health.accepted[name] + sum(count for (where, _), count in refused if where == name)


class Program:
    """A program of the package in a process of its own; killed if a test leaves it behind."""

    def __init__(self, module: str, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", f"limit_surface_ros.nodes.{module}", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def end(self, number: int = signal.SIGINT) -> tuple[int, str]:
        """Send a signal and return exit code and output."""
        self.process.send_signal(number)
        return self.ended()

    def ended(self) -> tuple[int, str]:
        """Wait for the end and return exit code and output."""
        output, _ = self.process.communicate(timeout=WAIT)
        return self.process.returncode, output


def processor_ticks(pid: int) -> int:
    """Return the processor time that a process has used, in user mode."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11])
