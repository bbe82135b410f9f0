"""Whether a specification holds with the confidence that a project asks for, for programs that run checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from tussle.arguments import explained
from tussle.batch.statistics import scipy_package
from tussle.stress.estimates import Probability, Sample
from tussle.stress.importance import ImportanceEstimate

CONFIDENCE = 0.95


@explained
@dataclass(frozen=True)
class Assurance:
    """The probability above which a specification holds, with 95 % confidence.

    Attributes:
        least: Lower end of the one-sided interval: exact (Clopper and Pearson 1934) for plain games; for splitting and importance sampling
            the upper end of the two-sided interval of the failures, which is more careful.
        n_games: Games from which it follows.
        n_failed: Different failing games among them.
    """

    least: float
    n_games: int
    n_failed: int

    @classmethod
    def of(cls, found: Sample | Probability | ImportanceEstimate) -> Assurance:
        """The assurance of plain games, or of an estimate by splitting or importance sampling."""
        if not isinstance(found, Sample):
            return cls(1.0 - found.high, found.n_games, len(found.failures))
        n, k = len(found.games), len(found.failures)
        most = 1.0 if k == n else float(scipy_package().stats.beta.ppf(CONFIDENCE, k + 1, n - k))
        return cls(1.0 - most, n, k)

    def sentence(self, asked: float) -> str:
        """Say whether the specification holds as it is asked to."""
        holds = "holds" if self.least > asked else "does not hold"
        return f"{holds} with 95 % confidence above {asked:.10g}: above {self.least:.6g} by {self.n_games:,} games"


def junit_xml(name: str, specification: str, assurance: Assurance, asked: float, files: Sequence[str]) -> str:
    """The result as JUnit XML: one test, which fails if the specification does not hold as it is asked to.

    Args:
        name: Of the mission.
        specification: What must hold.
        assurance: What is known.
        asked: The probability above which it must hold.
        files: Mission files of failing games.
    """
    has_failed = not assurance.least > asked
    suite = ET.Element(
        "testsuite", name="tussle stress", tests="1", failures=str(int(has_failed)), errors="0"
    )
    case = ET.SubElement(suite, "testcase", classname=name, name=specification)
    if has_failed:
        failure = ET.SubElement(case, "failure", message=assurance.sentence(asked))
        failure.text = "\n".join(files)
    ET.indent(suite)
    return ET.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"
