# SPDX-License-Identifier: Apache-2.0
"""Sliding with mass: from a twist or a load that dies away to rest.

- `slide`: what users call; `body`, `inertia`, `load`: what they give; `result`: what they get
- `batch`: thousands at once; `ensemble`: how uncertain the end is
- `run`: legs from rest to rest; `equations`: of motion; `creases`: support points that rest;
  `rest`: how motion begins and ends; `friction`: the dissipation with its derivatives
- `dormand_prince`, `implicit`: steps
"""
