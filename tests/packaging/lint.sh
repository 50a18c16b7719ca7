#!/usr/bin/env bash
# Lints docker/: lint.sh KILND. yamllint, our own rules, shellcheck of the maintainer scripts, and what systemd thinks of
# the unit: its syntax, and an exposure of at most 2 of 10.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
kilnd=$1
cd "$root/docker"
have() { command -v "$1" >/dev/null || { echo "lint.sh: no $1 here: skipped"; return 1; }; }

if have yamllint; then
  yamllint -d '{extends: default, rules: {line-length: {max: 120}, document-start: disable, braces: {max-spaces-inside: 1},
    comments: {min-spaces-from-content: 1}, truthy: {check-keys: false}}}' compose.yaml kubernetes github
fi
/usr/bin/python3 -c 'import yaml' 2>/dev/null || { echo "lint.sh: no python3-yaml here"; exit 77; }
/usr/bin/python3 "$root/tests/packaging/check_deployment.py" "$root" "$kilnd"
if have shellcheck; then shellcheck debian/postinst debian/prerm debian/postrm "$root"/tests/packaging/*.sh; fi
if have systemd-analyze; then
  # The program is not installed here: only that may be missing.
  complaints=$(systemd-analyze verify debian/kilnd.service 2>&1 | grep -v 'kilnd is not executable' || true)
  [ -z "$complaints" ] || { echo "$complaints"; exit 1; }
  systemd-analyze security --offline=yes --threshold=20 debian/kilnd.service | tail -n 1
fi
