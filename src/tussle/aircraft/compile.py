"""Compiles an aircraft's files to kernels."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tussle import numeric
from tussle.aircraft import air, contact, runtime
from tussle.aircraft.aerodynamics import emit_aerodynamics, emit_external, offer_metrics, read_metrics
from tussle.aircraft.buoyancy import emit_buoyancy, read_buoyancy
from tussle.aircraft.code import STATE, Code, normal
from tussle.aircraft.contact import WIDTH
from tussle.aircraft.control import declare, emit_control, offer_commands
from tussle.aircraft.equations import (
    AIR_DATA,
    CORE,
    FLOW_PROPERTIES,
    PROPULSION_PROPERTIES,
    emit_accelerations,
    emit_propagate,
    flow_by_lengths,
    lever,
    offer,
)
from tussle.aircraft.files import Files
from tussle.aircraft.ground import emit_ground, offer_steering, read_ground
from tussle.aircraft.mass import emit_mass, read_mass
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion import RUNTIME, Propulsion, read_propulsion
from tussle.errors import ParameterError, clipped, nearest_name
from tussle.folders import whole_file
from tussle.numeric import store
from tussle.numeric.kernel import Device, Kernel, jitted, renamed
from tussle.numeric.source import define

KNOWN = (
    "fileheader", "metrics", "mass_balance", "propulsion", "system", "autopilot", "flight_control", "ground_reactions",
    "external_reactions", "buoyant_forces", "aerodynamics", "output", "input", "documentation", "description",
)  # fmt: skip
DECLARING = "metrics", "aerodynamics", "propulsion", "mass_balance", "ground_reactions", "buoyant_forces"
WIND = tuple(
    f"atmosphere/{kind}-{axis}-fps" for kind in ("wind", "gust") for axis in ("north", "east", "down")
)
BUILT_IN = (
    "aero/", "atmosphere/", "velocities/", "position/", "attitude/", "propulsion/", "inertia/", "forces/", "moments/",
    "accelerations/", "simulation/", "flight-path/", "inertial/", "metrics/", "ic/", "environment/",
)  # fmt: skip
"""Beginnings of JSBSim's own properties. Others belong to the aircraft: what nobody writes is a command from outside, 0 at first."""
WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
SCOPE = {
    name: each
    for module in (runtime, air, contact)
    for name, each in vars(module).items()
    if isinstance(each, Device)
}
SCOPE |= {name: getattr(numeric, name) for name in numeric.__all__} | RUNTIME | {"math": math, "np": np}


class GeneratedKernel(Kernel):
    """A kernel of a thousand lines, compiled without Numba's passes that take seconds and give nothing to plain arithmetic.

    Args:
        function: The Python function.
        signature: Codes of its arguments.
    """

    options: ClassVar[dict[str, Any]] = {**Kernel.options, "no_rewrites": True}

    def _new_dispatcher(self, key: str) -> Any:
        return jitted(
            renamed(self.py_func, key),
            nogil=True,
            no_cfunc_wrapper=True,
            pipeline_class=plain_compiler(),
            **self.options,
        )


@cache
def plain_compiler() -> Any:
    """Numba's compiler without the conversion to single assignment, which LLVM does too, and faster; numbers are the same bits."""
    from numba.core.compiler import CompilerBase, DefaultPassBuilder

    class PlainCompiler(CompilerBase):
        """Numba's compiler without the conversion to single assignment."""

        def define_pipelines(self) -> list[Any]:
            """The passes."""
            self.state.flags.enable_ssa = False
            return [DefaultPassBuilder.define_nopython_pipeline(self.state)]  # type: ignore[no-untyped-call]

    return PlainCompiler


@dataclass(frozen=True)
class CompiledAircraft:
    """An aircraft as kernels over rows.

    Attributes:
        name: Its name.
        slots: Property or state -> its row of the state.
        first: Values of the slots before the initial conditions are run, (k,).
        tables: Numbers of its tables.
        advance: advance(x, tables, begin, end, n_steps, dt, frozen_dt): step rows of the state x, (k, n).
        start: start(x, tables, begin, end, n_steps, dt, frozen_dt): start the engines, with open throttles; where dt > 0, they settle
            with the present positions of their levers.
        source: Python text of the kernels.
        inputs: Properties that may be set from outside.
        n_engines: Number of engines.
        files: Files that were read.
    """

    name: str
    slots: dict[str, int]
    first: np.ndarray
    tables: np.ndarray
    advance: Any
    start: Any
    source: str
    inputs: frozenset[str]
    n_engines: int
    files: tuple[Path, ...]

    def slot(self, name: str) -> int:
        """The row of the state that holds a property.

        Raises:
            ParameterError: It is none of those that are kept.
        """
        name = normal(name)
        if name not in self.slots:
            raise ParameterError(
                f"aircraft {self.name}: there is no property {clipped(name, 120)!r} in its state{nearest_name(name, self.slots)}"
            )
        return self.slots[name]


def emit(
    root: Element,
    find: Callable[[Element, str, str], Element],
    keep: Sequence[str] = (),
    keep_known: Sequence[str] = (),
) -> tuple[Code, Propulsion | None]:
    """Emit the step and the start of an aircraft.

    Raises:
        AircraftError: Something is not supported or invalid.
    """
    for each in root:
        if each.tag not in KNOWN:
            raise each.error("part of an aircraft that is not supported")
    code = Code()
    code.inputs.update(WIND, ["position/terrain-elevation-asl-ft"])
    propulsion = None
    if (node := root.find("propulsion")) is not None:
        propulsion = read_propulsion(find(node, node.get("file"), "part") if node.get("file") else node, find)
    n_engines = len(propulsion.engines) if propulsion else 0
    metrics = read_metrics(root.need("metrics"))
    offer_metrics(code, metrics)
    offer_commands(code, n_engines)
    for part in root:
        for each in part.find_all("property") if part.tag in DECLARING else ():
            declare(code, each)
    emit_propagate(code)
    contacts = read_ground(root.find("ground_reactions"))
    offer_steering(code, contacts)
    emit_control(code, root, find, n_engines)
    buoyant = root.find("buoyant_forces")
    cells = read_buoyancy(buoyant)
    emit_mass(code, read_mass(root.need("mass_balance")), propulsion.tanks if propulsion else (), cells)
    code.lines(AIR_DATA)
    lever(code, "eye", *metrics.eye)
    lever(code, "ref", *metrics.reference)
    offer(code, FLOW_PROPERTIES | flow_by_lengths(metrics.span or 1.0, metrics.chord))
    if propulsion:
        propulsion.emit(code)
    else:
        code.line("prop_fx = prop_fy = prop_fz = prop_mx = prop_my = prop_mz = 0.0")
    offer(code, PROPULSION_PROPERTIES)
    emit_aerodynamics(code, root.find("aerodynamics"), metrics)
    friction = emit_ground(code, contacts)
    emit_external(code, root.find("external_reactions"))
    emit_buoyancy(code, buoyant, cells)
    for axis in "xyz":
        code.line(f"force_{axis} = aero_f{axis} + prop_f{axis} + gear_f{axis} + ext_f{axis} + buoy_f{axis}")
        code.line(f"moment_{axis} = aero_m{axis} + prop_m{axis} + gear_m{axis} + ext_m{axis} + buoy_m{axis}")
    emit_accelerations(code, friction)
    if contacts:
        n = len(contacts)
        code.arrays = {"work": (2 * n, WIDTH), "matrix": (2 * n, 2 * n + 1), "gear": (n, 11)}
    code.begin("start")
    if propulsion:
        propulsion.emit_start(code)
    known = code.known()
    for name in ("position/geod-alt-ft", *keep, *(each for each in keep_known if normal(each) in known)):
        code.keep(name)
    # A property that the aircraft reads and nothing writes is a command from outside, unless JSBSim itself should write it.
    code.inputs.update(name for name in code.readers if not name.startswith(BUILT_IN))
    code.check()
    return code, propulsion


def compile_aircraft(
    root: Path | None, name: str, keep: Sequence[str] = (), keep_known: Sequence[str] = ()
) -> CompiledAircraft:
    """Compile an aircraft; the kernels are loaded from the cache or compiled on their first call.

    Args:
        root: Folder of aircraft, engine and systems; None for that of the package jsbsim.
        name: The aircraft.
        keep: Properties to be kept in the state, for who reads them.
        keep_known: The same, as far as the aircraft has them.

    Raises:
        AircraftError: It cannot be read, is invalid, or has something that is not supported.
    """
    files = Files(root, name)
    code, propulsion = emit(files.load(), files.find, keep, keep_known)
    slots = code.slots()
    names = [*CORE, *slots]
    variables = {each: each if k < len(CORE) else code.variable(each) for k, each in enumerate(names)}
    names += [f"{STATE}ring {k} {j}" for k, capacity in enumerate(code.rings) for j in range(capacity)]
    texts = {section: [*_function(code, section, variables)] for section in code.sections}
    source = "\n".join(line for lines in texts.values() for line in lines) + "\n"
    kernels = {
        section: GeneratedKernel(
            define(lines, SCOPE, __name__, f"{name}_{section}", f"<aircraft {name}>"), "F2w F i8 i8 i8 f8 f8"
        )
        for section, lines in texts.items()
    }
    first = np.array([0.0] * len(CORE) + [code.initial.get(each, 0.0) for each in names[len(CORE) :]])
    return CompiledAircraft(
        name, {each: k for k, each in enumerate(names)}, first, code.tables,
        kernels["step"], kernels["start"], source, frozenset(code.inputs & set(names)),
        len(propulsion.engines) if propulsion else 0, tuple(files.read),
    )  # fmt: skip


def _function(code: Code, section: str, variables: dict[str, str]) -> Iterator[str]:
    """Source of the kernel of a section."""
    yield f"def {section}(x, tables, begin, end, n_steps, dt, frozen_dt):"
    place = len(variables)
    for k, capacity in enumerate(code.rings):
        yield f"    ring_{k} = {place}"
        place += capacity
    for array, (rows, columns) in code.arrays.items() if section == "step" else ():
        yield f"    {array} = np.zeros(({rows}, {columns}))"
    yield "    for row in range(begin, end):"
    body = [*code.body(section, 3), "            pass"]
    # Values that the section does not use are neither loaded nor stored: that would only take time to compile.
    used = {word for line in body for word in WORD.findall(line)}
    mentioned = [(k, name, v) for k, (name, v) in enumerate(variables.items()) if v in used]
    for k, _, variable in mentioned:
        yield f"        {variable} = x[{k}, row]"
    yield "        for _ in range(n_steps):"
    yield from body
    changed = code.sections[section].touched
    for k, name, variable in mentioned:
        if k < len(CORE) or name.startswith(STATE) or name in changed:
            yield f"        x[{k}, row] = {variable}"
    yield ""


def save_source(aircraft: CompiledAircraft) -> Path:
    """Write the source of an aircraft's kernels into the folder of the kernels' cache; return its path."""
    digest = hashlib.blake2b(aircraft.source.encode(), digest_size=6).hexdigest()
    path = store.directory() / f"aircraft-{store.file_stem(aircraft.name)}-{digest}.py"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part:
            part.write_text(aircraft.source, encoding="utf-8")
    return path
