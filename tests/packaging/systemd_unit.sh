#!/usr/bin/env bash
# Boots systemd in a fresh Debian tree with the package in it, and bakes through the service as its unit runs it:
#   systemd_unit.sh BUILD        after fresh_debian.sh, whose tree it uses; wants root and systemd-nspawn
# By hand and not by ctest: it needs a kernel that lets a container have cgroups of its own.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "$1" && pwd)
base="$root/.kiln/debian"
[ -e "$base.ready" ] || { echo "fresh_debian.sh makes the tree first"; exit 1; }

work=$(mktemp -d "$root/.kiln/boot.XXXXXX")
trap 'rm -rf --one-file-system "$work"' EXIT
mkdir "$work/upper" "$work/under" "$work/tree"
cpack --config "$build/CPackConfig.cmake" -B "$work/package" >"$work/cpack.log" 2>&1
mv "$work"/package/kiln_*.deb "$work/kiln.deb"

cat >"$work/check" <<'CHECK'
#!/bin/bash
exec >/result 2>&1
set -eu
trap 'systemctl --no-block poweroff --force' EXIT
systemctl is-active kilnd
systemctl show kilnd -p User,NoNewPrivileges,ProtectSystem
grep -E 'CapEff|CapBnd|NoNewPrivs|Seccomp:' "/proc/$(systemctl show kilnd -p MainPID --value)/status"
cd /root
for _ in $(seq 50); do kiln list --server http://127.0.0.1:7878 >/dev/null 2>&1 && break; sleep 0.2; done
kiln demo-scene column -o column.glb
kiln bake column.glb --server http://127.0.0.1:7878 --preset prt-draft -o baked >/dev/null
kiln list --server http://127.0.0.1:7878
systemctl stop kilnd
ended=$(systemctl show kilnd -p Result,ExecMainStatus)
echo "$ended"
[[ $ended == *ExecMainStatus=0* ]]
echo 'the unit holds'
CHECK
cat >"$work/check.service" <<'UNIT'
[Unit]
After=kilnd.service
[Service]
Type=oneshot
ExecStart=/bin/bash /check
[Install]
WantedBy=multi-user.target
UNIT

# In namespaces of its own. nspawn refuses Landlock unless it is told; Debian's own machines allow it.
# shellcheck disable=SC2016
unshare --mount --pid --fork --kill-child --mount-proc bash -euc '
  work=$1 base=$2
  mount -t overlay overlay -o "lowerdir=$base,upperdir=$work/upper,workdir=$work/under" "$work/tree"
  cp -L /etc/resolv.conf "$work/tree/etc/resolv.conf"
  cp "$work/kiln.deb" "$work/check" "$work/tree/"
  install -D -m 644 "$work/check.service" "$work/tree/etc/systemd/system/check.service"
  mount -t proc proc "$work/tree/proc"
  DEBIAN_FRONTEND=noninteractive chroot "$work/tree" sh -euc "apt-get update -qq
    apt-get install -y -qq --no-install-recommends systemd-sysv /kiln.deb >/dev/null 2>&1
    systemctl is-enabled kilnd
    systemctl enable --quiet check"
  umount "$work/tree/proc"
  umount -R /sys/fs/cgroup && mount -t cgroup2 cgroup2 /sys/fs/cgroup
  timeout 120 systemd-nspawn --register=no --keep-unit -D "$work/tree" -b \
    --system-call-filter="landlock_create_ruleset landlock_add_rule landlock_restrict_self" >"$work/console" 2>&1 || true
' -- "$work" "$base"
cat "$work/upper/result"
grep -q '^the unit holds$' "$work/upper/result"
