"""Every failure that a user can meet, in one place: the exceptions, and a file of sentences a room.

Each function returns one sentence that says what is wrong, where, and what to do about it.  The
exceptions carry that sentence; the command line prints it and exits with `exit_code`.
"""

from __future__ import annotations

from types import FunctionType

from pikanid.errors.approximators import *
from pikanid.errors.classes import *
from pikanid.errors.commands import *
from pikanid.errors.comparison import *
from pikanid.errors.estimate import *
from pikanid.errors.files import *
from pikanid.errors.formula import *
from pikanid.errors.mismatch import *
from pikanid.errors.model import *
from pikanid.errors.recording import *
from pikanid.errors.signals import *
from pikanid.errors.strategies import *
from pikanid.errors.symbolic import *
from pikanid.errors.tracking import *
from pikanid.errors.validation import *
from pikanid.errors.wording import made_brief

# One rule for all sentences, those of tomorrow too, instead of a call in each of them.
for _name, _member in list(globals().items()):
    if isinstance(_member, FunctionType) and _member.__module__ != made_brief.__module__:
        globals()[_name] = made_brief(_member)
