"""Declarations of external programs and libraries that run as algorithms."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cembench.core.errors import RegistryError

#: Formats of the mesh that a program reads, and of the UVs that it writes.
INPUTS = (".obj", ".off", ".ply", ".mat", ".npz")
OUTPUTS = (".obj", ".off", ".ply", ".mat", ".npz", ".txt")
#: Placeholders that a command may use besides its parameters.
PLACES = ("input", "output", "folder", "threads")
_PLACEHOLDER = re.compile(r"\{([A-Za-z_]\w*)\}")
#: Names that a pattern's group may have, and the seconds in one unit of each.
UNITS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


@dataclass(frozen=True)
class Library:
    """A third-party library that an algorithm calls in its own process."""

    #: Name of the module that is imported.
    module: str
    #: Name of the distribution, for its version.
    package: str
    #: As :attr:`Program.circle`, for a library that computes in single precision.
    circle: float = 1e-9


@dataclass(frozen=True)
class MapFiles:
    """Files with maps that somebody made, one a surface; they have no seconds."""

    #: The folder, as it was named.
    folder: str
    #: The file of each surface, by the hash of its mesh.
    files: Mapping[str, str]
    #: As :attr:`Program.circle`, for files that hold few digits.
    circle: float = 1e-5


@dataclass(frozen=True)
class Program:
    """A program that maps a mesh file to a file with UVs.

    Parameters
    ----------
    command : tuple of str
        The command's words. ``{input}``, ``{output}``, ``{folder}``, ``{threads}`` and parameter
        names in braces are filled in. No shell is involved.
    input : str
        Format of the mesh file, e.g. ".obj".
    output : str
        Format of the file with UVs, e.g. ".obj"; or its file name, if the program chooses it.
    seconds : str
        A regular expression that finds the program's own solve time in its output; the last match
        counts. Its group holds seconds, or is named ``ms`` or ``us``. Empty: none is printed.
    version : tuple of str
        A command whose first line of output is the program's version. Empty: unknown.
    circle : float
        Allowed distance of a disk's boundary from the unit circle, for a program that writes few
        digits. The default is that of built-in algorithms, 1e-9.
    fit : bool
        Whether to first shift and scale the image until its outer boundary lies on the unit circle,
        for programs that place the disk in the unit square.
    flat : bool
        Whether the file holds the flattened surface; its x and y are then the UVs.
    remedy : str
        How to install the program.
    language : str
        "matlab" if words are code of MATLAB or Octave, in which each placeholder becomes a string.
    """

    command: tuple[str, ...]
    input: str = ".obj"
    output: str = ".obj"
    seconds: str = ""
    version: tuple[str, ...] = ()
    circle: float = 1e-9
    fit: bool = False
    flat: bool = False
    remedy: str = ""
    language: str = ""

    @property
    def output_format(self) -> str:
        """The suffix of the output file."""
        return Path(self.output_name).suffix.lower()

    @property
    def output_name(self) -> str:
        """The name of the output file."""
        return self.output if self.names_its_file else f"uv{self.output}"

    @property
    def names_its_file(self) -> bool:
        """Whether the program itself chooses the name of its output file."""
        return re.fullmatch(r"\.\w+", self.output) is None

    def words(self, values: Mapping[str, object]) -> list[str]:
        """Return the command with its placeholders filled in."""
        written = matlab_string if self.language == "matlab" else str
        return [_PLACEHOLDER.sub(lambda m: written(values[m[1]]), word) for word in self.command]

    def __str__(self) -> str:
        """Return the command with file names instead of full paths."""
        shown = (Path(w).name if Path(w).is_absolute() else w for w in self.command)
        return " ".join(w if _PLACEHOLDER.fullmatch(w) else shlex.quote(w) for w in shown)


def checked_program(name: str, program: Program, parameters: Iterable[str]) -> Program:
    """Return a program's declaration after checking it.

    Raises
    ------
    RegistryError
        The command is empty, does not name the mesh file or has an unknown placeholder; a format is
        unknown; or the pattern is not a valid regular expression.
    """
    allowed = (*PLACES, *parameters)
    used = [m for word in program.command for m in _PLACEHOLDER.findall(word)]
    unknown = [one for one in used if one not in allowed]
    wrong = ""
    if not program.command:
        wrong = "its command is empty"
    elif unknown:
        named = ", ".join(f"{{{one}}}" for one in allowed)
        wrong = f"its command names {{{unknown[0]}}}; allowed: {named}"
    elif not {"input", "folder"} & set(used):
        wrong = "its command does not say where the mesh file goes; write {input} there"
    elif not program.names_its_file and not {"output", "folder"} & set(used):
        wrong = (
            "its command does not say where the UVs go; write {output} there, or set "
            "`output` to the name of the file that it writes"
        )
    elif program.input not in INPUTS:
        wrong = f"input {program.input!r} is unknown; allowed: {', '.join(INPUTS)}"
    elif program.output_format not in OUTPUTS:
        wrong = f"output {program.output!r} is unknown; allowed: {', '.join(OUTPUTS)}"
    elif Path(program.output).name != program.output:
        wrong = f"output {program.output!r} is a path; name a file of the program's folder"
    elif not 0 < program.circle <= 1e-3:
        wrong = f"circle={program.circle:g} is not allowed; it is above 0 and at most 0.001"
    wrong = wrong or _wrong_pattern(program.seconds)
    if wrong:
        raise RegistryError(f"program {name!r}: {wrong}.")
    return program


def _wrong_pattern(pattern: str) -> str:
    """Return what is wrong with the pattern of a solve time; empty if nothing is."""
    try:
        groups = re.compile(pattern)
    except re.error as error:
        return f"seconds={pattern!r} is not a regular expression ({error})"
    named = set(groups.groupindex)
    if (pattern and groups.groups != 1) or not named <= set(UNITS):
        return (
            f"seconds={pattern!r} must have one group, for the number; it may be called "
            f"{', '.join(UNITS)}"
        )
    return ""


def matlab_string(value: object) -> str:
    """Return a string in the code of MATLAB and Octave, whatever it holds; no escapes, no braces.

    Examples
    --------
    >>> print(matlab_string("it's {here}"))
    ['it''s ' char(123) 'here}']
    """
    literal = str(value).replace("'", "''").replace("{", "' char(123) '")
    return f"['{literal}']"


def of_matlab_function(file: Path) -> dict[str, str]:
    """Return the declaration of a MATLAB function ``uv = f(V, F)`` in a file, F counted from 1.

    Octave runs it, or MATLAB if Octave is missing. The solve time is that of the function alone.

    Raises
    ------
    RegistryError
        The file's name cannot be that of a function, or its folder has a path that cannot be
        written in code.
    """
    folder = str(file.parent.absolute())
    if not re.fullmatch(r"[A-Za-z]\w*", file.stem, re.ASCII) or not folder.isprintable():
        raise RegistryError(
            f"{str(file)!r} cannot be called as a function: its name must be a letter and then "
            "letters, digits and underscores, and its folder's name without line breaks. Rename it."
        )
    octave = next((name for name in ("octave-cli", "octave") if shutil.which(name)), "")
    code = (
        f"addpath({matlab_string(folder)}); mesh = load({{input}}); started = tic; "
        f"uv = {file.stem}(double(mesh.v), double(mesh.f)); "
        "fprintf('solve: %.9f s\\n', toc(started)); save('-v7', {output}, 'uv');"
    )
    command = [octave, "--norc", "--quiet", "--eval", code]
    if not octave:
        command = ["matlab" if shutil.which("matlab") else "octave-cli", "-batch", code]
    return {
        "command": shlex.join(command),
        "input": ".mat",
        "output": ".mat",
        "language": "matlab",
        "seconds": r"^solve: (\S+) s$",
        "version": f"{command[0]} --version" if octave else "",
        "remedy": "Install Octave (in Debian: apt-get install octave-cli), or MATLAB",
    }


def words_of(command: str) -> list[str]:
    """Split a command into words.

    Raises
    ------
    RegistryError
        A quotation mark is not closed.
    """
    try:
        return shlex.split(command)
    except ValueError as error:
        raise RegistryError(f"the command {command!r} cannot be split: {error}.") from None


def found_words(command: str, folder: Path) -> tuple[str, ...]:
    """Split a command into words and make files of `folder` absolute paths.

    A program runs in a folder of its own, where relative paths would not resolve. Raises as
    :func:`words_of`.
    """
    return tuple(_absolute(word, folder) for word in words_of(command))


def _absolute(word: str, folder: Path) -> str:
    """Return a word as an absolute path if it names a file in this folder."""
    try:
        is_file = not _PLACEHOLDER.search(word) and (folder / word).is_file()
    except (OSError, ValueError):
        return word
    return str((folder / word).absolute()) if is_file else word
