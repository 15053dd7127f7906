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

    def zeros(self, count: int) -> str:
        """The name of an array of so many numbers, all zero, that lives as long as the call."""
        name = self.put(f"alloca double, i64 {max(count, 1)}")[1:]
        for place in range(count):
            self.store("0.0", name, place)
        return name

    def add(self, value: str, array: str, place: int, kind: str = "double") -> None:
        """Add a value to what an array holds."""
        self.store(self.op("fadd", self.load(array, place, kind), value, kind), array, place, kind)

    def element(self, table: str, place: str) -> str:
        """What a table holds at a place that is computed."""
        at = self.put(f"getelementptr double, ptr @{table}, i64 {place}")
        return self.put(f"load double, ptr {at}, align 8")

    def loop(self, name: str) -> str:
        """Begin a loop, the only one of the function; its counter, from zero."""
        self.lines += [f"  br label %{name}", f"{name}:"]
        return self.put(f"phi i64 [ 0, %entry ], [ %next, %{name} ]")

    def again(self, name: str, counter: str, count: int) -> None:
        """End the loop: it is run so many times."""
        self.lines += [f"  %next = add i64 {counter}, 1", f"  %more = icmp slt i64 %next, {count}",
                       f"  br i1 %more, label %{name}, label %done", "done:"]

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
        return "\n".join([f"define void @{self.name}({self.signature}) {{", "entry:", *self.lines,
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
