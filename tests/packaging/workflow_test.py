#!/usr/bin/env python3
"""Runs the shell lines of docker/github/bake.yaml on a scene of ours: workflow_test.py ROOT KILN

They must end well where the light is as good as MAX_ERROR, and with exit code 8 where it is not. The step that downloads
the package is left out: fresh_debian.sh installs one.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

import yaml

TARGET_NOT_MET = 8


def run_steps(document, folder, environment):
    """The exit code of the first step that fails, or 0; and the name of it."""
    for step in document["jobs"]["bake"]["steps"]:
        if "run" not in step or "apt-get" in step["run"]:
            continue
        shell = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]  # as GitHub runs them
        done = subprocess.run(shell, cwd=folder, env=environment, capture_output=True, text=True)
        print(done.stdout[-300:])
        if done.returncode != 0:
            return done.returncode, step["name"], done.stderr
    return 0, "", ""


def main():
    root, kiln = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    document = yaml.safe_load((root / "docker" / "github" / "bake.yaml").read_text())
    with tempfile.TemporaryDirectory() as folder:
        path = {"PATH": f"{kiln.parent}:{os.environ['PATH']}", "HOME": folder}
        environment = document["env"] | path | {"SCENE": "column.glb", "RECIPE": "recipe.json"}
        subprocess.run([kiln, "demo-scene", "column", "-o", "column.glb"], cwd=folder, check=True)
        (pathlib.Path(folder) / "recipe.json").write_text('{"steps": [{"do": "prt", "order": 6}], "quality": "draft"}')
        code, name, text = run_steps(document, folder, environment)
        assert code == 0, f"{name}: {code}: {text}"
        code, name, text = run_steps(document, folder, environment | {"MAX_ERROR": "0.0001"})
        assert code == TARGET_NOT_MET and name == "Compare with the truth", f"{name}: {code}: {text}"


if __name__ == "__main__":
    main()
