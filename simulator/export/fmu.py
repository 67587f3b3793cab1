"""A valve model as a functional mock-up unit: FMI 2.0 for co-simulation, of the C source of this folder.

No library carries this: pythonfmu and pythonfmu3 make units that need Python where they run, and CasADi makes units
for model exchange, which leave the stiff friction to the solver of whoever imports them. The headers of the standard
are those that FMPy ships.
"""

from __future__ import annotations

import hashlib
import platform
import tempfile
import zipfile
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from recordings import BadInput, appearing, not_installed
from simulator.compile.c_compiler import BuildFailed, build, compiler
from simulator.export.c_source import c_source, environment
from simulator.export.step_parts import ExportedStep
from simulator.simulation import FINE_STEP

NAME = "valve"
"""What the unit is called inside: the prefix of its C names and the name of its library."""
HEADERS = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")
PLATFORMS = {("Linux", "x86_64"): "linux64", ("Darwin", "x86_64"): "darwin64"}
"""Folders that FMI 2.0 has a name for, where this code can compile; others run the unit from its sources."""
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fvisibility=hidden")
DATE = (1980, 1, 1, 0, 0, 0)
"""The date of every file in the archive, so that the same model gives the same unit."""


def write_fmu(step: ExportedStep, path: Path, *, longest_step: float = FINE_STEP) -> Path:
    """Write a unit with its sources and its library for this machine. Its force is held during a communication step.

    Raises BadInput without FMPy, without a C compiler, and when the file cannot be written.
    """
    headers = _headers(path)
    made = c_source(step, NAME, hold=True, longest_step=longest_step, title=path.stem)
    sources = {f"{NAME}.h": made.header, f"{NAME}.c": made.source, **headers}
    sources["fmu.c"] = environment().get_template("fmu.c").render(step=step, name=NAME, NAME=NAME.upper())
    token = hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:32]
    sources["token.h"] = f'#define TOKEN "{token}"\n'
    files: dict[str, bytes | str] = {f"sources/{name}": text for name, text in sources.items()}
    files["modelDescription.xml"] = environment().get_template("modelDescription.xml").render(
        step=step, name=NAME, title=path.stem, token=token, maker=_maker(), longest_step=longest_step
    )  # fmt: skip
    folder = PLATFORMS.get((platform.system(), platform.machine()))
    if folder:
        files[f"binaries/{folder}/{NAME}.so"] = _compiled(sources, path)
    with appearing(path) as draft, zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, DATE), content, zipfile.ZIP_DEFLATED)
    return path


def _headers(path: Path) -> dict[str, str]:
    """The headers of the standard, by name."""
    found = find_spec("fmpy")
    if found is None or found.origin is None:
        raise not_installed(str(path), "a functional mock-up unit", "FMPy", "fmu", "export C source")
    folder = Path(found.origin).parent / "c-code"
    return {name: (folder / name).read_text(encoding="utf-8", errors="replace") for name in HEADERS}


def _compiled(sources: Mapping[str, str], path: Path) -> bytes:
    """The shared library of some sources."""
    command = compiler()
    if command is None:
        remedy = "install gcc or clang, or export C source and compile it elsewhere"
        raise BadInput(str(path), "there is no C compiler for the library in the unit", remedy)
    with tempfile.TemporaryDirectory(prefix="bristle-") as folder:
        for name, text in sources.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        library = Path(folder, "library")
        try:
            build((*command, *FLAGS), library, [str(Path(folder, name)) for name in (f"{NAME}.c", "fmu.c")])
        except BuildFailed as error:
            raise BadInput(str(path), str(error), "check CC") from error
        return library.read_bytes()


def _maker() -> str:
    try:
        return f"Bristle {version('bristle')}"
    except PackageNotFoundError:
        return "Bristle"
