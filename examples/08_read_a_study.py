"""Read the tables of a study. `exograv study example` makes one with simulated participants."""

import subprocess
import sys
import tempfile

import exograv

with tempfile.TemporaryDirectory() as folder:
    command = [sys.executable, "-m", "exograv.cli", "study", "example", "--participants", "1,1", "--sessions", "1,0"]
    subprocess.run([*command, "--out", f"{folder}/study"], check=True, capture_output=True)
    study = exograv.Study(f"{folder}/study")
    print(f"{study.name}, simulated: {study.is_simulated}, tables: {', '.join(study.tables)}")
    touches = study.table("touches")
    print(touches.groupby(["participant", "protocol"])["deviation_px"].describe()[["count", "50%"]].round(1))
    print("Meaning of x_px:", study.columns("touches")["x_px"])
