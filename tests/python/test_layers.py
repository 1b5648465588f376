"""The order of the modules: who may include whom, and which libraries stay behind which door (docs/decisions)."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# module: what it may include besides itself and core. Nothing of the library includes sim, the independent witness of the tests.
DIRECT = {
    "core": [],
    "fft": ["core"],
    "geometry": ["core"],
    "signal": ["fft"],
    "quality": ["signal", "fft"],
    "detect": ["core"],
    "sim": ["signal", "geometry", "core"],
    "focus": ["signal", "geometry", "fft"],
    "autofocus": ["focus", "detect", "quality"],
    "hrws": ["autofocus", "focus"],
}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
FOREIGN = re.compile(r"\b(Eigen::|fftwf?_\w+|pybind11|PyObject)")


def allowed(module: str) -> set[str]:
    """Give the modules that `module` may include: itself and, through any number of steps, everything to its right."""
    return {module}.union(*(allowed(below) for below in DIRECT[module]))


def text_of(path: Path) -> str:
    return COMMENT.sub("", path.read_text(encoding="utf-8"))


def includes(path: Path) -> Iterator[tuple[str, str]]:
    for match in INCLUDE.finditer(text_of(path)):
        yield match[1], match[2]


def cpp_files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in {".hpp", ".cpp", ".inl"})


def is_test(path: Path) -> bool:
    return path.stem.endswith("_test")


def library_violations(root: Path) -> list[str]:
    """Includes of the library that go against the order, and foreign types in public headers."""
    out = []
    for top in (root / "cpp/include/sarfocus", root / "cpp/src"):
        for path in cpp_files(top):
            module = path.relative_to(top).parts[0]
            name = path.relative_to(root)
            if module not in DIRECT:
                out.append(f"{name}: {module} is not a module of the table")
                continue
            permitted = allowed(module) | ({"sim"} if is_test(path) else set())
            for _, target in includes(path):
                parts = target.removeprefix("sarfocus/").split("/")
                if parts[0] in DIRECT and len(parts) > 1 and parts[0] not in permitted:
                    out.append(f"{name}: {module} must not include {target}")
                private = not target.startswith("sarfocus/") and parts[0] in DIRECT and len(parts) > 1
                if private and parts[0] != module:
                    out.append(f"{name}: {target} is private to {parts[0]}")
    return out


def header_violations(root: Path) -> list[str]:
    """Public headers that show Eigen, FFTW or Python, or include anything but the standard library and one another."""
    out = []
    for path in cpp_files(root / "cpp/include"):
        name = path.relative_to(root)
        out += [f"{name}: shows {found}" for found in sorted(set(FOREIGN.findall(text_of(path))))]
        for bracket, target in includes(path):
            standard = "/" not in target and not target.endswith(".h")
            if bracket != "<" or not (standard or target.startswith("sarfocus/")):
                out.append(f"{name}: includes {target}")
    return out


def binding_violations(root: Path) -> list[str]:
    """Bindings that include something of the library other than its public headers."""
    out = []
    for path in cpp_files(root / "python/bindings"):
        for bracket, target in includes(path):
            if bracket == '"' and not (path.parent / target).is_file():
                out.append(f"{path.relative_to(root)}: {target} is not a public header")
    return out


def driver_violations(root: Path) -> list[str]:
    """Driver modules that reach compiled code other than through sarfocus._core and its public names."""
    out = []
    for path in sorted((root / "python/sarfocus").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                sources, names = [alias.name for alias in node.names], []
            elif isinstance(node, ast.ImportFrom):
                sources, names = [node.module or ""], [alias.name for alias in node.names]
            else:
                continue
            compiled = [s for s in sources if "_core" in s.split(".")]
            private = [n for n in names if compiled and n.startswith("_") and not n.endswith("__")]
            foreign = [s for s in sources if s.split(".")[0] in {"ctypes", "cffi", "numba"}]
            out += [f"{path.relative_to(root)}: imports {name}" for name in private + foreign]
    return out


def shared_names(root: Path) -> dict[str, list[str]]:
    """Types that several headers define under one full name: the linker keeps one of them, silently, for all."""
    found: dict[str, set[str]] = {}
    for path in cpp_files(root / "cpp"):
        spaces: list[str] = []
        depth = 0
        for line in text_of(path).split("\n") if path.suffix == ".hpp" else []:
            if opened := re.match(r"namespace ([\w:]+) \{", line):
                spaces.append(opened[1])
                continue
            if spaces and depth == 0 and (defined := re.match(r"(?:struct|class|enum class) (?:SARFOCUS_API )?(\w+)[^;]*\{", line)):
                found.setdefault("::".join([*spaces, defined[1]]), set()).add(path.relative_to(root).as_posix())
            if depth == 0 and line.startswith("}") and spaces:
                spaces.pop()
                continue
            depth += line.count("{") - line.count("}")
    return {name: sorted(paths) for name, paths in found.items() if len(paths) > 1}


def test_no_two_headers_define_one_type() -> None:
    assert shared_names(ROOT) == {}


def test_types_of_one_name_are_found(tmp_path: Path) -> None:
    for name in ("one", "two"):
        header = tmp_path / f"cpp/src/{name}.hpp"
        header.parent.mkdir(parents=True, exist_ok=True)
        inner = f"class {name.title()} {{\n    struct Inner {{}};\n}};"
        header.write_text(f"namespace a::b {{\n\nstruct Place {{\n    int {name};\n}};\n\n{inner}\n\n}}  // namespace a::b\n")
    assert shared_names(tmp_path) == {"a::b::Place": ["cpp/src/one.hpp", "cpp/src/two.hpp"]}


def test_modules_include_only_what_is_right_of_them() -> None:
    assert library_violations(ROOT) == []


def test_public_headers_show_no_foreign_type() -> None:
    assert header_violations(ROOT) == []


def test_bindings_use_public_headers_only() -> None:
    assert binding_violations(ROOT) == []


def test_driver_reaches_compiled_code_through_the_bindings() -> None:
    assert driver_violations(ROOT) == []


def test_fftw_is_known_to_one_source_file() -> None:
    users = [p.relative_to(ROOT).as_posix() for p in cpp_files(ROOT / "cpp") if any(target == "fftw3.h" for _, target in includes(p))]
    assert users == ["cpp/src/fft/plan.cpp"]


def test_the_build_lists_the_modules_of_the_table_in_their_order() -> None:
    built = re.search(r"foreach\(module ([^)]*)\)", (ROOT / "cpp/CMakeLists.txt").read_text(encoding="utf-8"))
    assert built is not None
    order = built[1].split()
    assert set(order) <= set(DIRECT)
    for position, module in enumerate(order):
        assert allowed(module) <= set(order[: position + 1]), module


@pytest.mark.parametrize(
    ("path", "content", "check"),
    [
        ("cpp/src/sim/points.cpp", "#include <sarfocus/focus/azimuth.hpp>", library_violations),
        ("cpp/src/focus/azimuth.cpp", "# include <sarfocus/sim/points.hpp>", library_violations),
        ("cpp/include/sarfocus/core/error.hpp", "#include <sarfocus/fft/plan.hpp>", library_violations),
        ("cpp/src/autofocus/pga.cpp", '#include "focus/kernel.hpp"', library_violations),
        ("cpp/src/misc/pga.cpp", "", library_violations),
        ("cpp/include/sarfocus/core/solve.hpp", "void solve(const Eigen::MatrixXd& a);", header_violations),
        ("cpp/include/sarfocus/fft/plan.hpp", "#include <fftw3.h>", header_violations),
        ("cpp/include/sarfocus/fft/plan.hpp", '#include "detail.hpp"', header_violations),
        ("python/bindings/bind_focus.cpp", '#include "focus/kernel.hpp"', binding_violations),
        ("python/sarfocus/focus.py", "from ._core.focus import _kernel", driver_violations),
        ("python/sarfocus/focus.py", "import ctypes", driver_violations),
    ],
)
def test_a_violation_is_found(tmp_path: Path, path: str, content: str, check: object) -> None:
    target = tmp_path / path
    target.parent.mkdir(parents=True)
    target.write_text(content + "\n", encoding="utf-8")
    assert callable(check)
    assert len(check(tmp_path)) == 1


@pytest.mark.parametrize(
    ("path", "content"),
    [
        ("cpp/src/hrws/si_mec.cpp", "#include <sarfocus/fft/plan.hpp>\n#include <Eigen/Dense>"),
        ("cpp/src/focus/azimuth_test.cpp", "#include <sarfocus/sim/points.hpp>"),
        ("cpp/include/sarfocus/fft/plan.hpp", "// fftw_plan hides in the source file\n#include <vector>"),
    ],
)
def test_what_is_allowed_passes(tmp_path: Path, path: str, content: str) -> None:
    target = tmp_path / path
    target.parent.mkdir(parents=True)
    target.write_text(content + "\n", encoding="utf-8")
    assert library_violations(tmp_path) + header_violations(tmp_path) == []
