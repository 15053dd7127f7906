"""Which changes of the code the tests are tried on."""

from __future__ import annotations

import pytest

cst = pytest.importorskip("libcst")
mutants = pytest.importorskip("mutants")


def test_only_flags_that_say_how_strict_a_zip_is_are_left_alone() -> None:
    module = cst.parse_module("for a, b in zip(c, d, strict=True):\n    f(a, other=True)\n")
    flags, every = mutants.strict_flags(module), []

    class Names(cst.CSTVisitor):
        def visit_Name(self, node: object) -> None:
            every.append(node)

    module.visit(Names())
    of_true = [id(n) in flags for n in every if n.value == "True"]
    assert of_true == [True, False] and len(flags) == 1
