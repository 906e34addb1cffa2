"""Describe a machine of your own: `exograv rig new` reads its URDF and writes a folder with the open questions.

The URDF here is that of a machine that comes with exograv, so that the answers are known.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import exograv

known = exograv.load_rig("recupera_like")
with tempfile.TemporaryDirectory() as folder:
    urdf = Path(folder) / "my_machine.urdf"
    shutil.copy(known.urdf_path, urdf)
    command = [sys.executable, "-m", "exograv.cli", "rig", "new", str(urdf), "--side", known.side]
    subprocess.run(command, check=True, cwd=folder, capture_output=True)
    written = next(Path(folder).rglob("rig.toml"))
    print(f"Written: {written.relative_to(folder)}")
    try:
        exograv.load_rig(str(written.parent))
    except exograv.ExogravError as error:
        print(f"Not complete yet: {error}")

    shutil.copy(known.folder / "rig.toml", written)  # in place of answering the questions in an editor
    settings = written.read_text().replace('name = "recupera_like"', f'name = "{written.parent.name}"')
    written.write_text(settings.replace(known.urdf_path.name, urdf.name))
    if not (written.parent / urdf.name).exists():
        shutil.copy(urdf, written.parent)
    mine = exograv.load_rig(str(written.parent), known.side)
    compensator = exograv.Compensator(mine, exograv.Person(height_m=1.75, mass_kg=70.0, sex="female"))
    print(f"{mine.name}: torque at the donning posture {compensator.torque(mine.donning_posture).round(2)} N·m")
