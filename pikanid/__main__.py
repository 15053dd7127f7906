"""`python -m pikanid` is the command `pikanid`."""

from __future__ import annotations

from pikanid.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
