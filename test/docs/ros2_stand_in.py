# SPDX-License-Identifier: Apache-2.0
"""Stands in for the commands of ros2cli that the documentation uses, where it is absent.

It runs the real programs and calls the real services and topics, with what the page says. What
cannot be run in a test is checked as far as it can be: launch files and rviz configurations exist,
`make` targets exist.
"""

from __future__ import annotations

import os
import re
import sys
import threading
from pathlib import Path

from limit_surface_ros.nodes.clients.plain_messages import fill, type_of

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "docs")]
WAIT = 300.0


def filled(message, text):
    """Return a message whose fields are set from YAML, as ros2cli does."""
    fill(message, read(text))
    return message


def read(text):
    """Return YAML as a mapping."""
    import yaml

    values = yaml.safe_load(text)
    assert isinstance(values, dict), text
    return values


class Peer:
    """A node of its own, spun in a thread."""

    def __enter__(self):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.task import Future

        rclpy.init()
        self.node = rclpy.create_node(f"stand_in_{os.getpid()}")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.over = Future()
        spin = self.executor.spin_until_future_complete
        self.thread = threading.Thread(target=spin, args=(self.over,))
        self.thread.start()
        return self.node

    def __exit__(self, *_):
        import rclpy

        # First the thread: rclpy's `shutdown` takes from one that runs what it needs.
        self.over.set_result(None)
        self.thread.join()
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown()


def run(package, name, *arguments):
    """`ros2 run`: become the program."""
    from generate_reference import programs

    assert package == "limit_surface_ros", package
    module = programs()[name]
    code = f"import sys, {module} as m; sys.argv[0] = {name!r}; sys.exit(m.main())"
    os.execv(sys.executable, [sys.executable, "-c", code, *arguments])


def call_service(name, kind, text="{}"):
    """`ros2 service call`: call it, print the answer."""
    service = type_of(kind)
    with Peer() as node:
        client = node.create_client(service, name)
        if not client.wait_for_service(timeout_sec=WAIT):
            sys.exit(f"no service {name} of type {kind}")
        answered = threading.Event()
        future = client.call_async(filled(service.Request(), text))
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(WAIT):
            sys.exit(f"service {name} did not answer")
        print(future.result(), flush=True)


def publish(once, name, kind, text="{}"):
    """`ros2 topic pub --once`: wait for somebody who listens, publish."""
    assert once == "--once", once
    message = filled(type_of(kind)(), text)
    with Peer() as node:
        publisher = node.create_publisher(type(message), name, 1)
        looked = threading.Event()
        for _ in range(int(WAIT / 0.05)):
            if publisher.get_subscription_count():
                publisher.publish(message)
                publisher.wait_for_all_acked()
                return
            looked.wait(0.05)
    sys.exit(f"nobody listens to {name}")


def launch(package, name, *_):
    """`ros2 launch`: the file exists."""
    assert package == "limit_surface_ros", package
    if not (ROOT / "launch" / name).is_file():
        sys.exit(f"no launch file {name}")


def prefix(share, package):
    """`ros2 pkg prefix --share`: where config/ and launch/ are."""
    assert (share, package) == ("--share", "limit_surface_ros")
    print(ROOT)


def ros2(words):
    """Do what a line of the documentation says."""
    verbs = {
        ("run",): run,
        ("service", "call"): call_service,
        ("topic", "pub"): publish,
        ("launch",): launch,
        ("pkg", "prefix"): prefix,
    }
    for verb, action in verbs.items():
        if tuple(words[: len(verb)]) == verb:
            return action(*words[len(verb) :])
    sys.exit(f"this stand-in does not know: ros2 {' '.join(words)}")


def rviz2(words):
    """The configuration exists."""
    assert words[0] == "-d"
    if not Path(words[1]).is_file():
        sys.exit(f"no such configuration: {words[1]}")


def make(words):
    """The target exists."""
    target = next(word for word in words if "=" not in word)
    # Read, and not asked of make: the make on this PATH is this very program.
    if not re.search(rf"^{re.escape(target)}:", (ROOT / "Makefile").read_text(), re.MULTILINE):
        sys.exit(f"the Makefile has no target {target}")


if __name__ == "__main__":
    {"ros2": ros2, "rviz2": rviz2, "make": make}[sys.argv[1]](sys.argv[2:])
