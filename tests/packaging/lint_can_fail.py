#!/usr/bin/env python3
"""Each rule of check_deployment.py finds its breach: lint_can_fail.py ROOT KILND. A line of docker/ is changed in a copy."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

BREACHES = [
    ("Dockerfile", "USER kiln\n", "", "runs as root"),
    ("Dockerfile", "HEALTHCHECK ", "LABEL ", "no HEALTHCHECK"),
    ("Dockerfile", "FROM debian:12-slim", "FROM debian", "names no version"),
    ("Dockerfile", "docker/packages.txt", "docker/package.txt", "there is no such file"),
    ("Dockerfile", "KILN_BIND=", "KILN_ADDRESS=", "knows no KILN_ADDRESS"),
    ("compose.yaml", "read_only: true", "read_only: false", "its root may be written"),
    ("compose.yaml", "PGPASSWORD: ${KILN_DB_PASSWORD:?see docker/README.md}", "PGPASSWORD: hunter2", "stands in the file"),
    ("compose.yaml", "replicas: 3", "replicas: 2", "three workers"),
    ("compose.yaml", "stop_grace_period: 45s", "stop_grace_period: 5s", "before it has drained"),
    ("compose.yaml", '"127.0.0.1:7878:7878"', '"7878:7878"', "open to others"),
    ("kubernetes/kiln.yaml", "readOnlyRootFilesystem: true", "readOnlyRootFilesystem: false", "its root may be written"),
    ("kubernetes/kiln.yaml", "runAsNonRoot: true", "runAsNonRoot: false", "may run as root"),
    ("kubernetes/kiln.yaml", "path: /readyz", "path: /healthz", "ready is /readyz"),
    ("kubernetes/kiln.yaml", "limits: {cpu: \"4\", memory: 8Gi}", "limits: {cpu: \"4\"}", "no limits"),
    ("kubernetes/kiln.yaml", "terminationGracePeriodSeconds: 45", "terminationGracePeriodSeconds: 10", "before it has drained"),
    ("kubernetes/kiln.yaml", "selector: {app: kiln-server}", "selector: {app: kiln}", "selects no pod"),
    ("kubernetes/kiln.yaml", "name: tmp, mountPath", "name: temp, mountPath", "mounts temp"),
    ("github/bake.yaml", "--max-error", "--json", "nothing fails above an error"),
    ("debian/kilnd.conf", "#KILN_WORKERS=", "#KILN_WORKER_COUNT=", "knows no KILN_WORKER_COUNT"),
]


def main():
    root, kilnd = pathlib.Path(sys.argv[1]), sys.argv[2]
    check = root / "tests" / "packaging" / "check_deployment.py"
    unseen = []
    for file, good, bad, sentence in BREACHES:
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder) / "docker"
            shutil.copytree(root / "docker", copy)
            text = (copy / file).read_text()
            assert good in text, f"{file} has no {good!r}"
            (copy / file).write_text(text.replace(good, bad))
            done = subprocess.run([sys.executable, check, folder, kilnd], capture_output=True, text=True)
            if done.returncode != 1 or sentence not in done.stdout:
                unseen.append(f"{file}: {bad!r} went through: {done.stdout}{done.stderr}")
    print("\n".join(unseen) or f"{len(BREACHES)} breaches, all found")
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
