"""Which algorithms, surfaces and datasets are there, and what do they promise?

A decorator only marks a function with its :class:`Algorithm` or :class:`Surface`; nothing happens
at import. A :class:`Registry` is then collected from entry points (``cembench.algorithms``,
``cembench.surfaces``, ``cembench.datasets``: the built-in ones are found no differently from
anybody's) and from plug-ins named by the user, a file or ``module:name``. A dataset needs no mark:
it is a :class:`cembench.mesh.datasets.Dataset`, an object at module level, or a tuple of them.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import inspect
import json
import os
import sys
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from dataclasses import dataclass, field, fields, replace
from importlib.metadata import entry_points
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from cembench.core.errors import ParameterError, RegistryError, said_by
from cembench.core.parameterization import MapStep
from cembench.core.program import Library, Program, checked_program, found_words, of_matlab_function
from cembench.mesh.datasets import Dataset
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh

#: What an algorithm maps to; tables never mix these without saying so.
#: An atlas has UVs for corners, not for vertices: the surface is cut into islands.
Target = Literal["disk", "free boundary", "circular holes", "atlas"]

#: Finds named places on a mesh of a surface family: name -> vertex, counted from 0.
Landmarks = Callable[[TriangleMesh], Mapping[str, int]]
#: From a surface's vertices (n, 3) to the image (n,) of each under its conformal map.
ExactMap = Callable[[NDArray[np.float64]], NDArray[np.complex128]]

#: The steps that an algorithm passes through on a mesh, each as it is done.
Steps = Callable[..., Iterator[MapStep]]

_MARK = "__cembench__"
#: Whole numbers of this size fit no array, whatever range a parameter declares.
LARGEST = 2**63
C = TypeVar("C", bound=Callable[..., Any])


@dataclass(frozen=True)
class Parameter:
    """A keyword argument of a registered function: name, type with its range, default."""

    name: str
    annotation: Any
    default: Any

    def parse(self, value: Any, owner: str) -> Any:
        """Read a value, also from text as ``-p NAME=VALUE`` gives it.

        Raises
        ------
        ParameterError
            A value of the wrong type or outside the declared range.

        """
        try:
            parsed = TypeAdapter(self.annotation).validate_python(value)
            if type(parsed) is int and abs(parsed) >= LARGEST:
                raise ParameterError(
                    f"{owner}: {self.name}={value!r} is not allowed: beyond 64 bits (default "
                    f"{self.default!r})."
                )
            return parsed
        except ValidationError as error:
            reason = error.errors()[0]["msg"]
            raise ParameterError(
                f"{owner}: {self.name}={value!r} is not allowed: {reason} "
                f"(default {self.default!r})."
            ) from None


@dataclass(frozen=True)
class _Registered:
    name: str
    title: str
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    origin: str
    notes: str
    #: The module that declares it, which is where the decorator stands, and the file of that.
    module: str
    file: Path | None

    def arguments(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """All keyword arguments of a call: the given ones checked, the others at their defaults.

        Raises
        ------
        ParameterError
            An unknown name, or a value that :meth:`Parameter.parse` refuses.

        """
        known = {p.name: p for p in self.parameters}
        for name in given:
            if name not in known:
                allowed = ", ".join(known) or "none"
                raise ParameterError(
                    f"{self.name} has no parameter {name!r}; its parameters are: {allowed}."
                )
        return {
            name: p.parse(given[name], self.name) if name in given else p.default
            for name, p in known.items()
        }


@dataclass(frozen=True)
class Algorithm(_Registered):
    """An algorithm and what it promises: see :func:`algorithm`."""

    target: Target = "disk"
    mesh_type: type[TriangleMesh] = DiskMesh
    source: str = ""
    steps: Steps | None = None
    usual: bool = True
    #: Whether its maps tend to conformal ones as triangles shrink; `validate` holds it to that.
    conformal: bool = True
    #: The external program that it is, if any; its function is never called then.
    program: Program | None = None
    #: The library of others that its function calls, if any.
    library: Library | None = None
    #: Its map depends on the triangles alone, not on the coordinates.
    combinatorial: bool = False


@dataclass(frozen=True)
class Surface(_Registered):
    """A surface family: see :func:`surface_family`."""

    source: str = ""
    paper_row: str = ""
    landmarks: Landmarks | None = None
    kept: Callable[..., Path] | None = None
    exact_map: ExactMap | None = None


def algorithm(
    name: str,
    *,
    title: str,
    target: Target,
    source: str = "",
    notes: str = "",
    steps: Steps | None = None,
    usual: bool = True,
    conformal: bool = True,
    library: Library | None = None,
    combinatorial: bool = False,
) -> Callable[[C], C]:
    """Declare a function ``(mesh, *, parameters) -> Parameterization`` as an algorithm.

    Parameters
    ----------
    name : str
        What the command line calls it.
    title : str
        What a table's heading calls it.
    target : "disk", "free boundary", "circular holes" or "atlas"
        The class of its image; an atlas is returned as an `Atlas`.
    source : str
        Where it was published.
    notes : str
        What it is faithful to, and what it had to decide; default: the docstring's second part.
    steps : callable, optional
        Takes a mesh, `sweeps` and `outer`, and yields every :class:`MapStep` on the way to the map.
    usual : bool
        Whether a run in which no algorithms are named measures it.
    conformal : bool
        Whether its maps tend to conformal ones as the triangles shrink; false for a method that
        does not promise that, of which `validate` tells the rates without judging them.
    library : Library, optional
        The library of others whose map it is: tables name it, and its version is recorded.
    combinatorial : bool
        Whether its map depends on the triangles alone, so that another shape has the same one: what
        another method returns unchanged for another shape is taken for a kept result.

    The annotation of the first argument, `DiskMesh` or `HoledMesh`, tells which surfaces it takes.
    Parameters are keyword-only with a type and a default; ``Annotated[int, Field(ge=0)]`` states a
    range.

    Raises
    ------
    RegistryError
        A declaration that cannot be right: unknown target, missing types or defaults.

    """
    place = _place(sys._getframe(1))
    about = {
        "target": target,
        "source": source,
        "notes": notes,
        "steps": steps,
        "library": library,
        "usual": usual,
        "conformal": conformal,
        "combinatorial": combinatorial,
    }

    def mark(function: C) -> C:
        _set_mark(function, _algorithm_of(function, place, name, title, about))
        return function

    return mark


def external_program(
    name: str,
    *,
    title: str,
    target: Target,
    command: str,
    source: str = "",
    notes: str = "",
    **how: Any,
) -> Callable[[C], C]:
    """Declare a program of any language as an algorithm.

    The decorated function is never called: its signature says which surfaces the program takes and
    which parameters its command has, and its docstring what it is.

    Parameters
    ----------
    name, title, target, source, notes
        As for :func:`algorithm`; tables add to the title that it is an external program.
    command : str
        As a shell would read it, with ``{input}``, ``{output}`` and ``{PARAMETER}``; no shell does.
        Files of the declaring file's folder may be named without it.
    **how
        The other fields of :class:`cembench.core.program.Program`, `version` as one text.

    Raises
    ------
    RegistryError
        A declaration that cannot be right.

    Examples
    --------
    >>> @external_program("mine", title="Mine", target="disk", command="mine {input} {output}")
    ... def mine(mesh: DiskMesh) -> None:
    ...     "Does what mine does."

    """
    place = _place(sys._getframe(1))
    folder = place[1].parent if place[1] else Path.cwd()
    about = {"target": target, "source": source, "notes": notes}

    def mark(function: C) -> C:
        _set_mark(function, _program_of(function, place, name, title, about, command, folder, how))
        return function

    return mark


def program_from(declared: Mapping[str, Any], folder: Path) -> Algorithm:
    """Return the algorithm that a command line declares, without parameters.

    It takes disks; for circular holes surfaces with holes, for an atlas any surface.

    Parameters
    ----------
    declared : mapping
        `command` and, as far as they are given, `name`, `target` and the fields of
        :class:`cembench.core.program.Program`.
    folder : Path
        Where the files lie that it names without a path.

    Raises
    ------
    RegistryError
        It cannot be right.

    """
    given = dict(declared)
    command, name, target = (given.pop(key, "") for key in ("command", "name", "target"))
    for key in ("input", "output"):  # a format may be called "obj" as well as ".obj"
        if key in given and "." not in given[key]:
            given[key] = f".{given[key]}"
    name = name or _program_name(command)
    source = command
    if command.endswith(".m") and (folder / command).is_file():
        function_file = of_matlab_function(folder / command)
        command = function_file.pop("command")
        given = function_file | given
    place = ("cembench.registry", None)
    about = {"target": target or "disk", "source": source, "notes": ""}
    function = _TAKES.get(target, _of_disks)
    return _program_of(function, place, name, name, about, command, folder, given)


def _of_disks(mesh: DiskMesh) -> None:
    """Stand for a program that takes disks."""


def _of_holes(mesh: HoledMesh) -> None:
    """Stand for a program that takes surfaces with holes."""


def _of_any(mesh: TriangleMesh) -> None:
    """Stand for a program that cuts any surface."""


#: By target, where it is not disks.
_TAKES = {"circular holes": _of_holes, "atlas": _of_any}


def _program_name(command: str) -> str:
    """Return what a command is called by: its program, or the script that an interpreter runs."""
    words = [Path(word) for word in command.split()]
    script = next((word for word in words[1:] if word.suffix in (".py", ".m", ".sh", ".js")), None)
    return (script or next(iter(words), Path("program"))).stem or "program"


def _program_of(
    function: Callable[..., Any],
    place: tuple[str, Path | None],
    name: str,
    title: str,
    about: Mapping[str, Any],
    command: str,
    folder: Path,
    how: Mapping[str, Any],
) -> Algorithm:
    known = [one.name for one in fields(Program) if one.name != "command"]
    unknown = [key for key in how if key not in known]
    if unknown:
        raise RegistryError(
            f"program {name!r}: {unknown[0]!r} is unknown; allowed: {', '.join(known)}."
        )
    given = dict(how) | {"version": found_words(how.get("version", ""), folder)}
    program = Program(command=found_words(command, folder), **given)
    spec = _algorithm_of(function, place, name, f"{title} (external program)", about)
    program = checked_program(name, program, [p.name for p in spec.parameters])
    return replace(spec, program=program)


def _algorithm_of(
    function: Callable[..., Any],
    place: tuple[str, Path | None],
    name: str,
    title: str,
    about: Mapping[str, Any],
) -> Algorithm:
    if about["target"] not in get_args(Target):
        raise RegistryError(
            f"algorithm {name!r}: target {about['target']!r} is unknown; "
            f"allowed: {', '.join(map(repr, get_args(Target)))}."
        )
    hints, parameters = _signature(name, function)
    first = next(iter(inspect.signature(function).parameters), None)
    mesh_type = hints.get(first or "", None)
    if mesh_type not in (TriangleMesh, DiskMesh, HoledMesh):
        raise RegistryError(
            f"algorithm {name!r}: its first argument must be annotated as DiskMesh, HoledMesh "
            f"or TriangleMesh, the surfaces it takes; got {mesh_type!r}."
        )
    return Algorithm(
        name=name,
        title=title,
        function=function,
        parameters=parameters,
        mesh_type=mesh_type,
        **{**about, "notes": about["notes"] or _notes(function)},
        **_origin(place, function),
    )


def surface_family(
    name: str,
    *,
    title: str,
    source: str = "",
    notes: str = "",
    paper_row: str = "",
    landmarks: Landmarks | None = None,
    kept: Callable[..., Path] | None = None,
    exact_map: ExactMap | None = None,
) -> Callable[[C], C]:
    """Declare a function ``(faces, *, seed, parameters) -> TriangleMesh`` as a surface family.

    `faces` is the number of triangles asked for; it has a default. `paper_row` is the model of the
    paper's Table 1 that the surface stands for, if any: the profiles are made of those. `landmarks`
    finds named vertices, such as the tip of a nose, on a mesh that the function made, of any size.
    `kept` takes the same arguments and tells the file in which the surface lies once it has been
    made; where the surface would be another one, so is the file. `exact_map` is its conformal map
    to the unit disk, for holed surfaces with round holes, where that is known in closed form for
    the default parameters; it is one of many, up to a Moebius map.

    Raises
    ------
    RegistryError
        Missing types or defaults.

    """
    place = _place(sys._getframe(1))

    def mark(function: C) -> C:
        _, parameters = _signature(name, function, positional="faces")
        spec = Surface(
            name=name,
            title=title,
            function=function,
            parameters=parameters,
            notes=notes or _notes(function),
            source=source,
            paper_row=paper_row,
            landmarks=landmarks,
            kept=kept,
            exact_map=exact_map,
            **_origin(place, function),
        )
        _set_mark(function, spec)
        return function

    return mark


def _signature(
    name: str, function: Callable[..., Any], positional: str | None = None
) -> tuple[dict[str, Any], tuple[Parameter, ...]]:
    try:
        hints = typing.get_type_hints(_annotated(function), include_extras=True)
        signature = inspect.signature(function)
    except (TypeError, ValueError, NameError, AttributeError) as error:
        raise RegistryError(
            f"{name!r}: the signature of {function!r} cannot be read ({error}); decorate a "
            "function whose arguments have type annotations."
        ) from None
    parameters = []
    for p in signature.parameters.values():
        if p.kind is not p.KEYWORD_ONLY and p.name != positional:
            continue
        if p.name not in hints or p.default is p.empty:
            raise RegistryError(
                f"{name!r}: parameter {p.name!r} needs a type annotation and a default value."
            )
        parameters.append(Parameter(p.name, hints[p.name], p.default))
    return hints, tuple(parameters)


def _annotated(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return what has the annotations of a callable that need not be a function."""
    if isinstance(function, functools.partial):
        return _annotated(function.func)
    if isinstance(function, type) or inspect.isroutine(function):
        return function
    call: Callable[..., Any] = type(function).__call__
    return call


def _place(frame: FrameType) -> tuple[str, Path | None]:
    """Return the module and the file of a frame: of what calls a decorator.

    The decorated function cannot tell: a decorator below may have put one of another file there.
    """
    module, file = (frame.f_globals.get(key) for key in ("__name__", "__file__"))
    return str(module), None if file is None else Path(file).absolute()


def _origin(place: tuple[str, Path | None], function: Callable[..., Any]) -> dict[str, Any]:
    module, file = place
    called = getattr(function, "__qualname__", type(function).__qualname__)
    return {"module": module, "file": file, "origin": f"{module}:{called}"}


def _set_mark(function: Callable[..., Any], spec: _Registered) -> None:
    try:
        setattr(function, _MARK, spec)
    except (AttributeError, TypeError) as error:
        raise RegistryError(
            f"{spec.name!r}: {function!r} cannot be marked ({error}); decorate a function."
        ) from None


def _notes(function: Callable[..., Any]) -> str:
    """Return everything in the docstring after its first line."""
    written = inspect.getdoc(_annotated(function)) or ""
    return written.partition("\n")[2].strip()


@dataclass(frozen=True)
class Registry:
    """The algorithms, surfaces and datasets that can be named."""

    algorithms: Mapping[str, Algorithm] = field(default_factory=dict)
    surfaces: Mapping[str, Surface] = field(default_factory=dict)
    datasets: Mapping[str, Dataset] = field(default_factory=dict)
    #: Algorithms of others, libraries and programs, that need not be on this machine: they are run
    #: only where they are named.
    peers: Mapping[str, Algorithm] = field(default_factory=dict)
    #: Files of models that can be fetched but are no surfaces.
    parts: Mapping[str, Dataset] = field(default_factory=dict)

    @property
    def usual_algorithms(self) -> list[str]:
        """The names of the algorithms that are measured where none are named."""
        return [name for name, spec in self.algorithms.items() if spec.usual]

    def algorithm(self, name: str) -> Algorithm:
        """The algorithm of this name; :class:`RegistryError` lists the known ones."""
        return _look_up("algorithm", {**self.peers, **self.algorithms}, name)

    def surface(self, name: str) -> Surface:
        """The surface of this name; :class:`RegistryError` lists the known ones."""
        return _look_up("surface", self.surfaces, name)

    def dataset(self, name: str) -> Dataset:
        """The dataset of this name; :class:`RegistryError` lists the known ones."""
        return _look_up("dataset", self.datasets, name)

    @property
    def groups(self) -> dict[str, list[Dataset]]:
        """The datasets and the parts of models by group, in the order in which they are listed."""
        found: dict[str, list[Dataset]] = {}
        for dataset in (*self.datasets.values(), *self.parts.values()):
            if dataset.group:
                found.setdefault(dataset.group, []).append(dataset)
        return found

    def group(self, name: str) -> list[Dataset]:
        """The datasets of this group; :class:`RegistryError` lists the known ones."""
        if name not in self.groups:
            known = ", ".join(self.groups) or "none"
            raise RegistryError(f"unknown group of datasets {name!r}; known: {known}.")
        return self.groups[name]


R = TypeVar("R", Algorithm, Surface, Dataset)

_DECORATORS: Mapping[type, str] = {Algorithm: "algorithm", Surface: "surface_family"}
_GROUPS: Mapping[type, str] = {
    Algorithm: "cembench.algorithms",
    Surface: "cembench.surfaces",
    Dataset: "cembench.datasets",
}
#: Entry points of algorithms that `cembench run` leaves out unless they are named.
PEERS = "cembench.peers"
#: How a plug-in begins that is a command line: the rest is its declaration as JSON.
COMMAND = "command:"


def _look_up(kind: str, known: Mapping[str, R], name: str) -> R:
    if name not in known:
        raise RegistryError(
            f"unknown {kind} {name!r}; known: {', '.join(sorted(known)) or 'none'}."
        )
    return known[name]


def load_registry(plugins: Iterable[str] = ()) -> Registry:
    """Collect the installed algorithms and surfaces, and those of the user's plug-ins.

    Parameters
    ----------
    plugins : iterable of str
        Each the path of a Python file, or ``module:name``.

    Raises
    ------
    RegistryError
        A name declared twice, a plug-in that cannot be imported or that declares nothing.

    """
    installed = _installed()
    algorithms = dict(installed.algorithms)
    surfaces = dict(installed.surfaces)
    for plugin in plugins:
        for spec in declared_by(plugin):
            _add(algorithms if isinstance(spec, Algorithm) else surfaces, spec)
    peers = {name: peer for name, peer in installed.peers.items() if name not in algorithms}
    return Registry(algorithms, surfaces, installed.datasets, peers, installed.parts)


@functools.lru_cache(maxsize=1)
def _installed() -> Registry:
    found = _all_datasets()
    surfaces = {name: dataset for name, dataset in found.items() if dataset.part is None}
    parts = {name: dataset for name, dataset in found.items() if dataset.part is not None}
    kinds = _all_declared(Algorithm), _all_declared(Surface), surfaces
    return Registry(*kinds, _all_declared(Algorithm, PEERS), parts)


def _all_datasets() -> dict[str, Dataset]:
    """The datasets of all entry points: each is one, or a tuple of them under a name of its own."""
    known: dict[str, Dataset] = {}
    for entry in sorted(entry_points(group=_GROUPS[Dataset]), key=lambda entry: entry.name):
        loaded = _load_entry(entry)
        several = isinstance(loaded, tuple) and all(isinstance(one, Dataset) for one in loaded)
        for dataset in loaded if several else (_declared_at(entry, Dataset),):
            _add(known, dataset)
    return known


def _all_declared(kind: type[R], group: str = "") -> dict[str, R]:
    known: dict[str, R] = {}
    found = entry_points(group=group or _GROUPS[kind])
    for entry in sorted(found, key=lambda entry: entry.name):
        _add(known, _declared_at(entry, kind))
    return known


def load_algorithm(name: str, plugins: Iterable[str] = ()) -> Algorithm:
    """As ``load_registry(plugins).algorithm(name)``, importing nothing else that is installed.

    A process that measures one algorithm starts sooner so, and holds no more than it needs.
    """
    for entry in entry_points(group=_GROUPS[Algorithm], name=name):
        return _declared_at(entry, Algorithm)
    for plugin in plugins:
        for spec in declared_by(plugin):
            if isinstance(spec, Algorithm) and spec.name == name:
                return spec
    for entry in entry_points(group=PEERS, name=name):
        return _declared_at(entry, Algorithm)
    return load_registry(plugins).algorithm(name)


def _declared_at(entry: Any, kind: type[R]) -> R:
    loaded = _load_entry(entry)
    spec = getattr(loaded, _MARK, loaded)
    if not isinstance(spec, kind) or spec.name != entry.name:
        noun = kind.__name__.lower()
        remedy = (
            f"make it a Dataset({entry.name!r}, ...)"
            if kind is Dataset
            else f"decorate it with @{_DECORATORS[kind]}({entry.name!r}, ...)"
        )
        raise RegistryError(
            f"entry point {entry.name} = {entry.value!r} of group {entry.group!r} is no {noun} of "
            f"that name; {remedy}."
        )
    return spec


def _load_entry(entry: Any) -> Any:
    try:
        return entry.load()
    except Exception as error:
        raise RegistryError(
            f"entry point {entry.name} = {entry.value!r} cannot be loaded: "
            f"{said_by(error)}. Repair or uninstall the package that declares it."
        ) from error


def _add(known: dict[str, Any], spec: _Registered | Dataset) -> None:
    if spec.name in known:
        raise RegistryError(
            f"the name {spec.name!r} is declared twice: by {known[spec.name].origin} and by "
            f"{spec.origin}. Rename one of them."
        )
    known[spec.name] = spec


def declared_by(plugin: str) -> list[_Registered]:
    """Return what a file declares, or a single ``module:name``, or a command line."""
    if plugin.startswith(COMMAND):
        declared = json.loads(plugin.removeprefix(COMMAND))
        return [program_from(declared, Path(declared.pop("folder", "")))]
    location, _, name = plugin.partition(":")
    path = Path(plugin)
    if path.suffix == ".py":
        module = _import_file(path)
        specs = [vars(module)[key] for key in vars(module)]
    elif name:
        module = _import_module(location, plugin)
        if not hasattr(module, name):
            raise RegistryError(f"plug-in {plugin!r}: module {location!r} has no {name!r}.")
        specs = [getattr(module, name)]
    else:
        raise RegistryError(f"plug-in {plugin!r} is neither a Python file (*.py) nor module:name.")
    # Only what is declared there, not what it imports from elsewhere.
    marks = [_mark_of(value) for value in specs]
    found = [spec for spec in marks if spec and (name or spec.module == module.__name__)]
    if not found:
        raise RegistryError(
            f"plug-in {plugin!r} declares nothing; decorate a function with @algorithm(...) or "
            "@surface_family(...) from cembench."
        )
    return found


def _import_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise RegistryError(f"plug-in {str(path)!r}: there is no such file.")
    name = f"cembench_plugin_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # so that its functions can look up their own annotations
    try:
        with _importing(str(path)):
            spec.loader.exec_module(module)
    except RegistryError:
        sys.modules.pop(name, None)
        raise
    return module


def _import_module(module: str, plugin: str) -> ModuleType:
    with _importing(plugin):
        return importlib.import_module(module)


@contextmanager
def _importing(plugin: str) -> Iterator[None]:
    """Make one error of whatever an import raises; what it prints goes to standard error.

    An interrupt is the user's: that a plug-in raises one is found out where it is loaded first
    (:mod:`cembench.running.plugins`).
    """
    try:
        with _standard_output_apart():
            yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise RegistryError(
            f"plug-in {plugin!r} cannot be imported: {said_by(error)}. Repair it: importing "
            "a plug-in must only declare functions."
        ) from error


@contextmanager
def _standard_output_apart() -> Iterator[None]:
    """Let standard output go to standard error, also what is not written by Python."""
    with ExitStack() as back:
        with suppress(AttributeError, OSError, ValueError):  # there may be none, or a closed one
            sys.stdout.flush()
            kept = os.dup(1)
            back.callback(os.close, kept)
            back.callback(os.dup2, kept, 1)
            os.dup2(2, 1)
        with redirect_stdout(sys.stderr):
            yield


def _mark_of(value: Any) -> _Registered | None:
    """Return the mark of an object of a plug-in, which may answer anything to being asked."""
    try:
        mark = getattr(value, _MARK, None)
    except Exception:
        return None
    return mark if isinstance(mark, _Registered) else None
