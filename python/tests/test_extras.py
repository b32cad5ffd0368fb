"""Adapters without the packages that they need."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("module", "package", "extra"),
    [("vot", "trax", "vot"), ("cvat_propagation", "cvat_sdk", "cvat"), ("labelme", "PIL", "labelme")],
)
def test_a_command_without_its_package_names_the_extra(module: str, package: str, extra: str) -> None:
    code = f"import sys\nsys.modules['{package}'] = None\nimport bagtrack.adapters.{module}"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    told = f"ImportError: {package} is not installed: pip install 'bagtrack[{extra}]'\n"
    assert run.returncode == 1 and run.stderr.endswith(told), run.stderr
