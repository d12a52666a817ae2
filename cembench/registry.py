"""The registry of algorithms, surfaces and datasets, and what each of them promises.

A decorator only marks a function with its :class:`Algorithm` or :class:`Surface`; nothing is
registered at import. A :class:`Registry` is then collected from entry points
(``cembench.algorithms``, ``cembench.surfaces``, ``cembench.datasets``; the built-in ones are found
in the same way as third-party ones) and from plug-ins that the user names: a file or
``module:name``. A dataset needs no mark: it is a :class:`cembench.mesh.datasets.Dataset`, an object
at module level, or a tuple of them.
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
from collections import ChainMap
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from dataclasses import dataclass, field, fields, replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from cembench.core.errors import ParameterError, RegistryError, describe_error
from cembench.core.names import did_you_mean, unknown
from cembench.core.parameterization import MapStep
from cembench.core.program import (
    Library,
    MapFiles,
    Program,
    checked_program,
    found_words,
    of_matlab_function,
    words_of,
)
from cembench.mesh.datasets import Dataset
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh

#: The kinds of image that an algorithm can produce; tables always keep them apart.
#: An atlas has UVs at corners, not at vertices: the surface is cut into islands.
Target = Literal["disk", "free boundary", "circular holes", "disk with holes", "atlas"]

#: Finds the named landmarks of a family's mesh: name -> vertex, counted from 0.
Landmarks = Callable[[TriangleMesh], Mapping[str, int]]
#: Maps a surface's vertices (n, 3) to their images (n,) under its exact conformal map.
ExactMap = Callable[[NDArray[np.float64]], NDArray[np.complex128]]

#: Yields the steps of an algorithm on a mesh, each as soon as it is done.
Steps = Callable[..., Iterator[MapStep]]

_MARK = "__cembench__"
#: Integers of this size do not fit into arrays, whatever range a parameter declares.
LARGEST = 2**63
#: Most triangles that a family of surfaces should offer: more fill the memory of many machines.
MAX_FACES = 4_000_000
C = TypeVar("C", bound=Callable[..., Any])


@dataclass(frozen=True)
class Parameter:
    """A keyword argument of a registered function: name, type with range, default."""

    name: str
    annotation: Any
    default: Any

    @functools.cached_property
    def _type(self) -> TypeAdapter[Any]:
        return TypeAdapter(self.annotation)

    def parse(self, value: Any, owner: str) -> Any:
        """Return a value as the parameter's type; text is converted, as from ``-p NAME=VALUE``.

        Raises
        ------
        ParameterError
            The value has the wrong type or is outside the declared range.
        """
        try:
            parsed = self._type.validate_python(value)
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
    """The common fields of registered algorithms and surface families."""

    name: str
    title: str
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    origin: str
    notes: str
    #: The module and the file that contain the decorator.
    module: str
    file: Path | None

    def arguments(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return all keyword arguments of a call: given ones checked, others at their defaults.

        Raises
        ------
        ParameterError
            A name is unknown, or :meth:`Parameter.parse` refuses a value.
        """
        known = {p.name: p for p in self.parameters}
        for name in values:
            if name not in known:
                allowed = ", ".join(known) or "none"
                raise ParameterError(
                    f"{self.name} has no parameter {name!r}; its parameters are: {allowed}."
                    + did_you_mean(name, known)
                )
        return {
            name: p.parse(values[name], self.name) if name in values else p.default
            for name, p in known.items()
        }


@dataclass(frozen=True)
class Algorithm(_Registered):
    """A registered algorithm and what it promises; see :func:`algorithm`."""

    target: Target = "disk"
    mesh_type: type[TriangleMesh] = DiskMesh
    source: str = ""
    steps: Steps | None = None
    #: Gives its map on a refinement of the mesh, if it has one: `mesh`, `uv` and `extras`.
    refinement: Callable[..., Any] | None = None
    usual: bool = True
    #: Whether its maps converge to conformal ones under refinement; `validate` checks that.
    conformal: bool = True
    #: The external program to run, if any; the function is then never called.
    program: Program | None = None
    #: The third-party library that its function calls, if any.
    library: Library | None = None
    #: The files that hold its maps, if somebody made them; the function is then never called.
    maps: MapFiles | None = None
    #: Whether its map depends on the triangles alone, not on the coordinates.
    combinatorial: bool = False


@dataclass(frozen=True)
class Surface(_Registered):
    """A registered surface family; see :func:`surface_family`."""

    source: str = ""
    paper_row: str = ""
    fitted: str = ""
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
    refinement: Callable[..., Any] | None = None,
    usual: bool = True,
    conformal: bool = True,
    library: Library | None = None,
    combinatorial: bool = False,
) -> Callable[[C], C]:
    """Declare a function ``(mesh, *, parameters) -> Parameterization`` as an algorithm.

    The annotation of the first argument, `DiskMesh`, `HoledMesh` or `TriangleMesh`, says which
    surfaces the algorithm accepts. Parameters are keyword-only and have a type and a default;
    ``Annotated[int, Field(ge=0)]`` declares a range.

    Parameters
    ----------
    name : str
        Name on the command line.
    title : str
        Name in table headings.
    target : {"disk", "free boundary", "circular holes", "disk with holes", "atlas"}
        The kind of image; an atlas is returned as an `Atlas`.
    source : str
        Where the method was published.
    notes : str
        What the code is faithful to and what it had to decide (default: the docstring after its
        first line).
    steps : callable, optional
        Takes a mesh, `sweeps` and `outer`, and yields every :class:`MapStep` on the way to the map.
    refinement : callable, optional
        Takes what the algorithm takes, and returns its map on a refinement of the mesh: an object
        with `mesh`, whose first vertices are those of the given one, `uv` and `extras`.
    usual : bool
        Whether a run measures it when no algorithms are named.
    conformal : bool
        Whether its maps converge to conformal ones under refinement. If false, `validate` reports
        the rates without judging them.
    library : Library, optional
        The third-party library that computes the map; tables name it, and its version is recorded.
    combinatorial : bool
        Whether the map depends on the triangles alone, so that another shape with the same
        triangles has the same map, up to the Moebius map of a gauge; `validate` tests it. Any other
        method that returns an unchanged map for a changed shape is suspected of returning a stored
        result.

    Returns
    -------
    callable
        A decorator that marks the function and returns it unchanged.

    Raises
    ------
    RegistryError
        The declaration is invalid: an unknown target, or missing types or defaults.

    Examples
    --------
    >>> from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
    >>> from cembench.conformal.laplacian import laplacian
    >>> from cembench.core.parameterization import Parameterization
    >>> @algorithm("mine", title="Mine", target="disk")
    ... def mine(mesh: DiskMesh) -> Parameterization:
    ...     "Map a disk with the boundary spaced by arc length."
    ...     circle = arc_length_circle(mesh)
    ...     return Parameterization(harmonic_extension(laplacian(mesh), mesh.boundary, circle))
    """
    place = _place(sys._getframe(1))
    about = {
        "target": target,
        "source": source,
        "notes": notes,
        "steps": steps,
        "refinement": refinement,
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
    """Declare a program in any language as an algorithm.

    The decorated function is never called. Its signature says which surfaces the program accepts
    and which parameters its command has; its docstring describes the program.

    Parameters
    ----------
    name : str
        Name on the command line.
    title : str
        Name in table headings, which add that it is an external program.
    target : {"disk", "free boundary", "circular holes", "disk with holes", "atlas"}
        The kind of image.
    command : str
        The command in shell notation, with ``{input}``, ``{output}`` and ``{PARAMETER}``; it is not
        run by a shell. Files in the folder of the declaring file may be named without their path.
    source : str
        Where the method was published.
    notes : str
        As for :func:`algorithm`.
    **how
        The other fields of :class:`cembench.core.program.Program`, with `version` as one string.

    Returns
    -------
    callable
        A decorator that marks the function and returns it unchanged.

    Raises
    ------
    RegistryError
        The declaration is invalid.

    Examples
    --------
    >>> @external_program("mine", title="Mine", target="disk", command="mine {input} {output}")
    ... def mine(mesh: DiskMesh) -> None:
    ...     "Map a disk with the program `mine`."
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

    It accepts disks; for circular holes surfaces with holes, for an atlas any surface.

    Parameters
    ----------
    declared : mapping
        `command` and optionally `name`, `target` and the fields of
        :class:`cembench.core.program.Program`.
    folder : Path
        Folder of the files that are named without a path.

    Raises
    ------
    RegistryError
        The declaration is invalid.
    """
    settings = dict(declared)
    command, name, target = (settings.pop(key, "") for key in ("command", "name", "target"))
    for key in ("input", "output"):  # a format may be called "obj" as well as ".obj"
        if key in settings and "." not in settings[key]:
            settings[key] = f".{settings[key]}"
    name = name or _program_name(command)
    source = command
    if command.endswith(".m") and (folder / command).is_file():
        function_file = of_matlab_function(folder / command)
        command = function_file.pop("command")
        settings = function_file | settings
    place = ("cembench.registry", None)
    about = {"target": target or "disk", "source": source, "notes": ""}
    function = _TAKES.get(target, _of_disks)
    return _program_of(function, place, name, name, about, command, folder, settings)


def maps_from(declared: Mapping[str, Any]) -> Algorithm:
    """Return the algorithm whose maps are files: `name`, `target`, and those of `MapFiles`."""
    settings = dict(declared)
    name, target = settings.pop("name"), settings.pop("target")
    about = {"target": target, "source": settings["folder"], "notes": ""}
    function = _of_disks if target == "disk" else _TAKES.get(target, _of_any)
    spec = _algorithm_of(function, ("cembench.registry", None), name, f"{name} (files)", about)
    return replace(spec, maps=MapFiles(**settings))


def _of_disks(mesh: DiskMesh) -> None:
    """Provide the signature of a program that maps disks."""


def _of_holes(mesh: HoledMesh) -> None:
    """Provide the signature of a program that maps surfaces with holes."""


def _of_any(mesh: TriangleMesh) -> None:
    """Provide the signature of a program that cuts and maps any surface."""


#: By target; other targets take disks.
_TAKES = {"circular holes": _of_holes, "disk with holes": _of_holes, "atlas": _of_any}


def _program_name(command: str) -> str:
    """Return a short name for a command: its program, or the script that an interpreter runs."""
    parts = [Path(word) for word in words_of(command)]
    script = next((word for word in parts[1:] if word.suffix in (".py", ".m", ".sh", ".js")), None)
    return (script or next(iter(parts), Path("program"))).stem or "program"


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
    """Return the algorithm that runs an external program."""
    known = [one.name for one in fields(Program) if one.name != "command"]
    unknown = [key for key in how if key not in known]
    if unknown:
        raise RegistryError(
            f"program {name!r}: {unknown[0]!r} is unknown; allowed: {', '.join(known)}."
        )
    settings = dict(how) | {"version": found_words(how.get("version", ""), folder)}
    program = Program(command=found_words(command, folder), **settings)
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
    """Return the algorithm that a function and its declaration make."""
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
    fitted: str = "",
    landmarks: Landmarks | None = None,
    kept: Callable[..., Path] | None = None,
    exact_map: ExactMap | None = None,
) -> Callable[[C], C]:
    """Declare a function ``(faces, *, seed, parameters) -> TriangleMesh`` as a surface family.

    `faces` is the requested number of triangles and has a default; `seed` is optional.

    Parameters
    ----------
    name : str
        Name on the command line.
    title : str
        Name in table headings.
    source : str
        Where the shape comes from.
    notes : str
        Remarks (default: the docstring after its first line).
    paper_row : str
        The model of a paper that the surface stands for, if any; the profiles consist
        of these surfaces.
    fitted : str
        The algorithm whose printed energy and angle errors on that model the default parameters
        were fitted to, if any; its figures here are marked, and decide nothing.
    landmarks : callable, optional
        Returns the named vertices, such as the tip of a nose, of a mesh of any size that the
        function made.
    kept : callable, optional
        Takes the same arguments and returns the path at which the made surface is cached; different
        surfaces have different paths.
    exact_map : callable, optional
        The conformal map to the unit disk, or to the unit disk with round holes, if it is known in
        closed form for the default parameters; unique up to a Moebius map.

    Returns
    -------
    callable
        A decorator that marks the function and returns it unchanged.

    Raises
    ------
    RegistryError
        Types or defaults are missing.

    Examples
    --------
    >>> import numpy as np
    >>> @surface_family("my-square", title="My square")
    ... def my_square(faces: int = 2) -> DiskMesh:
    ...     "A unit square in the plane z = 0."
    ...     V = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    ...     return DiskMesh(V, [[0, 1, 2], [0, 2, 3]])
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
            fitted=fitted,
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
    """Return the type hints of a function, and its keyword parameters."""
    if not name or "," in name or name != name.strip():
        raise RegistryError(
            f"the name {name!r} cannot be chosen: options separate names by commas, and drop "
            "spaces around them. Give another name."
        )
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
    """Return the object that holds the annotations of a callable."""
    if isinstance(function, functools.partial):
        return _annotated(function.func)
    if isinstance(function, type) or inspect.isroutine(function):
        return function
    call: Callable[..., Any] = type(function).__call__
    return call


def _place(frame: FrameType) -> tuple[str, Path | None]:
    """Return the module and file of a frame, that of the decorator's caller.

    The decorated function cannot be asked: an inner decorator may have replaced it by a function
    from another file.
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
    """Return the docstring of a function after its first line."""
    written = inspect.getdoc(_annotated(function)) or ""
    return written.partition("\n")[2].strip()


@dataclass(frozen=True)
class Registry:
    """The known algorithms, surfaces and datasets, by name."""

    algorithms: Mapping[str, Algorithm] = field(default_factory=dict)
    surfaces: Mapping[str, Surface] = field(default_factory=dict)
    datasets: Mapping[str, Dataset] = field(default_factory=dict)
    #: Third-party libraries and programs, which need not be installed: they run only if they are
    #: named.
    peers: Mapping[str, Algorithm] = field(default_factory=dict)
    #: Files of models, which can be fetched but are not surfaces themselves.
    parts: Mapping[str, Dataset] = field(default_factory=dict)

    @property
    def usual_algorithms(self) -> list[str]:
        """Return the names of the algorithms that are measured by default."""
        return [name for name, spec in self.algorithms.items() if spec.usual]

    def algorithm(self, name: str) -> Algorithm:
        """Return the algorithm of this name; :class:`RegistryError` lists the known ones."""
        return _look_up("algorithm", ChainMap(self.algorithms, self.peers), name)  # type: ignore[arg-type]  # never written

    def surface(self, name: str) -> Surface:
        """Return the surface of this name; :class:`RegistryError` lists the known ones."""
        if name in self.datasets and name not in self.surfaces:
            row = self.datasets[name].paper_row
            standing = [s.name for s in self.surfaces.values() if row and s.paper_row == row]
            raise RegistryError(
                f"{name!r} is a public surface, which is read from a file and not generated: "
                f"`cembench fetch {name}` fetches it, and `dataset` or `load_surface` reads it."
                + (f" Its stand-in is {standing[0]}." if standing else "")
            )
        return _look_up("surface", self.surfaces, name)

    def dataset(self, name: str) -> Dataset:
        """Return the dataset of this name; :class:`RegistryError` lists the known ones."""
        return _look_up("dataset", self.datasets, name)

    @property
    def groups(self) -> dict[str, list[Dataset]]:
        """Return the datasets and parts of models by group, in the order of their listing."""
        by_group: dict[str, list[Dataset]] = {}
        for dataset in (*self.datasets.values(), *self.parts.values()):
            if dataset.group:
                by_group.setdefault(dataset.group, []).append(dataset)
        return by_group

    def group(self, name: str) -> list[Dataset]:
        """Return the datasets of this group; :class:`RegistryError` lists the known groups."""
        if name not in self.groups:
            raise RegistryError(unknown("group of datasets", name, self.groups))
        return self.groups[name]


R = TypeVar("R", Algorithm, Surface, Dataset)

_DECORATORS: Mapping[type, str] = {Algorithm: "algorithm", Surface: "surface_family"}
_GROUPS: Mapping[type, str] = {
    Algorithm: "cembench.algorithms",
    Surface: "cembench.surfaces",
    Dataset: "cembench.datasets",
}
#: Entry points of algorithms that `cembench run` measures only if they are named.
PEERS = "cembench.peers"
#: Prefix of a plug-in that is a command line; its declaration follows as JSON.
COMMAND = "command:"
#: Prefix of a plug-in that is a folder of maps, likewise.
MAPS = "maps:"


def _look_up(kind: str, known: Mapping[str, R], name: str) -> R:
    if name not in known:
        raise RegistryError(unknown(kind, name, known))
    return known[name]


def load_registry(plugins: Iterable[str] = ()) -> Registry:
    """Collect the installed algorithms and surfaces, and those of the user's plug-ins.

    Parameters
    ----------
    plugins : iterable of str
        Each is the path of a Python file, or ``module:name``.

    Returns
    -------
    Registry
        Everything that was found, by name.

    Raises
    ------
    RegistryError
        A name is declared twice, or a plug-in cannot be imported or declares nothing.
    """
    installed = _installed()
    algorithms: ChainMap[str, Algorithm] = ChainMap({}, installed.algorithms)  # type: ignore[arg-type]  # only the first is written
    surfaces: ChainMap[str, Surface] = ChainMap({}, installed.surfaces)  # type: ignore[arg-type]  # as above
    for plugin in plugins:
        for spec in declared_by(plugin):
            _add(algorithms if isinstance(spec, Algorithm) else surfaces, spec)
    peers = installed.peers
    if shadowed := peers.keys() & algorithms.keys():
        peers = {name: peer for name, peer in peers.items() if name not in shadowed}
    return Registry(algorithms, surfaces, installed.datasets, peers, installed.parts)


@functools.lru_cache(maxsize=1)
def _installed() -> Registry:
    """Return the registry of all entry points, each loaded when it is first asked for."""
    installed = entry_points()  # once: it reads the files of every installed package
    datasets = functools.cache(functools.partial(_all_datasets, installed))
    algorithms, peers = (
        _Declared.by_name(installed, Algorithm, group) for group in (_GROUPS[Algorithm], PEERS)
    )
    families = _Declared.by_name(installed, Surface, _GROUPS[Surface])
    return Registry(
        algorithms,
        families,
        _Late(lambda: {name: one for name, one in datasets().items() if one.part is None}),
        peers,
        _Late(lambda: {name: one for name, one in datasets().items() if one.part is not None}),
    )


class _Declared(Mapping[str, R]):
    """What entry points of one kind declare, by name; an entry is loaded when it is asked for."""

    def __init__(self, entries: Mapping[str, EntryPoint], kind: type[R]) -> None:
        self._entries = entries
        self._kind: type[R] = kind
        self._loaded: dict[str, R] = {}

    @classmethod
    def by_name(cls, installed: Any, kind: type[R], group: str) -> _Declared[R]:
        """Return those of a group; :class:`RegistryError` if a name is declared twice."""
        entries: dict[str, EntryPoint] = {}
        for entry in _by_name(installed, group):
            if entry.name in entries:
                _add(
                    {entry.name: _declared_at(entries[entry.name], kind)}, _declared_at(entry, kind)
                )
            entries[entry.name] = entry
        return cls(entries, kind)

    def __getitem__(self, name: str) -> R:
        if name not in self._loaded:
            self._loaded[name] = _declared_at(self._entries[name], self._kind)
        return self._loaded[name]

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)


class _Late(Mapping[str, R]):
    """A mapping that is made when it is first read."""

    def __init__(self, make: Callable[[], Mapping[str, R]]) -> None:
        self._make: Callable[[], Mapping[str, R]] = make

    @functools.cached_property
    def _made(self) -> Mapping[str, R]:
        return self._make()

    def __getitem__(self, name: str) -> R:
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._made)

    def __len__(self) -> int:
        return len(self._made)


def _all_datasets(installed: Any) -> dict[str, Dataset]:
    """Return the datasets of all entry points; each holds one dataset or a tuple of them."""
    known: dict[str, Dataset] = {}
    for entry in _by_name(installed, _GROUPS[Dataset]):
        loaded = _load_entry(entry)
        several = isinstance(loaded, tuple) and all(isinstance(one, Dataset) for one in loaded)
        for dataset in loaded if several else (_declared_at(entry, Dataset),):
            _add(known, dataset)
    return known


def _by_name(installed: Any, group: str) -> list[EntryPoint]:
    """Return the entry points of a group; the type of what is installed changed in Python 3.12."""
    return sorted(installed.select(group=group), key=lambda entry: entry.name)


def load_algorithm(name: str, plugins: Iterable[str] = ()) -> Algorithm:
    """Return ``load_registry(plugins).algorithm(name)`` without importing other installed plug-ins.

    A process that measures one algorithm starts faster this way and needs less memory.
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
    """Return what an entry point declares; :class:`RegistryError` if it is something else."""
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
            f"entry point {entry.name} = {entry.value!r} of group {entry.group!r} is not the "
            f"{noun} of that name; {remedy}."
        )
    return spec


def _load_entry(entry: Any) -> Any:
    try:
        return entry.load()
    except Exception as error:
        raise RegistryError(
            f"entry point {entry.name} = {entry.value!r} cannot be loaded: "
            f"{describe_error(error)}. Repair or uninstall the package that declares it."
        ) from error


def _add(known: MutableMapping[str, Any], spec: _Registered | Dataset) -> None:
    if spec.name in known:
        raise RegistryError(
            f"the name {spec.name!r} is declared twice: by {known[spec.name].origin} and by "
            f"{spec.origin}. Rename one of them."
        )
    known[spec.name] = spec


def declared_by(plugin: str) -> list[_Registered]:
    """Return what a plug-in declares: a file, a ``module:name`` or a command line."""
    if plugin.startswith(COMMAND):
        declared = json.loads(plugin.removeprefix(COMMAND))
        return [program_from(declared, Path(declared.pop("folder", "")))]
    if plugin.startswith(MAPS):
        return [maps_from(json.loads(plugin.removeprefix(MAPS)))]
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
    # Only what the file itself declares, not what it imports.
    marks = [_mark_of(value) for value in specs]
    declared = [spec for spec in marks if spec and (name or spec.module == module.__name__)]
    if not declared:
        raise RegistryError(
            f"plug-in {plugin!r} declares nothing; decorate a function with @algorithm(...) or "
            "@surface_family(...) from cembench."
        )
    return declared


def _import_file(path: Path) -> ModuleType:
    """Import a Python file as a module."""
    if not path.is_file():
        raise RegistryError(f"plug-in {str(path)!r}: there is no such file.")
    _search_last(path.parent)
    name = f"cembench_plugin_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # so that annotations of its functions can be resolved
    try:
        with _importing(str(path)), _without_bytecode():
            spec.loader.exec_module(module)
    except RegistryError:
        sys.modules.pop(name, None)
        raise
    return module


def _import_module(module: str, plugin: str) -> ModuleType:
    _search_last(Path())
    with _importing(plugin):
        return importlib.import_module(module)


def _search_last(folder: Path) -> None:
    """Let plug-ins import from a folder what is installed nowhere."""
    if (place := str(folder.absolute())) not in sys.path:
        sys.path.append(place)


@contextmanager
def _importing(plugin: str) -> Iterator[None]:
    """Turn any import error into one kind of error, and send what is printed to standard error.

    An interrupt belongs to the user. A plug-in that raises one itself is caught where it is loaded
    first (:mod:`cembench.running.plugins`).
    """
    try:
        with _stdout_to_stderr():
            yield
    except KeyboardInterrupt:
        raise
    except RegistryError as error:  # a declaration in it is wrong
        raise RegistryError(f"plug-in {plugin!r}: {error}") from error
    except BaseException as error:
        what = f"plug-in {plugin!r} cannot be imported: {describe_error(error).removesuffix('.')}"
        ends = ": importing a plug-in must only declare functions"
        rule = "" if isinstance(error, Exception) else ends
        raise RegistryError(f"{what}. Repair it{rule}.") from error


@contextmanager
def _without_bytecode() -> Iterator[None]:
    """Leave no ``__pycache__`` in the folder of a plug-in's file: it is the user's."""
    before = sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = before


@contextmanager
def _stdout_to_stderr() -> Iterator[None]:
    """Redirect standard output to standard error, including output from C code."""
    with ExitStack() as back:
        with suppress(AttributeError, OSError, ValueError):  # it may be missing or closed
            sys.stdout.flush()
            stdout = os.dup(1)
            back.callback(os.close, stdout)
            back.callback(os.dup2, stdout, 1)
            os.dup2(2, 1)
        with redirect_stdout(sys.stderr):
            yield


def _mark_of(value: Any) -> _Registered | None:
    """Return the mark of a plug-in's object, whose attribute access may do anything."""
    try:
        mark = getattr(value, _MARK, None)
    except Exception:
        return None
    return mark if isinstance(mark, _Registered) else None
