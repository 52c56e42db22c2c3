# SPDX-License-Identifier: Apache-2.0
"""How many threads BLAS may use in the processes of this package's programs and nodes."""

import os

VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def use_one_by_default() -> None:
    """Keep BLAS to one thread, unless the environment says otherwise.

    All our products are of small matrices: threads only wait for each other in them, and starve
    the other processes of a fit or of a robot. It takes effect if numpy is not imported yet.
    """
    for variable in VARIABLES:
        os.environ.setdefault(variable, "1")
