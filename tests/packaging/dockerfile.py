#!/usr/bin/env python3
"""Runs the steps of docker/Dockerfile in bare Debian trees, since there is no Docker engine here.

    dockerfile.py ROOT BASE        BASE: a minimal Debian tree (fresh_debian.sh leaves one in .kiln/debian)

Each FROM is a layer over BASE that is thrown away; RUN, COPY, WORKDIR, ENV and USER do what they say. COPY of the
context copies what is committed. In the end the last stage's HEALTHCHECK is asked of its ENTRYPOINT. Takes as long as
building Kiln from nothing; not run by ctest.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from check_deployment import instructions  # noqa: E402

PASS_ON = re.compile(r"(https?_proxy|no_proxy|npm_config_\w+|SSL_CERT_FILE|NODE_EXTRA_CA_CERTS)$", re.IGNORECASE)
TOKEN = "t" * 43


class Stage:
    def __init__(self, base, folder):
        self.tree, self.cwd, self.user = folder / "tree", "/", "root"
        self.env = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root"}
        self.env |= {name: value for name, value in os.environ.items() if PASS_ON.match(name)}
        for name in ("tree", "upper", "under"):
            (folder / name).mkdir(parents=True)
        layers = f"lowerdir={base},upperdir={folder}/upper,workdir={folder}/under"
        subprocess.run(["mount", "-t", "overlay", "overlay", "-o", layers, self.tree], check=True)
        for kind, name in (("proc", "proc"), ("sysfs", "sys")):
            subprocess.run(["mount", "-t", kind, kind, self.tree / name], check=True)
        subprocess.run(["mount", "--rbind", "/dev", self.tree / "dev"], check=True)
        shutil.copy("/etc/resolv.conf", self.tree / "etc" / "resolv.conf")

    def run(self, words, **options):
        inner = f'cd "{self.cwd}" && exec setpriv --reuid {self.user} --regid {self.user} --clear-groups "$@"'
        chroot = ["chroot", self.tree, "/bin/sh", "-c", inner, "sh"] + words
        return subprocess.Popen(chroot, env=self.env, **options)

    def shell(self, line):
        print(f"RUN {line[:100]}", flush=True)
        log = self.tree.parent / "run.log"
        with open(log, "w") as out:
            code = self.run(["/bin/sh", "-c", line], stdout=out, stderr=out).wait()
        if code != 0:
            sys.exit(f"exit {code}\n" + log.read_text()[-3000:])


def copy_context(root, stage, source, target):
    archive = subprocess.Popen(["git", "-C", root, "archive", "HEAD"] + ([] if source == "." else [source]), stdout=subprocess.PIPE)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["tar", "-x", "-C", folder], stdin=archive.stdout, check=True)
        place(stage, [pathlib.Path(folder) / source], target)


def place(stage, sources, target):
    to = stage.tree / target.lstrip("/")
    for source in sources:
        if source.is_dir():
            shutil.copytree(source, to, symlinks=True, dirs_exist_ok=True)
        else:
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, to / source.name if target.endswith("/") else to)


def build(root, base, folder):
    stages, names, last = [], {}, {}
    for word, rest in instructions(root / "docker" / "Dockerfile"):
        if word == "FROM":
            stages.append(Stage(base, folder / f"stage{len(stages)}"))
            if " AS " in rest:
                names[rest.split(" AS ")[1]] = stages[-1]
            last = {}
        stage = stages[-1]
        if word == "RUN":
            stage.shell(rest)
        elif word == "COPY" and rest.startswith("--from="):
            source, pattern, target = rest.split()
            place(stage, list(names[source[7:]].tree.glob(pattern.lstrip("/"))), target)
        elif word == "COPY":
            copy_context(root, stage, *rest.split())
        elif word == "WORKDIR":
            stage.cwd = rest
        elif word == "ENV":
            stage.env |= dict(pair.split("=", 1) for pair in rest.split())
        elif word == "USER":
            stage.user = rest
        last[word] = rest
    return stages[-1], last


def serve(stage, last):
    """What `docker run` would do: ENTRYPOINT with a token file, then HEALTHCHECK until it is healthy."""
    tokens = stage.tree / "run" / "kiln_tokens"
    tokens.write_text(TOKEN + "\n")
    stage.cwd = "/"
    stage.env |= {"KILN_TOKEN_FILE": "/run/kiln_tokens", "KILN_PORT": "17979"}
    server = stage.run(json.loads(last["ENTRYPOINT"]))
    check = json.loads(re.search(r"CMD (\[.*\])", last["HEALTHCHECK"])[1].replace("7878", "17979"))
    healthy = any(stage.run(["sh", "-c", 'sleep 0.3; "$@" >/dev/null 2>&1', "sh"] + check).wait() == 0 for _ in range(50))
    server.terminate()
    return healthy and server.wait() == 0


def main():
    if "--inside" not in sys.argv:  # namespaces of its own: no mount and no process outlives this
        unshare = ["unshare", "--mount", "--pid", "--fork", "--kill-child", sys.executable, *sys.argv, "--inside"]
        return subprocess.run(unshare).returncode
    root, base = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    folder = pathlib.Path(tempfile.mkdtemp(dir=root / ".kiln"))
    try:
        healthy = serve(*build(root, base, folder))
        print("healthy, and ended by TERM with 0" if healthy else "not healthy")
        return 0 if healthy else 1
    finally:
        subprocess.run(["bash", "-c", f"umount -R -l {folder}/stage*/tree; rm -rf --one-file-system {folder}"])


if __name__ == "__main__":
    sys.exit(main())
