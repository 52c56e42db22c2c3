# SPDX-License-Identifier: Apache-2.0
"""Pushes from recordings of wrenches and motions, as arrays: no bag and no ROS in here.

- `motion`: poses and twists over time, their noise, where the body moves and where it rests
- `arcs`: the body's twist over one run, with its covariance, from noisy poses
- `windows`: the parts of a run over which twist and wrench are averaged
- `clocks`: how late the stamps of the wrenches are; `tare`: the sensor's bias from rests
- `selection`: which parts are quasi-static pushes, and the pairs that they give
- `pushes`: all of it, from a recording to pairs with weights
- `simulation`: recordings of a body that is known
"""
