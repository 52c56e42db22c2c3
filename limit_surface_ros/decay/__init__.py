# SPDX-License-Identifier: Apache-2.0
"""Decay models: from a decaying response to a sum of exponentials.

The chain, each link of which can be used alone:

- `targets`, `examples`: responses; `noise`: how noisy records of them are; `grids`: where errors
  are looked for
- `esprit`, `neutral`, `delay.rates`, `polish`: ways to choose rates (`rates`)
- `delay`: the response's own delay differential equation, chapter 2 of the thesis: its memory
  kernel, its pieces, its characteristic roots, certified
- `minimax`, `coefficients`: coefficients on fixed rates, certified
- `fit`: all of it in one call
- `basis`, `levels`, `exponential_sum`: the result, which is all that a node imports;
  `families`, `family_fit`, `estimation` and `response`: what a node does with it
"""
