"""Command line programs."""

import os

# Fits are many products of small matrices: BLAS threads only wait for each other in them, and
# starve the other processes of a fit. They are set before numpy is first imported.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
