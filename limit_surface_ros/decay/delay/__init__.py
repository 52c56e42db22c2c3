# SPDX-License-Identifier: Apache-2.0
"""The delay differential equation that a response obeys: chapter 2 of the thesis.

- `kernel` and `closed_kernel`: the memory kernel f with xdot = f * x; `impulses` in it
- `pieces`, `system`, `construction`: the delay system that f stands for
- `winding`, `roots`, `stability`: its characteristic roots, certified
- `rates`: those roots as rates of a sum of exponentials (`--method dde`)
"""
