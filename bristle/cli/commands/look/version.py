"""`bristle version`: which version this is, and what it runs on."""

from __future__ import annotations


def command() -> None:
    """Print the version; with --verbose also what it runs on, for a report of a defect.

    Example: bristle version --verbose
    """
    import platform
    from importlib.metadata import PackageNotFoundError, version

    import bristle
    from bristle.cli.output.manner import answer, manner, say

    def known(package: str) -> str:
        try:
            return version(package)
        except PackageNotFoundError:
            return "not installed"

    below = {"python": platform.python_version(), "system": platform.platform()}
    below |= {name: known(name) for name in ("numpy", "scipy", "casadi", "h5py", "numba", "bokeh", "pymodbus")}
    answer({"bristle": bristle.__version__} | below)
    say(f"bristle {bristle.__version__}")
    if manner().verbose:
        say(*(f"{name} {value}" for name, value in below.items()))
