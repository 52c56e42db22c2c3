# SPDX-License-Identifier: Apache-2.0
"""Decay models: from a decaying response to a sum of exponentials.

The chain, each link of which can be used alone:

- `targets`, `examples`: responses; `smoothing`: what noise does to records of them
- `kernel` and `closed_kernel`: the memory kernel f with xdot = f * x; `impulses` in it
- `pieces`, `delay_system`, `construction`: the delay differential equation that f is
- `winding`, `roots`, `stability`: its characteristic roots, certified
- `rates_dde`, `rates_neutral`, `rates_esprit`, `rates_polished`: choices of rates (`rate_choice`)
- `minimax`, `coefficient_fits`, `response_fits`: coefficients on fixed rates, certified
- `fit`: all of it in one call
- `exponential_sum`: the result, which is all that a node imports; `estimation`, `response`,
  `stopping`: what a node does with it
"""
