# SPDX-License-Identifier: Apache-2.0
"""Decay models: the figures of the thesis, and the peers they are held against.

Each table gives the goal beside what was measured here; times are medians, interleaved with the
peer's where there is one.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from decimal import Decimal, localcontext

import numpy as np
from interleaved import interleaved
from scipy.optimize import linprog
from scipy.special import lambertw

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.basis import count_terms, real_basis
from limit_surface_ros.decay.coefficients import fit_coefficients, fit_response
from limit_surface_ros.decay.delay.construction import delay_system, system_of_kernel
from limit_surface_ros.decay.delay.impulses import find_impulses
from limit_surface_ros.decay.delay.kernel import memory_kernel
from limit_surface_ros.decay.delay.roots import count_roots, first_roots, roots_in_box
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.fit import fit_decay
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.minimax import orthonormal_basis, solve_minimax
from limit_surface_ros.decay.rates import predicted_error, take
from limit_surface_ros.decay.targets import PiecewiseLinear

END, HORIZON = 6.0, 19.0
TIMES = np.linspace(0.0, END, 2000)


def table(title: str, headings: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a Markdown table."""
    print(f"### {title}\n")
    for row in (headings, ["---"] * len(headings), *rows):
        print(f"| {' | '.join(str(cell) for cell in row)} |")
    print(flush=True)


def sampled_system() -> DelaySystem:
    """Return the hockey stick's system from 2000 samples: degree 5 on unit cells."""
    kernel = memory_kernel(TIMES, examples.hockey_stick()(TIMES))
    return system_of_kernel(kernel, find_impulses(kernel), degree=5)


def thesis_figures() -> None:
    """The infinity-norm errors on the thesis's grid."""
    x = examples.hockey_stick()(TIMES)
    rows = []
    for name, system, goals in (
        ("(2.4)", examples.thesis_system(), {5: 2.8196e-2, 8: 1.6145e-2, 62: 2.0123e-3}),
        ("accurate kernel", sampled_system(), {4: 2.526e-2, 7: 1.510e-2, 61: 1.953e-3}),
    ):
        roots = first_roots(system, 62)
        for count, goal in goals.items():
            fit = fit_coefficients(roots[:count], TIMES, x)
            gap = (fit.value - fit.lower_bound) / fit.value
            rows.append((name, fit.sum.terms, f"{goal:.4e}", f"{fit.value:.4e}", f"{gap:.0e}"))
    table(
        "Infinity-norm error on 2000 points of [0, 6], hockey stick",
        ("basis", "terms", "goal", "measured", "duality gap"),
        rows,
    )


def four_bases() -> None:
    """All bases of the thesis on all its functions."""
    targets = {name: examples.example(name) for name in ("f1", "f2", "f3")}
    bases = {
        "0": examples.simple_system(),
        "1, printed (2.4)": examples.thesis_system(),
        "1, printed (2.2)": examples.printed_system(),
        **{name[1]: delay_system(target, END) for name, target in targets.items()},
    }
    rows = []
    for name, system in bases.items():
        roots = first_roots(system, 60)
        row: list[object] = [name, f"{roots.real.max():.3f}"]
        for target in targets.values():
            fit = fit_response(roots, target, END)
            tail = largest_error(fit.sum, target, END, HORIZON)
            row.append(f"{fit.max_error:.2e} / {tail:.1e}")
        rows.append(row)
    table(
        "First 60 roots, fitted on [0, 6]: error there / on [6, 19]",
        ("basis", "right-most real part", "f1", "f2", "f3"),
        rows,
    )


def roots_found() -> None:
    """Numbers of roots, and how long it takes to find and certify them."""
    box = ((-6.0, 3.0), (0.0, 68.0))
    rows = []
    for name, system, goal in (
        ("accurate kernel", delay_system(examples.hockey_stick(), END), 64),
        ("(2.4)", examples.thesis_system(), 65),
    ):
        found = roots_in_box(system, *box)
        value, slope = system.characteristic_and_derivative(found)
        missing = count_roots(system, *box) - len(found) - np.count_nonzero(found.imag)
        seconds = interleaved({"ours": lambda s=system: roots_in_box(s, *box)})["ours"]
        residual = f"{np.abs(value / slope).max():.0e}"
        rows.append((name, goal, len(found), missing, residual, f"{seconds:.3f}", "< 0.3"))
    table(
        "Roots with Im in [0, 68], maximum delay 6",
        ("system", "known", "found", "missing", "residual", "time [s]", "goal [s]"),
        rows,
    )
    simple = first_roots(examples.simple_system(), 62)
    error = np.abs(simple - lambertw(-0.6, np.arange(62)) / 6.0).max()
    print(f"xdot = -0.1 x(t - 6): 62 roots are W_k(-0.6) / 6 to {error:.1e} (goal 1e-12).\n")
    try:
        import qpmr
    except ImportError:
        print("qpmr is not installed: not compared.\n")
        return
    equation = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([0.0, 1.0])
    system = DelaySystem(np.array([1.0]), np.array([-1.0]))
    region = (-10.0, 2.0, 0.0, 30.0)

    def peer() -> object:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return qpmr.qpmr(*equation, region=region)[0]

    def ours() -> object:
        return roots_in_box(system, region[:2], region[2:])

    difference = np.abs(np.sort_complex(peer()) - np.sort_complex(ours())).max()
    times = interleaved({"ours": ours, "qpmr": peer})
    seconds, peer_seconds = times["ours"], times["qpmr"]
    print(
        f"s + exp(-s), from qpmr's literature list: roots agree to {difference:.0e}; ours "
        f"{seconds * 1e3:.1f} ms, qpmr {peer_seconds * 1e3:.0f} ms "
        f"({peer_seconds / seconds:.0f} times as long).\n"
    )


def kernel_in_40_digits(x: np.ndarray, step: float) -> np.ndarray:
    """Solve the Toeplitz system by forward substitution in decimal arithmetic."""
    support = int(np.flatnonzero(x)[-1]) + 1
    xdot = np.diff(x) / step
    with localcontext() as context:
        context.prec = 40
        series = [Decimal(float(value)) for value in x[:support]]
        quotient: list[Decimal] = []
        for n, value in enumerate(xdot):
            rest = Decimal(float(value))
            for k in range(1, min(n, support - 1) + 1):
                rest -= series[k] * quotient[n - k]
            quotient.append(rest / series[0])
    return np.array([float(value) for value in quotient]) / step


def memory_kernels() -> None:
    """Time and error of the deconvolution, and of the impulses found."""
    target = examples.hockey_stick()
    long = np.linspace(0.0, END, 100_000)
    short_x, long_x = target(TIMES), target(long)
    kernel = memory_kernel(TIMES, short_x)
    error = np.abs(kernel.values - kernel_in_40_digits(short_x, kernel.step)).max()
    times = interleaved(
        {
            "short": lambda: memory_kernel(TIMES, short_x),
            "long": lambda: memory_kernel(long, long_x),
        }
    )
    impulses = find_impulses(kernel)
    deviation = np.abs(impulses.strengths - [-1.0, 1.0]).max()
    table(
        "Memory kernel of the hockey stick",
        ("what", "measured", "goal"),
        [
            ("n = 2000, against 40 digits", f"{error:.1e}", "1e-12"),
            ("n = 2000, time", f"{times['short'] * 1e3:.2f} ms", "< 1 ms"),
            ("n = 100 000, time", f"{times['long']:.3f} s", "< 0.5 s"),
            ("impulses, n = 2000", f"{deviation:.1e}", "1e-3"),
        ],
    )


def minimax_solvers() -> None:
    """The infinity-norm fit of 123 terms to 2000 points, ours and HiGHS."""
    roots = first_roots(examples.thesis_system(), 62)
    matrix, target = real_basis(roots, TIMES), examples.hockey_stick()(TIMES)
    ones = np.ones((len(target), 1))

    def highs(a: np.ndarray) -> float:
        return linprog(
            np.append(np.zeros(a.shape[1]), 1.0),
            A_ub=np.block([[a, -ones], [-a, -ones]]),
            b_ub=np.append(target, -target),
            bounds=[(None, None)] * (a.shape[1] + 1),
            method="highs",
        ).fun

    def whitened() -> float:
        return highs(orthonormal_basis(matrix).columns)

    def ours() -> float:
        return solve_minimax(matrix, target).value

    solvers = {
        "ours": ours,
        "HiGHS": lambda: highs(matrix),
        "HiGHS on our orthonormal basis": whitened,
    }
    times = interleaved(solvers, rounds=1)
    table(
        "Infinity-norm fit, 123 terms x 2000 points (goal: < 0.2 s, not slower than HiGHS)",
        ("solver", "value", "time [s]", "times ours"),
        [
            (name, f"{solve():.7e}", f"{times[name]:.3f}", f"{times[name] / times['ours']:.1f}")
            for name, solve in solvers.items()
        ],
    )


def against_peers() -> None:
    """Methods of choosing rates at equal numbers of terms."""
    goals = {9: (1.5e-2, 6.4e-3), 15: (8.7e-3, 3.6e-3), 31: (4.2e-3, 1.6e-3), 61: (2.2e-3, 8e-4)}
    notes = {9: 8.6e-3, 15: 4.9e-3, 31: 2.0e-3, 61: 8.2e-4}
    target = examples.hockey_stick()
    rows = []
    for terms, (dde_goal, best_goal) in goals.items():
        fits = {m: fit_decay(target, terms, HORIZON, m) for m in ("dde", "neutral", "esprit")}
        best = fit_decay(target, terms, HORIZON, "best")
        rows.append(
            (
                terms,
                f"{dde_goal:.1e}",
                f"{fits['dde'].fit.max_error:.2e} ({fits['dde'].seconds:.1f} s)",
                f"{fits['neutral'].fit.max_error:.2e}",
                f"{notes[terms]:.1e}",
                f"{fits['esprit'].fit.max_error:.2e}",
                f"{best_goal:.1e}",
                f"{best.fit.max_error:.2e} ({best.seconds:.1f} s)",
            )
        )
    table(
        "Hockey stick on [0, 19]",
        ("terms", "goal dde", "dde", "neutral", "ESPRIT before", "esprit", "goal best", "best"),
        rows,
    )
    rows = []
    for name in ("f2", "f3", "gaussian", "power_law", "tail"):
        other = examples.example(name)
        for terms in (9, 15):
            esprit = fit_decay(other, terms, HORIZON, "esprit").fit.max_error
            best = fit_decay(other, terms, HORIZON, "best")
            kept = "yes" if best.fit.max_error <= esprit else "NO"
            rows.append((name, terms, f"{esprit:.2e}", f"{best.fit.max_error:.2e}", kept))
    table(
        "Other responses on [0, 19]: best is never worse than ESPRIT with refitted coefficients",
        ("response", "terms", "esprit", "best", "kept"),
        rows,
    )


def error_law() -> None:
    """The law E = 0.0446 J T / N against fits."""
    target = examples.hockey_stick()
    rows = []
    for delay in (3.0, 4.0, 5.0, 6.0):
        system = delay_system(target, delay)
        roots = first_roots(system, 62)
        for terms in (61, 123):
            rates = take(roots, terms)
            measured = fit_response(rates, target, END).max_error
            predicted = predicted_error(1.0, delay, count_terms(rates))
            rows.append(
                (
                    f"{delay:g}",
                    count_terms(rates),
                    f"{predicted:.3e}",
                    f"{measured:.3e}",
                    f"{100.0 * (measured / predicted - 1.0):+.0f} %",
                )
            )
    table(
        "Error predicted before the fit, 0.0446 J T / N (goal: within 15 %)",
        ("T [s]", "terms", "predicted", "measured", "off"),
        rows,
    )


def noisy_records() -> None:
    """Records with 1 % noise: error against the clean response, and size beyond the interval."""
    clean = examples.hockey_stick()
    times = np.linspace(0.0, END, 601)
    noise = 0.01 * np.random.default_rng(1).normal(size=len(times))
    record = PiecewiseLinear(times, clean(times) + noise)
    later = np.linspace(END, 60.0, 5000)
    rows = []
    for method in ("dde", "neutral", "esprit", "best"):
        fit = fit_decay(record, 15, END, method, norm="2").fit
        error = largest_error(fit.sum, clean, 0.0, END)
        rows.append((method, f"{error:.3f}", f"{np.abs(fit.sum(later)).max():.1e}"))
    table(
        "601 samples with 1 % noise, 15 terms, 2-norm",
        ("method", "error against the clean response", "largest value on [6, 60]"),
        rows,
    )


def main() -> int:
    """Print all tables."""
    thesis_figures()
    four_bases()
    roots_found()
    memory_kernels()
    minimax_solvers()
    against_peers()
    error_law()
    noisy_records()
    return 0


if __name__ == "__main__":
    sys.exit(main())
