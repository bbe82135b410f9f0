"""The language of specifications.

formula  = or ["->" formula]
or       = and {"or" and}            and = until {"and" until}
until    = unary ["until" [window] unary]
unary    = "not" unary | ("always" | "eventually") [window] unary | comparison
compared = sum [("<" | "<=" | ">" | ">=") sum]
sum      = product {("+" | "-") product}
product  = factor {("*" | "/") factor}
factor   = "-" factor | "(" formula ")" | number [unit] | signal "(" arguments ")" | quantity
window   = "[" time "," time "]"
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

from tussle.batch.quantities import Quantity
from tussle.declare import units
from tussle.declare.units import TIME, UNITS, Dimension
from tussle.errors import ParameterError, UnitError, nearest_name
from tussle.stress.formulas import Above, Every, Formula, Not, UntilHolds, Window
from tussle.stress.signals import Factory
from tussle.stress.terms import Arithmetic, AtEnd, Constant, OfStep, SignalTerm

MAX_LENGTH = 1000
"""Characters of a specification."""
MAX_DEPTH = 50
"""Nested parentheses and operators."""
MAX_SAMPLES = 2**60
"""Samples before a window."""
WORDS = ("always", "eventually", "until", "and", "or", "not", "inf")
TOKEN = re.compile(
    r"""\s*(?:
    (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)
    |(?P<name>"[^"]*"|[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)
    |(?P<sign>->|<=|>=|[-+*/()<>\[\],])
    )""",
    re.VERBOSE | re.ASCII,
)
UNIT = re.compile(r"\s*([A-Za-z%]+(?:\^-?\d)?(?:/[A-Za-z]+(?:\^-?\d)?)*)", re.ASCII)
ARGUMENTS = re.compile(r"[^()]*", re.ASCII)


class Token(NamedTuple):
    """A token: its text, kind, and where it begins and ends."""

    text: str
    kind: str
    start: int
    end: int


class SpecificationReader:
    """Reads one specification.

    Args:
        text: The specification.
        factory: Makes signals.
        dt: Time of a sample [s].
        length: Time that a game lasts at most [s].
    """

    def __init__(self, text: str, factory: Factory, dt: float, length: float = math.inf) -> None:
        self.text, self.factory, self.dt, self.length = text, factory, dt, length
        self.place, self.depth = 0, 0
        self.after = 0  # samples from the start of the game to where the windows outside begin
        self.terms: dict[str, SignalTerm] = {}

    def read(self) -> Formula:
        """The formula.

        Raises:
            ParameterError: The text is none.
        """
        if len(self.text) > MAX_LENGTH:
            raise ParameterError(
                f"specification {self.text[:40]!r}... has {len(self.text)} characters; at most {MAX_LENGTH} are allowed"
            )
        found = self._formula(self._implied())
        if (token := self._peek()).kind:
            raise self._wrong(f"{token.text!r} is not expected here", token.start)
        return found

    # -- tokens -------------------------------------------------------------------------------------------------------------

    def _peek(self) -> Token:
        match = TOKEN.match(self.text, self.place)
        if match is None:
            rest = self.text[self.place :].strip()
            if rest:
                raise self._wrong(f"{rest[:20]!r} cannot be read", self.place)
            return Token("the end", "", len(self.text), len(self.text))
        kind = str(match.lastgroup)
        return Token(match[kind], kind, match.start(kind), match.end())

    def _next(self) -> Token:
        token = self._peek()
        self.place = token.end
        return token

    def _takes(self, *texts: str) -> str:
        """The next token where it is one of some; else "", and it stays."""
        token = self._peek()
        if token.text not in texts:
            return ""
        self.place = token.end
        return token.text

    def _expects(self, text: str) -> None:
        token = self._next()
        if token.text != text:
            raise self._wrong(f"{text!r} is expected, not {token.text!r}", token.start)

    def _wrong(self, why: str, place: int) -> ParameterError:
        before = self.text[:place].rstrip()[-30:]
        where = f"after {before!r}" if before else "at its beginning"
        return ParameterError(f"specification {self.text[:80]!r}: {where}, {why}")

    # -- formulas -----------------------------------------------------------------------------------------------------------

    def _formula(self, found: Formula | SignalTerm) -> Formula:
        if isinstance(found, SignalTerm):
            raise self._wrong("a comparison is missing, such as > 2 m", self.place)
        return found

    def _implied(self) -> Formula | SignalTerm:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self._wrong("it is nested too deeply", self.place)
        found = self._chained("or", lambda: self._chained("and", self._until))
        if self._takes("->"):
            found = Every((negated(self._formula(found)), self._formula(self._implied())), is_any=True)
        self.depth -= 1
        return found

    def _chained(self, word: str, inner: Callable[[], Formula | SignalTerm]) -> Formula | SignalTerm:
        found = [inner()]
        while self._takes(word):
            found.append(inner())
        return found[0] if len(found) == 1 else Every(tuple(map(self._formula, found)), is_any=word == "or")

    def _until(self) -> Formula | SignalTerm:
        found = self._unary()
        if self._takes("until"):
            first, last = self._window()
            return UntilHolds(self._formula(found), self._inside(first), first, last)
        return found

    def _unary(self) -> Formula | SignalTerm:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self._wrong("it is nested too deeply", self.place)
        word = self._takes("not", "always", "eventually")
        if word:
            first, last = (0, 0) if word == "not" else self._window()
            inner = self._inside(first)
            found = negated(inner) if word == "not" else Window(inner, first, last, word == "eventually")
        else:
            found = self._compared()  # type: ignore[assignment]
        self.depth -= 1
        return found

    def _inside(self, first: int) -> Formula:
        """What is judged from the sample on at which a window begins."""
        self.after += first
        found = self._formula(self._unary())
        self.after -= first
        return found

    def _window(self) -> tuple[int, int | None]:
        """First and last sample; [0, end of the game] where none is given."""
        if not self._takes("["):
            return 0, None
        start = self.place
        first = self._time()
        self._expects(",")
        last = self._time()
        self._expects("]")
        if not first <= last:
            raise self._wrong("a window ends before it begins", start)
        # The samples within the window, whatever the rounding of its ends.
        n = math.ceil(min(first / self.dt, MAX_SAMPLES) - 1e-6)
        end = None if last == math.inf else math.floor(last / self.dt + 1e-6)
        if end is not None and end < n:
            raise self._wrong(f"no step is within the window; steps are {self.dt:g} s apart", start)
        if (self.after + n - 0.5) * self.dt > self.length:
            raise self._wrong(f"the window begins after the end of the game, at {self.length:g} s", start)
        return n, end

    def _time(self) -> float:
        if self._takes("inf"):
            return math.inf
        token = self._peek()
        if token.kind != "number":
            raise self._wrong(f"a time is expected, not {token.text!r}", token.start)
        found = self._number()
        if found.unit not in (None, TIME):
            raise self._wrong(f"{self.text[token.start : self.place]!r} is no time", token.start)
        return found.value

    def _compared(self) -> Formula | SignalTerm:
        left = self._sum()
        sign = self._takes("<", "<=", ">", ">=")
        if not sign:
            return left
        place = self.place
        a, b = self._term(left), self._term(self._sum())
        difference = self._of("-", *((a, b) if sign[0] == ">" else (b, a)), place)
        name = f"{len(self.terms)}"
        self.terms[name] = difference
        return Above(name, difference.is_late)

    # -- terms --------------------------------------------------------------------------------------------------------------

    def _term(self, found: Formula | SignalTerm) -> SignalTerm:
        if isinstance(found, Formula):
            raise self._wrong("a number is expected, not a condition", self.place)
        return found

    def _of(self, operator: str, left: SignalTerm, right: SignalTerm, place: int) -> SignalTerm:
        if operator in "+-" and None not in (left.unit, right.unit) and left.unit != right.unit:
            raise self._wrong(
                f"{shown(left.unit)} and {shown(right.unit)} cannot be compared or added", place
            )
        return Arithmetic(operator, left, right)

    def _folded(self, signs: tuple[str, ...], inner: Callable[[], Any]) -> Any:
        found = inner()
        while sign := self._takes(*signs):
            place = self.place
            found = self._of(sign, self._term(found), self._term(inner()), place)
        return found

    def _sum(self) -> Formula | SignalTerm:
        return self._folded(("+", "-"), lambda: self._folded(("*", "/"), self._factor))  # type: ignore[no-any-return]

    def _factor(self) -> Formula | SignalTerm:
        if self._takes("-"):
            self.depth += 1
            if self.depth > MAX_DEPTH:
                raise self._wrong("it is nested too deeply", self.place)
            inner = self._term(self._factor())
            self.depth -= 1
            return Arithmetic("-", Constant(0.0), inner)
        if self._takes("("):
            found = self._implied()
            self._expects(")")
            return found
        token = self._peek()
        if token.kind == "number":
            return self._number()
        if token.kind != "name" or token.text in WORDS:
            raise self._wrong(
                f"a signal, a quantity or a number is expected, not {token.text!r}", token.start
            )
        return self._named()

    def _number(self) -> Constant:
        token = self._next()
        match = UNIT.match(self.text, self.place)
        if match is None or match[1] in WORDS:
            return Constant(float(token.text))
        try:
            value = units.parse(f"{token.text} {match[1]}", match[1])
        except UnitError as error:
            raise self._wrong(f"{error}{nearest_name(match[1], (*UNITS, *WORDS))}", token.start) from None
        self.place = match.end()
        return Constant(value, units.unit_of(match[1]).dimension)

    def _named(self) -> SignalTerm:
        token = self._next()
        if self._takes("("):
            match = ARGUMENTS.match(self.text, self.place)
            assert match is not None
            self.place = match.end()
            self._expects(")")
            given = [" ".join(part.replace('"', " ").split()) for part in match[0].split(",")]
            try:
                return OfStep(self.factory.make(token.text, given if given != [""] else []))
            except ParameterError as error:
                raise self._wrong(str(error), token.start) from None
        if token.text == "time":
            return OfStep(self.factory.make("time", []))
        text = token.text
        team = re.compile(r"\s*\[\s*(-?\d+)\s*\]").match(self.text, self.place)
        if team is not None:
            self.place = team.end()
            text = f"{text}[{team[1]}]"
        return AtEnd(Quantity.parse(text))


def negated(formula: Formula) -> Formula:
    """The opposite, with `not` moved inwards: robustness is the negative, but more of it is known during the game."""
    if isinstance(formula, Not):
        return formula.inner
    if isinstance(formula, Every):
        return Every(tuple(map(negated, formula.parts)), not formula.is_any)
    if isinstance(formula, Window):
        return Window(negated(formula.inner), formula.first, formula.last, not formula.is_any)
    return Not(formula)


def shown(dimension: Dimension | None) -> str:
    """A dimension by its SI unit, as m/s."""
    names = ("m", "kg", "s", "A", "K", "rad")
    parts = [
        name + (f"^{power}" if power != 1 else "")
        for name, power in zip(names, dimension or (), strict=False)
        if power
    ]
    return " ".join(parts) or "numbers without a unit"
