#!/usr/bin/env python3
"""What docker/ must keep to; every breach is a line, and exit 1.

    check_deployment.py ROOT KILND

Debian has no linter for Dockerfiles (hadolint), compose files or Kubernetes manifests: yamllint reads their syntax, and
these are our own rules. KILND's --help says which KILN_* variables there are.
"""
import pathlib
import re
import subprocess
import sys

import yaml

SECRET = re.compile(r"PASSWORD|SECRET|TOKEN$|ACCESS_KEY|KEY$")
NO_SECRET = {"KILN_TOKEN_FILE"}
KINDS = {"Namespace": "v1", "ConfigMap": "v1", "Service": "v1", "Deployment": "apps/v1", "PodDisruptionBudget": "policy/v1"}
DRAIN_S = 30  # what kilnd may need from TERM to its end
breaches = []


def must(true, where, sentence):
    if not true:
        breaches.append(f"{where}: {sentence}")


def known_variables(kilnd):
    text = subprocess.run([kilnd, "--help"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"Env:(KILN_[A-Z0-9_]+)", text))


def check_variables(names, where, known):
    for name in names:
        if name.startswith("KILN_"):
            must(name in known, where, f"kilnd knows no {name}")


def instructions(path):
    """(word, rest) of a Dockerfile, continued lines joined."""
    lines = [line for line in path.read_text().splitlines() if not line.lstrip().startswith("#")]
    for line in re.sub(r"\\\n", " ", "\n".join(lines)).splitlines():
        if line.strip():
            word, _, rest = line.strip().partition(" ")
            yield word, rest.strip()


def check_dockerfile(root, path, known):
    where = path.name
    stages, last = [], {}
    for word, rest in instructions(path):
        must(word.isupper(), where, f"{word} is no instruction")
        if word == "FROM":
            must(":" in rest.split()[0], where, f"FROM {rest} names no version")
            stages.append(rest)
            last = {}
        if word == "RUN" and "apt-get install" in rest and len(stages) > 1:
            must("--no-install-recommends" in rest, where, "apt-get install wants --no-install-recommends")
            must("rm -rf /var/lib/apt/lists/*" in rest, where, "the lists of apt stay in the image")
        if word == "COPY" and not rest.startswith("--from"):
            for source in rest.split()[:-1]:
                must((root / source).exists(), where, f"COPY {source}: there is no such file")
        if word == "ADD":
            must(False, where, "COPY instead of ADD")
        if word == "ENV":
            pairs = dict(pair.split("=", 1) for pair in rest.split())
            check_variables(pairs, where, known)
            must(not any(SECRET.search(name) and name not in NO_SECRET for name in pairs), where, "a secret in ENV")
        last[word] = rest
    must(len(stages) > 1, where, "one stage: compilers stay in the image")
    must(last.get("USER", "root").split(":")[0] not in ("root", "0"), where, "the last stage runs as root")
    must("HEALTHCHECK" in last and last.get("HEALTHCHECK") != "NONE", where, "no HEALTHCHECK")
    must(last.get("ENTRYPOINT", "").startswith("["), where, "ENTRYPOINT as a list, so that TERM reaches kilnd")


def check_compose(path, known):
    document = yaml.safe_load(path.read_text())
    services = document["services"]
    must({"server", "worker", "db", "s3"} <= set(services), path.name, "server, worker, db and s3 make a fleet")
    for name, service in services.items():
        where = f"{path.name}: {name}"
        environment = service.get("environment", {})
        for variable, value in environment.items():
            if SECRET.search(variable) and variable not in NO_SECRET:
                must(re.fullmatch(r"\$\{\w+:\?[^}]*\}", str(value)), where, f"{variable} stands in the file")
        must(":" in service["image"] or service["image"].startswith("${"), where, "an image without a version")
        must("healthcheck" in service, where, "no healthcheck, and none is said to be needless")
        must(not service.get("privileged"), where, "privileged")
        for other in service.get("depends_on", {}):
            must(other in services, where, f"depends on {other}, which is not there")
        for secret in service.get("secrets", []):
            must(secret in document.get("secrets", {}), where, f"secret {secret} is not there")
        for volume in service.get("volumes", []):
            source = volume.split(":")[0]
            must(source.startswith(("/", ".")) or source in document["volumes"], where, f"volume {source} is not there")
        for port in service.get("ports", []):
            must(port.startswith("127.0.0.1:"), where, f"port {port} is open to others")
        if not service["image"].startswith("${KILN_IMAGE"):
            continue
        check_variables(environment, where, known)
        must(service.get("read_only") is True, where, "its root may be written")
        must(service.get("cap_drop") == ["ALL"], where, "capabilities are kept")
        must("no-new-privileges:true" in service.get("security_opt", []), where, "may gain privileges")
        must(int(service.get("stop_grace_period", "10s")[:-1]) > DRAIN_S, where, "is killed before it has drained")
    must(services["worker"].get("deploy", {}).get("replicas") == 3, path.name, "three workers")


def check_pod(spec, where, configs, known):
    must(spec.get("automountServiceAccountToken") is False, where, "the cluster's token is mounted")
    must(spec.get("terminationGracePeriodSeconds", 30) > DRAIN_S, where, "is killed before it has drained")
    pod = spec.get("securityContext", {})
    must(pod.get("runAsNonRoot") is True and pod.get("runAsUser", 0) > 0, where, "may run as root")
    must(pod.get("seccompProfile", {}).get("type") == "RuntimeDefault", where, "no seccomp profile")
    volumes = {volume["name"] for volume in spec.get("volumes", [])}
    for container in spec["containers"]:
        security = container.get("securityContext", {})
        must(security.get("readOnlyRootFilesystem") is True, where, "its root may be written")
        must(security.get("allowPrivilegeEscalation") is False, where, "may gain privileges")
        must(security.get("capabilities", {}).get("drop") == ["ALL"], where, "capabilities are kept")
        for kind in ("requests", "limits"):
            must({"cpu", "memory"} <= set(container.get("resources", {}).get(kind, {})), where, f"no {kind}")
        for mount in container.get("volumeMounts", []):
            must(mount["name"] in volumes, where, f"mounts {mount['name']}, which is not there")
        variables = {entry["name"]: entry.get("value") for entry in container.get("env", [])}
        check_variables(variables, where, known)
        for name, value in variables.items():
            secret = SECRET.search(name) and name not in NO_SECRET
            must(not (secret and value), where, f"{name} stands in the file")
            must(value is None or isinstance(value, str), where, f"{name} wants quotes")
        for source in container.get("envFrom", []):
            if "configMapRef" in source:
                must(source["configMapRef"]["name"] in configs, where, "a ConfigMap that is not there")
        ports = {port["name"] for port in container.get("ports", [])}
        if not ports:
            continue
        for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
            must(probe in container, where, f"no {probe}")
            must(container.get(probe, {}).get("httpGet", {}).get("port") in ports, where, f"{probe} asks no port of its own")
        must(container.get("readinessProbe", {}).get("httpGet", {}).get("path") == "/readyz", where, "ready is /readyz")
        must("preStop" in container.get("lifecycle", {}), where, "stops while others still send to it")


def check_kubernetes(path, known):
    documents = [d for d in yaml.safe_load_all(path.read_text()) if d]
    configs = {d["metadata"]["name"]: d for d in documents if d["kind"] == "ConfigMap"}
    pods = [d["spec"]["template"]["metadata"]["labels"] for d in documents if d["kind"] == "Deployment"]
    for document in documents:
        kind, name = document["kind"], document["metadata"]["name"]
        where = f"{path.name}: {kind} {name}"
        must(KINDS.get(kind) == document["apiVersion"], where, f"apiVersion {document['apiVersion']}")
        must(kind == "Namespace" or document["metadata"].get("namespace") == "kiln", where, "no namespace")
        if kind == "ConfigMap":
            check_variables(document["data"], where, known)
            must(not any(SECRET.search(n) and n not in NO_SECRET for n in document["data"]), where, "holds a secret")
        if kind == "Deployment":
            template = document["spec"]["template"]
            must(document["spec"]["selector"]["matchLabels"] == template["metadata"]["labels"], where, "selects no pod")
            check_pod(template["spec"], where, configs, known)
        if kind == "Service":
            must(document["spec"]["selector"] in pods, where, "selects no pod")
        if kind == "PodDisruptionBudget":
            must(document["spec"]["selector"]["matchLabels"] in pods, where, "selects no pod")


def check_workflow(path):
    document = yaml.safe_load(path.read_text())
    must(True in document or "on" in document, path.name, "no trigger")  # YAML 1.1 reads `on` as true
    must("permissions" in document, path.name, "permissions are not narrowed")
    steps = [step for job in document["jobs"].values() for step in job["steps"]]
    must(all(("run" in step) != ("uses" in step) for step in steps), path.name, "a step runs or uses")
    must(any("--max-error" in step.get("run", "") for step in steps), path.name, "nothing fails above an error")


def main():
    root, kilnd = pathlib.Path(sys.argv[1]), sys.argv[2]
    known = known_variables(kilnd)
    must("KILN_DATA" in known, "kilnd --help", "names no variables")
    docker = root / "docker"
    check_dockerfile(root, docker / "Dockerfile", known)
    check_compose(docker / "compose.yaml", known)
    check_kubernetes(docker / "kubernetes" / "kiln.yaml", known)
    check_workflow(docker / "github" / "bake.yaml")
    options = re.findall(r"^#?(\w+)=", (docker / "debian" / "kilnd.conf").read_text(), re.MULTILINE)
    check_variables(options, "kilnd.conf", known)
    print("\n".join(breaches) or "docker/ keeps its rules")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
