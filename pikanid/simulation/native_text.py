"""Functions for LLVM, written line by line in static single assignment form."""

from __future__ import annotations

from collections.abc import Iterator

WIDEST = 4  # limit: derivatives that one instruction carries
REGISTERS = "ptr %r, ptr %d"


class Writer:
    """Lines of one function; %n are numbered in the order in which they are needed."""

    def __init__(self, name: str, signature: str = REGISTERS):
        self.name, self.signature = name, signature
        self.lines, self.count = list[str](), 0

    def put(self, right: str) -> str:
        """Give a value a name, and note it."""
        self.count += 1
        self.lines.append(f"  %t{self.count} = {right}")
        return f"%t{self.count}"

    def load(self, array: str, place: int, kind: str = "double") -> str:
        """What an array holds from a place on."""
        at = self.put(f"getelementptr double, ptr %{array}, i64 {place}")
        return self.put(f"load {kind}, ptr {at}, align 8")

    def store(self, value: str, array: str, place: int, kind: str = "double") -> None:
        """Write a value to an array, from a place on."""
        at = self.put(f"getelementptr double, ptr %{array}, i64 {place}")
        self.lines.append(f"  store {kind} {value}, ptr {at}, align 8")

    def call(self, function: str, *values: str) -> str:
        """A function of numbers."""
        return self.put(f"call double @{function}({', '.join(f'double {v}' for v in values)})")

    def run(self, function: str) -> None:
        """Call a function of the registers."""
        self.lines.append(f"  call void @{function}({REGISTERS})")

    def op(self, name: str, x: str, y: str, kind: str = "double") -> str:
        """An operation on two values."""
        return self.put(f"{name} {kind} {x}, {y}")

    def where(self, x: str, relation: str, bound: str, yes: str, no: str) -> str:
        """One value or another, by a comparison."""
        test = self.put(f"fcmp {relation} double {x}, {bound}")
        return self.put(f"select i1 {test}, double {yes}, double {no}")

    def text(self) -> str:
        """The function."""
        return "\n".join([f"define void @{self.name}({self.signature}) {{", *self.lines,
                          "  ret void", "}"])


def blocks(lanes: int) -> Iterator[tuple[int, int]]:
    """First lane and number of lanes that each instruction carries."""
    for first in range(0, lanes, WIDEST):
        yield first, min(WIDEST, lanes - first)


def splat(w: Writer, value: str, width: int) -> str:
    """A vector of one value."""
    kind = f"<{width} x double>"
    one = w.put(f"insertelement {kind} poison, double {value}, i32 0")
    return w.put(f"shufflevector {kind} {one}, {kind} poison, <{width} x i32> zeroinitializer")
