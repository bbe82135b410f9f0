"""`tussle stress`: play games against a specification, and show how they fail."""

from __future__ import annotations

import math
import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from tussle.batch.statistics import scipy_package
from tussle.batch.store import reported
from tussle.cli.batch import command_line
from tussle.cli.batch_options import StressOptions
from tussle.cli.interrupt import Interrupt, Interrupted
from tussle.cli.options import read_settings, show_notes
from tussle.cli.progress import ProgressMeter, compiling
from tussle.cli.tables import fact_list, number_tables, title
from tussle.cli.terminal import DOES_NOT_HOLD, OK, put, say, say_note
from tussle.mission import Mission, to_xml
from tussle.record.run_file import put_whole
from tussle.stress.chances import Chance
from tussle.stress.changes import absent
from tussle.stress.confidence import Assurance, junit_xml
from tussle.stress.estimates import Probability, Sample
from tussle.stress.games import Played
from tussle.stress.importance import ImportanceEstimate
from tussle.stress.recorded import unrecorded
from tussle.stress.results import FAILURES, MAX_FAILURES, saved_file
from tussle.stress.search import FailureSearch, label
from tussle.stress.shrink import SmallestGame
from tussle.stress.study import Stress
from tussle.stress.why import Why

KINDS = {"luck": "luck of", "entity": "without", "plugin": "without", "messages": "messages of"}
"""Kinds of counterfactuals, as they are shown."""
MAX_SHOWN = 5
"""Failing games that the end of a study shows."""


def stress(options: StressOptions) -> int:
    """Play the games of a study, or those that are missing, and show the result.

    Returns:
        The exit code.
    """
    scipy_package()  # if it is missing, the user learns it before the games are played
    study = Stress(
        options.mission,
        options.spec,
        guide=options.guide,
        first_seed=1 if options.seed is None else options.seed,
        settings=options.given,
        plugin_files=tuple(options.plugin_files),
        ends_by_time=options.end is not None,
        run_timeout=options.run_timeout,
        strict=options.strict,
        allow_large=options.allow_large,
        compat=options.compat,
        search=list(map(str, options.data_path)),
        vary=options.vary,
        against=other_of(options.against),
    )
    show_notes(study.batch.loaded)
    directory = options.directory or study.default_directory()
    n = 0
    with ExitStack() as stack:
        with compiling():
            study.check()
        interrupt = stack.enter_context(Interrupt())
        meter = stack.enter_context(ProgressMeter(study.batch.name, "games"))

        def on_game(_: Played) -> None:
            nonlocal n
            n += 1
            interrupt.check()
            meter.show(n, None if options.probability else options.games * (1 + len(study.others)))

        how: dict[str, Any] = {"processes": options.processes, "stack": options.stack, "on_game": on_game}
        how["directory"] = directory
        try:
            if options.is_search:
                searched = study.search(
                    options.games, options.sampler, sample_seed=options.sample_seed, **how
                )
                failures = [game.played for game in searched.failures]
            elif options.importance:
                weighted = study.importance(options.games, **how)
                failures = weighted.failures
            elif options.probability:
                numbers = options.particles, options.repetitions
                found = study.probability(*numbers, redraws=options.redraws, **how)
                failures = found.failures
            else:
                sample = study.sample(options.games, **how)
                failures = sample.failures
            why = study.why(failures[0], **how) if options.why and failures else None
        except Interrupted:
            say(
                "interrupted",
                f"{n:,} games are kept in {directory}; the same command continues",
                "bold yellow",
            )
            return interrupt.code
    if options.is_search:
        show_search(searched, study, directory, options)
    elif options.importance:
        show_importance(weighted, study, directory, options)
    elif options.probability:
        show_probability(found, study, directory, options)
    else:
        show_sample(sample, study, directory, options)
    if why is not None:
        show_why(why, study, directory, options)
    if options.shrink and failures:
        show_smallest(study.smallest(failures[0]), study, directory, options)
    if options.holds is None:
        return OK
    judged = weighted if options.importance else found if options.probability else sample
    return judge(judged, study, directory, options)


def other_of(against: str | None) -> str | dict[str, str] | None:
    """What `--against` names: a mission, or values."""
    if against is None or "=" not in against or Path(against).exists():
        return against
    return read_settings(against.split(","))


def judge(
    found: Sample | Probability | ImportanceEstimate, study: Stress, directory: Path, options: StressOptions
) -> int:
    """Say whether the specification holds as it is asked to, write that as JUnit XML, and return the exit code."""
    asked, assurance = float(options.holds or 0.0), Assurance.of(found)
    if options.junit is not None:
        files = [
            str(directory / FAILURES / f"{i}.xml") for i in range(min(len(found.failures), MAX_FAILURES))
        ]
        with reported(options.junit):
            options.junit.parent.mkdir(parents=True, exist_ok=True)
            put_whole(
                options.junit,
                junit_xml(study.batch.name, str(study.specification), assurance, asked, files),
            )
    put("", f" {assurance.sentence(asked)}")
    return OK if assurance.least > asked else DOES_NOT_HOLD


def show_sample(sample: Sample, study: Stress, directory: Path, options: StressOptions) -> None:
    """Show how many games failed, and the worst of them."""
    n, n_failed = len(sample.games), len(sample.failures)
    finite = sample.robustness[np.isfinite(sample.robustness)]
    quantiles = ", ".join(f"{q:.4g}" for q in np.quantile(finite, (0.0, 0.05, 0.5))) if len(finite) else ""
    put(
        "",
        title(study.batch.name, str(study.specification)),
        fact_list(
            [
                ("failed", f"{n_failed:,} of {n:,} games, {share(sample.value, sample.low, sample.high)}"),
                ("robustness", quantiles and f"{quantiles} (least, 5 %, median)"),
                ("study", Text(str(directory))),
                ("next", "" if n_failed else Text(f"{shlex.join(command_line())} --probability")),
            ]
        ),
    )
    show_failures(sample.failures, study, directory, options)


def show_search(found: FailureSearch, study: Stress, directory: Path, options: StressOptions) -> None:
    """Show what a search found."""
    n, nearest = len(found.games), found.nearest
    other = "; the same game of the other mission does not" if study.others else ""
    put(
        "",
        title(study.batch.name, str(study.specification)),
        fact_list(
            [
                ("failed", f"{found.n_failed:,} of {n:,} games{other if found.n_failed else ''}"),
                ("first failure", "" if found.first is None else f"game {found.first:,}"),
                ("least robustness", f"{nearest.robustness:.6g}, with {found.label(nearest) or f'seed {nearest.played.game.seed}'}"),
                ("study", Text(str(directory))),
            ]
        ),
    )  # fmt: skip
    for number, game in enumerate(found.failures[:MAX_SHOWN] if study.variables else ()):
        put(f" {FAILURES}/{number}.xml: {found.label(game)}")
    of = f"{len(found.failures):,} different failures among {found.n_failed:,} failed games"
    show_failures([game.played for game in found.failures], study, directory, options, of)
    if found.refused:
        values, error = found.refused[0]
        say_note(f"{len(found.refused):,} sets of values cannot be played, as {label(values)}: {error}")


def show_probability(found: Probability, study: Stress, directory: Path, options: StressOptions) -> None:
    """Show the probability of a failure, what it took, and the worst games."""
    plain = found.n_plain
    gain = f"; plain games would be {plain:,.0f} for the same error" if math.isfinite(plain) else ""
    complete = [r for r in found.repetitions if not r.is_extinct]
    ancestors = f"{np.median([r.n_ancestors for r in complete]):.0f} of {found.n}" if complete else ""
    put(
        "",
        title(
            study.batch.name,
            str(study.specification),
            f"{len(found.repetitions)} repetitions of {found.n} games at a time",
        ),
        fact_list(
            [
                ("probability of failure", share(found.value, found.low, found.high)),
                ("games", f"{found.n_games:,}{gain}"),
                ("time", f"{found.game_s:,.0f} s of games in {found.cpu_s:,.1f} s of CPU time"),
                ("levels", f"{np.median([len(r.levels) for r in found.repetitions]):.0f} in a repetition"),
                ("ancestors", ancestors and f"{ancestors} first games of a repetition have failing branches"),
                ("study", Text(str(directory))),
            ]
        ),
    )
    show_failures(found.failures, study, directory, options)
    for note in found.notes:
        say_note(note)


def show_importance(
    found: ImportanceEstimate, study: Stress, directory: Path, options: StressOptions
) -> None:
    """Show the probability of a failure, and how far it can be trusted."""
    plain = (
        f"; plain games would be {found.n_plain:,.0f} for the same error"
        if math.isfinite(found.n_plain)
        else ""
    )
    weights = f"{found.effective:,.0f} effective failing games of {found.n_failed:,}; the greatest weight is {found.greatest:.1%} of all"
    put(
        "",
        title(study.batch.name, str(study.specification), "importance sampling"),
        fact_list(
            [
                ("probability of failure", share(found.value, found.low, found.high)),
                ("games", f"{found.n_games:,}, {found.n:,} of them for the estimate{plain}"),
                ("weights", weights if found.n_failed else ""),
                ("time", f"{found.game_s:,.0f} s of games in {found.cpu_s:,.1f} s of CPU time"),
                ("study", Text(str(directory))),
            ]
        ),
    )
    for number, each in enumerate(found.failures[:MAX_SHOWN]):
        put(f" {FAILURES}/{number}.xml: {label(dict(each.game.values))}")
    show_failures(found.failures, study, directory, options)
    for note in found.notes:
        say_note(note)


def show_failures(
    failures: list[Played], study: Stress, directory: Path, options: StressOptions, of: str = ""
) -> None:
    """Show the worst games, and how to see one; `of` says what they are the worst of, by default their number."""
    if not failures:
        return
    rows = [
        (
            "",
            [
                f"{FAILURES}/{i}.xml",
                f"{each.verdict.robustness:.6g}",
                f"{(each.verdict.first_below(0.0) or 0) * study.mission.dt:.6g}",
                str(each.game.seed),
                str(len(each.game.rekeys)),
            ],
        )
        for i, each in enumerate(failures[:MAX_SHOWN])
    ]
    put(*number_tables(["game", "robustness", "fails at [s]", "seed", "branches"], rows))
    if len(failures) > MAX_SHOWN:
        put(
            f" the worst {MAX_SHOWN} of {of or f'{len(failures):,}'}; {min(len(failures), MAX_FAILURES)} are kept"
        )
    put("", f" tussle run {shlex.quote(str(directory / FAILURES / '0.xml'))}{plugin_files(options)}")


def show_chances(lost: list[Chance], study: Stress) -> None:
    """Show how likely the failure of the worst game was from each moment on."""
    rows = [
        (
            "",
            [
                time_of(each.step, study),
                share(each.value, each.low, each.high),
            ],
        )
        for each in lost
    ]
    put(*number_tables(["from t [s] on", "branches that fail"], rows))
    put(
        f" of {lost[0].n} branches of {FAILURES}/0.xml from each moment, with other luck; in parentheses: 95 % intervals"
    )


def show_why(why: Why, study: Stress, directory: Path, options: StressOptions) -> None:
    """Show when the worst game was lost, and what undoes its failure."""
    show_chances(why.chances, study)
    rows = [
        (
            "bold" if each.undoes else "",
            [
                f"{KINDS[each.kind]} {each.name}",
                time_of(each.step, study),
                share(each.value, each.low, each.high),
                "yes" if each.undoes else "",
            ],
        )
        for each in why.rows
    ]
    put("", *number_tables(["other than it was", "from t [s] on", "games that fail", "undoes it"], rows))
    put("", fact_list(why_facts(why, study, directory, options)))
    put("", Text(f" {replay_command(why, study, directory, options)}", no_wrap=True))


def replay_command(why: Why, study: Stress, directory: Path, options: StressOptions) -> str:
    """The command that shows the failing game beside the saved one, with the robustness of both."""
    games = [f"{FAILURES}/0.xml", *([] if why.saved is None else [saved_file(f"{FAILURES}/0.xml")])]
    words = ["tussle", "replay", *(str(directory / name.removesuffix(".xml")) for name in games)]
    if not unrecorded(study.specification, study.mission):
        words += ["--spec", options.spec or ""]
    if why.saved_step is not None:
        words += ["--mark", f"{time_of(why.saved_step, study)}=last moment at which it could be saved"]
    words += ["--mark", f"{time_of(why.lost_step, study)}=lost from here on"]
    return shlex.join(words) + plugin_files(options)


def why_facts(why: Why, study: Stress, directory: Path, options: StressOptions) -> list[tuple[str, str]]:
    """What to say below the table."""
    opened = (
        "from the beginning on it failed mostly or often"
        if why.open_step is None
        else time_of(why.open_step, study)
    )
    saved = "no branch passes"
    if why.saved_step is not None:
        file = shlex.quote(str(directory / saved_file(f"{FAILURES}/0.xml")))
        saved = f"{time_of(why.saved_step, study)}; tussle run {file}{plugin_files(options)}"
    return [
        ("undone by", ", ".join(why.causes) or "nothing that was tried"),
        ("needs", ", ".join(why.needed)),
        ("open until t [s]", opened),
        ("lost from t [s]", time_of(why.lost_step, study)),
        ("saved at t [s]", saved),
    ]


def time_of(step: int, study: Stress) -> str:
    """Time of the start of a step."""
    return f"{study.mission.start + step * study.mission.dt:.6g}"


def plugin_files(options: StressOptions) -> str:
    """Options of a further command that names the same plugin files."""
    return "".join(f" --plugin-path {shlex.quote(str(p))}" for p in options.plugin_files)


def show_smallest(found: SmallestGame, study: Stress, directory: Path, options: StressOptions) -> None:
    """Write the smallest failing game, and show how much smaller it is."""
    path = directory / FAILURES / "smallest.xml"
    with reported(directory):
        put_whole(path, to_xml(found.mission, found.seed))
    rows = [
        (
            "",
            [
                name,
                *(
                    str(part(mission))
                    for part in (
                        n_entities,
                        lambda m: len(m.blocks),
                        n_plugins,
                        lambda m: f"{m.end - m.start:.6g}",
                    )
                ),
            ],
        )
        for name, mission in (("mission", study.mission), (f"{FAILURES}/{path.name}", found.mission))
    ]
    put(*number_tables(["game", "entities", "blocks", "plugins", "length [s]"], rows))
    end = "no part of it can be left out" if found.is_smallest else "more could be left out"
    put(f" robustness {found.robustness:.6g}; {found.n_games} games were played, {end}")
    put("", f" tussle run {shlex.quote(str(path))}{plugin_files(options)}")


def n_entities(mission: Mission) -> int:
    """Number of entities of all blocks, but for those that are left out."""
    return sum(block.count - len(absent(mission, block)) for block in mission.blocks)


def n_plugins(mission: Mission) -> int:
    """Number of plugins of the world and of all blocks."""
    return len(mission.world_plugins) + sum(len(block.plugins) for block in mission.blocks)


def share(value: float, low: float, high: float) -> str:
    """A probability with its interval, to two digits."""
    return f"{value:.2g} ({low:.2g}–{high:.2g})"
