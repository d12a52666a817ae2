"""The registered algorithms and surfaces, by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from cembench.api.settings import registry_with
from cembench.core.arguments import checked
from cembench.core.errors import ParameterError
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.registry import Algorithm, Surface
    from cembench.report.surface_facts import SurfaceFacts


@dataclass(frozen=True)
class Catalogue:
    """The algorithms and surfaces that are registered.

    Parameters
    ----------
    algorithms : tuple of Algorithm, optional
        The algorithms; None if only surfaces were asked for.
    surfaces : tuple of Surface, optional
        The surface families; None if only algorithms were asked for.
    peers : tuple of str
        Names of libraries and programs by others.
    facts : mapping of SurfaceFacts
        Of the stand-ins for the paper's models, by name: their counts and how unevenly CEM scales
        them; None for one that is not measured yet. Empty unless only surfaces were asked for.

    Examples
    --------
    >>> import cembench
    >>> sorted(cembench.catalogue("algorithms").as_dict())
    ['algorithms']
    """

    algorithms: tuple[Algorithm, ...] | None
    surfaces: tuple[Surface, ...] | None
    peers: tuple[str, ...]
    facts: Mapping[str, SurfaceFacts | None]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data, as ``cembench list --json`` prints it.

        Returns
        -------
        dict
            Algorithms and surfaces, each as a list with a dictionary for each.
        """
        listed: dict[str, Any] = {}
        if self.algorithms is not None:
            listed["algorithms"] = [
                _about(a, target=a.target, takes=a.mesh_type.__name__)
                | {"usual": a.usual, "conformal": a.conformal}
                for a in self.algorithms
            ]
        if self.surfaces is not None:
            listed["surfaces"] = [
                _about(s, paper_row=s.paper_row or None, landmarks=s.landmarks is not None)
                | {"facts": _plain(self.facts.get(s.name))}
                for s in self.surfaces
            ]
        return listed


def _about(registered: Algorithm | Surface, **more: Any) -> dict[str, Any]:
    parameters = {p.name: p.default for p in registered.parameters}
    texts = {name: getattr(registered, name) for name in ("name", "title", "source")}
    notes = {"notes": registered.notes, "origin": registered.origin}
    return {**texts, "parameters": parameters, **notes, **more}


def _plain(facts: SurfaceFacts | None) -> dict[str, Any] | None:
    from cembench.report.surface_facts import row_check

    if facts is None:
        return None
    own = facts.model_dump(exclude={"mesh"})
    return facts.mesh.model_dump() | own | {"table2": row_check(facts.mesh)}


@checked
def catalogue(
    kind: Literal["algorithms", "surfaces"] | None = None,
    *,
    target: Literal["disk", "free boundary", "circular holes", "atlas"] | None = None,
    measure: bool = False,
    plugins: Sequence[str] = (),
    reporter: Reporter = SILENT,
) -> Catalogue:
    """List the algorithms and surfaces.

    Of surfaces alone, the stand-ins for the paper's models are also described: their counts,
    whether these match the printed ones, how unevenly CEM scales them, and where their thumbnails
    are. Only stand-ins that were measured are described; `measure` measures the others.

    Parameters
    ----------
    kind : {"algorithms", "surfaces"}, optional
        List only these.
    target : {"disk", "free boundary", "circular holes", "atlas"}, optional
        List only algorithms, and of these those that map there.
    measure : bool
        Measure the stand-ins not yet measured (takes minutes).
    plugins : sequence of str
        Python files or ``module:name`` with more algorithms.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Catalogue
        What is registered.

    Raises
    ------
    ParameterError
        `measure` is given, and `kind` is not "surfaces".
    RegistryError
        A plug-in cannot be loaded.

    Examples
    --------
    >>> import cembench
    >>> "cem" in [algorithm.name for algorithm in cembench.catalogue().algorithms]
    True
    """
    if measure and kind != "surfaces":
        raise ParameterError("`measure` is only for surfaces: leave it out, or list surfaces only.")
    if target and kind == "surfaces":
        raise ParameterError(
            "`target` is only for algorithms: leave it out, or list algorithms only."
        )
    kind = "algorithms" if target else kind
    registry = registry_with(plugins, reporter)
    facts: dict[str, SurfaceFacts | None] = {}
    if kind == "surfaces":
        from cembench.report.surface_facts import find_facts, kept_facts

        families = [family for family in registry.surfaces.values() if family.kept]
        facts = {family.name: kept_facts(registry, family) for family in families}
        todo = [family for family in families if measure and facts[family.name] is None]
        for k, family in enumerate(todo, start=1):
            with reporter.busy(f"[{k}/{len(todo)}] {family.name}: making, mapping, drawing"):
                facts[family.name] = find_facts(registry, family)
            reporter.info(f"[{k}/{len(todo)}] {family.name}")
    algorithms = tuple(a for a in registry.algorithms.values() if target in (None, a.target))
    return Catalogue(
        None if kind == "surfaces" else algorithms,
        None if kind == "algorithms" else tuple(registry.surfaces.values()),
        *(tuple(registry.peers), facts),
    )


def list_algorithms(plugins: Iterable[str] = ()) -> list[Algorithm]:
    """Return the registered algorithms, with their target, parameters and source.

    Parameters
    ----------
    plugins : iterable of str
        Python files or ``module:name`` with more algorithms.

    Returns
    -------
    list of Algorithm
        The algorithms, sorted by name.

    Examples
    --------
    >>> import cembench
    >>> "cem" in [algorithm.name for algorithm in cembench.list_algorithms()]
    True
    """
    from cembench.registry import load_registry

    return list(load_registry(plugins).algorithms.values())


def list_surfaces(plugins: Iterable[str] = ()) -> list[Surface]:
    """Return the registered surface families.

    Parameters
    ----------
    plugins : iterable of str
        Python files or ``module:name`` with more families.

    Returns
    -------
    list of Surface
        The surface families, sorted by name.

    Examples
    --------
    >>> import cembench
    >>> "spherical-cap" in [family.name for family in cembench.list_surfaces()]
    True
    """
    from cembench.registry import load_registry

    return list(load_registry(plugins).surfaces.values())


def surface(name: str, faces: int | None = None, **parameters: Any) -> TriangleMesh:
    """Return a mesh from a registered surface family.

    The decorator :func:`cembench.surface_family` declares new families.

    Parameters
    ----------
    name : str
        A name from :func:`list_surfaces`.
    faces : int, optional
        Approximate number of triangles; default: the family's own size.
    **parameters
        Parameters of the family, such as `seed`.

    Returns
    -------
    DiskMesh or HoledMesh
        The surface.

    Raises
    ------
    RegistryError
        The name is unknown; the message lists the known ones.
    ParameterError
        A parameter is unknown, or its value is out of range.

    Examples
    --------
    >>> import cembench
    >>> cembench.surface("flat-disk", 200).name
    'flat-disk'
    """
    from cembench.registry import load_registry

    family = load_registry().surface(name)
    arguments = parameters if faces is None else {"faces": faces, **parameters}
    mesh: TriangleMesh = family.function(**family.arguments(arguments))
    return mesh
