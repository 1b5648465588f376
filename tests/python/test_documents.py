"""The Python of the README and the tutorials runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs/tutorials").glob("*.md"))]
MEASURED = {"bwsi_rail": ("bwsi/rail_team6_trial6.npz", "bwsi/walk_sculpture_trial3.npz")}  # what a page works on, beside it
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)#]+)[^)]*\)")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.stem)
def test_its_python_runs(document: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """All blocks of a page in order, in one namespace, where they may write files."""
    for name in MEASURED.get(document.stem, ()):
        recording = request.getfixturevalue("data_directory") / name
        if not recording.exists():
            pytest.skip(f"no {recording.name} in {recording.parent}")
        (tmp_path / recording.name).symlink_to(recording)
    monkeypatch.chdir(tmp_path)
    text = document.read_text(encoding="utf-8")
    blocks = list(BLOCK.finditer(text))
    assert blocks
    namespace: dict[str, object] = {"__name__": "__main__"}
    for block in blocks:
        lines_before = text.count("\n", 0, block.start(1))
        exec(compile("\n" * lines_before + block[1], str(document), "exec"), namespace)


@pytest.mark.parametrize("document", sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]), ids=lambda path: path.stem)
def test_its_links_lead_somewhere(document: Path) -> None:
    targets = [target for target in LINK.findall(document.read_text(encoding="utf-8")) if "://" not in target]
    missing = [target for target in targets if not (document.parent / target).exists()]
    assert missing == []
