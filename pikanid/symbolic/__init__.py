"""From curves and networks to formulas that can be trusted.

`name_edge` names one curve, `extract` reads a whole network, an estimate or a discrepancy,
`prune` removes what is not significant, `push` puts what was read back into pykan's own model.

>>> import numpy as np
>>> from pikanid.symbolic import name_edge
>>> x = np.linspace(-1.0, 1.0, 100)
>>> name_edge(x, x * abs(x)).name
'signed square'
"""

from __future__ import annotations

from pikanid.symbolic.extract import extract
from pikanid.symbolic.library import LIBRARY, Form, user_form
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.naming import name_edge
from pikanid.symbolic.prune import prune
from pikanid.symbolic.pushing import push
from pikanid.symbolic.reading import Reading
from pikanid.symbolic.settings import SymbolicSettings
from pikanid.symbolic.significance import contributions

__all__ = ["LIBRARY", "Form", "NamedEdge", "Reading", "SymbolicSettings", "contributions",
           "extract", "name_edge", "prune", "push", "user_form"]
