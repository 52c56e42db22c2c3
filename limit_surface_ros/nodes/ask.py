# SPDX-License-Identifier: Apache-2.0
"""Ask a running node: call a service, listen to a topic, or send one message.

It stands in for `ros2 service call`, `ros2 topic echo` and `ros2 topic pub --once` where there is
no `ros2`. Without a name it lists what the nodes that run here can be asked. What is not given of
a message is zero; a frame that is not given is that of the request's own header, or else that of
the model, which the decay node does not tell.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import TYPE_CHECKING, Any

import yaml
from limit_surface_interfaces.msg import ErrorCode
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from limit_surface_ros.errors import FileError, LimitSurfaceError, RangeError
from limit_surface_ros.nodes.clients.plain_messages import fill, text_of, type_of
from limit_surface_ros.nodes.clients.service_client import ServiceClient

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

EXAMPLES = """examples:
  ask                                            what can be asked
  ask wrench_to_twist --force 3 0 --torque 0.1
  ask twist_to_wrench --velocity 1 0 --turning 0.5 --model triangle
  ask push --at 0 0.04 --normal 0 -1 --friction 0.3 --velocity 0 -0.01
  ask predict_stop --force 9 2 --frame object
  ask limit_surface/list_models
  ask predicted_twist --count 3                  listen to a topic
  ask onset --send --force 9 2                   send one message

Fields that no option names are given in YAML, as to ros2:
  ask evaluate '{times: [0.0, 0.5, 1.0]}'
  ask linearise_push '{contact: {x: -0.05, y: 0.01}, input: [0.02, 0.0]}' --friction 0.3
  ask simulate_push '{tip_radius: 0.005, tip_path: {poses: [
      {pose: {position: {x: -0.1}}}, {pose: {position: {x: 0.05, y: 0.02}}}]}}' --frame table
      (of a model with an outline)
  ask predict_slide '{inertia: {inertia: {m: 0.3, izz: 0.0005}}}' --velocity 0.5 0 --frame object

docs/tutorials/first_hour.md shows it at work; README.md lists services and topics, and
limit_surface_interfaces/srv says what their fields are.
"""
# Where an option's numbers go: the first of these paths that a message has.
PATHS = {
    "force": ("wrench.wrench.force", "wrench.force"),
    "torque": ("wrench.wrench.torque.z", "wrench.torque.z"),
    "velocity": ("twist.twist.linear", "twist.linear", "velocity"),
    "turning": ("twist.twist.angular.z", "twist.angular.z"),
    "at": ("contact",),
    "normal": ("normal",),
    "friction": ("friction",),
    "model": ("model",),
}
# Services that every node of rclpy has, and topics that are of no interest here.
_OF_RCLPY = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
    "get_type_description",
    "parameter_events",
    "rosout",
)
# The graph counts as known once nothing was found for so long [s].
_SETTLED = 0.4
FAILED, USAGE_ERROR = 1, 2


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = argparse.ArgumentParser(
        prog="ask",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("name", nargs="?", help="of a service or topic, or the end of its name")
    top.add_argument("fields", nargs="?", default="{}", help="fields of the message, in YAML")
    top.add_argument("--model", help="name of the model; default: the node's")
    top.add_argument("--frame", help="frame of what is given; default: the model's")
    numbers = {"nargs": "+", "type": float, "metavar": "X"}
    top.add_argument("--force", **numbers, help="of a load: x y [N]")
    top.add_argument("--torque", type=float, metavar="X", help="of a load: about z [N m]")
    top.add_argument("--velocity", **numbers, help="of a motion or a pusher: x y [m/s]")
    top.add_argument("--turning", type=float, metavar="X", help="of a motion: about z [rad/s]")
    top.add_argument("--at", **numbers, help="where a pusher touches: x y [m]")
    top.add_argument("--normal", **numbers, help="of a push, into the body: x y")
    top.add_argument("--friction", type=float, metavar="X", help="between pusher and body")
    top.add_argument("--send", action="store_true", help="send one message to the topic")
    top.add_argument("--count", type=int, default=1, help="messages to wait for (%(default)s)")
    top.add_argument("--wait", type=float, default=10.0, help="at most so long [s] (%(default)g)")
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Ask, print the answer, and return the exit code: 1 if a node refuses."""
    options = parser().parse_args(argv)
    try:
        check(options)
        with ServiceClient("ask") as client:
            return answer(client, options)
    except LimitSurfaceError as error:
        print(f"ask: error: {error}", file=sys.stderr)
        return USAGE_ERROR
    except TimeoutError as error:
        print(f"ask: error: {error}", file=sys.stderr)
        return FAILED


def check(options: argparse.Namespace) -> None:
    """Refuse numbers that mean nothing, before there is a node.

    Raises:
        RangeError: A vector has not two or three components, or a count or time is too small.
    """
    for name in ("force", "velocity", "at", "normal"):
        given = getattr(options, name)
        if given is not None and len(given) not in (2, 3):
            raise RangeError(f"--{name} takes x and y, or x, y and z; got {len(given)} numbers")
    if options.count < 1 or not options.wait > 0.0:
        raise RangeError("--count must be at least 1, and --wait above 0 s")


def answer(client: ServiceClient, options: argparse.Namespace) -> int:
    """Do what the options ask for and return the exit code."""
    services = Names("service", client.node.get_service_names_and_types)
    topics = Names("topic", client.node.get_topic_names_and_types)
    if options.name is None:
        return show(services, topics, options.wait)
    wanted = [topics] if options.send else [services, topics]
    names, name, kind = found(wanted, options.name, options.wait)
    if names is services:
        return call(client, name, type_of(kind), options)
    if options.send:
        return send(client, name, type_of(kind), options)
    return listen(client, name, type_of(kind), options)


class Names:
    """Services or topics of the graph that belong to this package's nodes, or to anybody's.

    Args:
        noun: What they are, for messages.
        read: Of a node: names, each with its types.
    """

    def __init__(self, noun: str, read: Callable[[], list[tuple[str, list[str]]]]) -> None:
        """Know where to look."""
        self.noun = noun
        self._read = read

    def known(self) -> dict[str, str]:
        """Return the names there are now, without rclpy's own, each with its type."""
        return {
            name: types[0]
            for name, types in sorted(self._read())
            if name.rpartition("/")[2] not in _OF_RCLPY and "/ask/" not in name
        }

    def matching(self, wanted: str) -> dict[str, str]:
        """Return those of that name, or whose names end in it."""
        end = "/" + wanted.lstrip("/")
        return {
            name: kind
            for name, kind in self.known().items()
            if name == wanted or (name.endswith(end) and not wanted.startswith("/"))
        }


def settled(look: Callable[[], Any], wait: float) -> Any:
    """Look at the graph until something is found and nothing more comes, and return it."""
    end, before, since = time.monotonic() + wait, look(), time.monotonic()
    while time.monotonic() < end:
        time.sleep(0.02)
        now = look()
        if now != before:
            before, since = now, time.monotonic()
        elif now and time.monotonic() - since > _SETTLED:
            break
    return before


def found(wanted: Sequence[Names], name: str, wait: float) -> tuple[Names, str, str]:
    """Return the one service or topic of a name, of the first sort that has it.

    Raises:
        TimeoutError: There is none in time; the error lists what there is.
        RangeError: Several have that name.
    """
    settled(lambda: [names.matching(name) for names in wanted if names.matching(name)], wait)
    for names in wanted:
        matching = names.matching(name)
        if len(matching) > 1:
            raise RangeError(
                f"{len(matching)} {names.noun}s are called {name}: name one of "
                f"{', '.join(matching)}"
            )
        for full, kind in matching.items():
            return names, full, kind
    listed = [full for names in wanted for full in names.known()]
    there = f"; there are {', '.join(listed)}" if listed else ": does a node run?"
    raise TimeoutError(f"no {wanted[0].noun} {name} after {wait:g} s{there}")


def show(services: Names, topics: Names, wait: float) -> int:
    """List services and topics with their types."""
    settled(lambda: {**services.known(), **topics.known()}, min(wait, 5.0))
    lines = [
        f"{names.noun:<8} {name:<44} {kind}"
        for names in (services, topics)
        for name, kind in names.known().items()
    ]
    print("\n".join(lines) if lines else "no node runs that this machine hears")
    return 0 if lines else FAILED


def call(client: ServiceClient, name: str, kind: Any, options: argparse.Namespace) -> int:
    """Call a service and print what it answers, or why it refuses and nothing else."""
    request = filled(
        kind.Request(), options, lambda model: frame_of(client, name, model, options.wait)
    )
    response = client.call(kind, name, request, options.wait)
    code = getattr(response, "error_code", ErrorCode.NONE)
    if code != ErrorCode.NONE:
        # The other fields of a refusal are zeros, which would read like an answer.
        print(f"ask: refused: {code_name(code)}: {response.error_msg}", file=sys.stderr)
        return FAILED
    if not getattr(response, "success", True):
        print(f"ask: refused: {response.message}", file=sys.stderr)
        return FAILED
    print(text_of(response))
    return 0


def send(client: ServiceClient, name: str, kind: Any, options: argparse.Namespace) -> int:
    """Send one message to whoever listens."""
    message = filled(kind(), options, lambda model: frame_of(client, name, model, options.wait))
    publisher = client.node.create_publisher(kind, name, 1)
    end = time.monotonic() + options.wait
    while not publisher.get_subscription_count():
        if time.monotonic() > end:
            raise TimeoutError(f"nobody listens to {name}")
        time.sleep(0.02)
    publisher.publish(message)
    publisher.wait_for_all_acked()
    print(f"sent to {name}")
    return 0


def listen(client: ServiceClient, name: str, kind: Any, options: argparse.Namespace) -> int:
    """Print messages of a topic as they come."""
    received: list[Any] = []
    subscription = client.node.create_subscription(
        kind, name, received.append, qos_of(client.node, name)
    )
    end = time.monotonic() + options.wait
    shown = 0
    while shown < options.count:
        for message in received[shown : options.count]:
            print(f"{text_of(message)}\n---", flush=True)
            shown += 1
        if shown < options.count and time.monotonic() > end:
            client.node.destroy_subscription(subscription)
            raise TimeoutError(f"{shown} of {options.count} messages came on {name}")
        time.sleep(0.01)
    return 0


def qos_of(node: Any, topic: str) -> QoSProfile:
    """Return the settings that hear all who publish on a topic now."""
    profiles = [each.qos_profile for each in node.get_publishers_info_by_topic(topic)]
    qos = QoSProfile(depth=100)
    if any(each.reliability == ReliabilityPolicy.BEST_EFFORT for each in profiles):
        qos.reliability = ReliabilityPolicy.BEST_EFFORT
    kept = [each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in profiles]
    if kept and all(kept):
        qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return qos


def filled(message: Any, options: argparse.Namespace, frame: Callable[[str], str]) -> Any:
    """Return a message with the fields that the command line gives.

    Raises:
        RangeError: The message has no such field, or a value is not of its sort.
        FileError: The fields are no YAML.
    """
    try:
        values = yaml.safe_load(options.fields)
    except yaml.YAMLError as error:
        raise FileError(f"the fields are not YAML: {error}") from None
    fill(message, values)
    for option, paths in PATHS.items():
        value = getattr(options, option)
        if value is not None:
            fill(message, nested(message, option, paths, value))
    unnamed = [each for each in headers(message) if options.frame or not each.frame_id]
    if unnamed:
        # A path in a request is in the frame of the request.
        own = getattr(getattr(message, "header", None), "frame_id", "")
        shared = options.frame or own or frame(getattr(message, "model", ""))
        for header in unnamed:
            header.frame_id = shared
    return message


def nested(message: Any, option: str, paths: Sequence[str], value: Any) -> dict[str, Any]:
    """Return an option's value as the mapping that fills the field it belongs to."""
    for path in paths:
        parts, place = path.split("."), message
        for part in parts:
            place = getattr(place, part, None)
        if place is None:
            continue
        content: Any = dict(zip("xyz", value, strict=False)) if isinstance(value, list) else value
        for part in reversed(parts):
            content = {part: content}
        return content
    fields = ", ".join(message.get_fields_and_field_types())
    raise RangeError(f"--{option} is not for this: its fields are {fields or 'none'}")


def headers(message: Any) -> Iterator[Any]:
    """Yield the headers in a message, wherever they are."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if name == "header":
            yield value
        elif hasattr(value, "get_fields_and_field_types"):
            yield from headers(value)


def frame_of(client: ServiceClient, name: str, model: str, wait: float) -> str:
    """Return the frame of the model that a node is asked about, empty if it tells none."""
    lists = f"{name.rpartition('/')[0]}/list_models"
    kind = dict(client.node.get_service_names_and_types()).get(lists)
    if not kind:
        return ""
    service = type_of(kind[0])
    models = client.call(service, lists, service.Request(), wait).models
    named = [each for each in models if not model or each.name == model]
    return str(getattr(named[0], "frame_id", "")) if named else ""


def code_name(code: int) -> str:
    """Return the name of an error code, with its number."""
    names = [
        each for each in dir(ErrorCode) if each.isupper() and getattr(ErrorCode, each) == code
    ]
    return f"{names[0]} ({code})" if names else str(code)


if __name__ == "__main__":
    sys.exit(main())
