"""What a call must leave as it was: folder, generators, defaults, pyplot and standard output."""

from __future__ import annotations

import io
import os
import random
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np


def surroundings() -> dict[str, Any]:
    """State that belongs to the caller of a library, in a form that `==` compares."""
    import matplotlib
    import matplotlib.pyplot as plt
    import torch

    return {
        "torch generator": torch.random.get_rng_state().numpy().tobytes(),
        "numpy generator": str(np.random.get_state(legacy=False)["state"]),
        "numpy key": np.random.get_state()[1].tobytes(),
        "random": random.getstate(),
        "default dtype": torch.get_default_dtype(),
        "gradients": torch.is_grad_enabled(),
        "threads": torch.get_num_threads(),
        "floating-point errors": np.geterr(),
        "rcParams": dict(matplotlib.rcParams),
        "backend": plt.get_backend(),
        "figures": plt.get_fignums(),
        "current figure": plt.gcf().number if plt.get_fignums() else None,
        "working directory": os.getcwd(),
    }


@contextmanager
def no_traces(folder: Path) -> Iterator[None]:
    """Run the body in an empty folder, with unusual settings, and find everything as it was."""
    import matplotlib
    import matplotlib.pyplot as plt
    import torch

    # Anything but the defaults: code that puts those back would otherwise pass.
    with chdir(folder), matplotlib.rc_context({"lines.linewidth": 3.7}):
        backend = plt.get_backend()
        plt.switch_backend("svg")
        torch.manual_seed(7)
        np.random.seed(7)
        random.seed(7)
        own = plt.figure()
        printed = io.StringIO()
        before = surroundings()
        try:
            with redirect_stdout(printed):
                yield
            after = surroundings()
            changed = [name for name in before if before[name] != after[name]]
            assert not changed, changed
            assert own.axes == []
            left = os.listdir(folder)
            assert not left, left
            assert printed.getvalue() == "", printed.getvalue()
        finally:
            plt.close("all")
            plt.switch_backend(backend)
