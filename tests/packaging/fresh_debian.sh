#!/usr/bin/env bash
# Makes the Debian package, installs it in a fresh Debian tree and bakes there, as its own user and locked in:
#   fresh_debian.sh BUILD        BUILD has kilnd and kiln built; exit 77 where no tree can be made (root and debootstrap)
# The base tree is made once and kept in .kiln/debian; each run works in a layer above it that is thrown away.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "$1" && pwd)
base="$root/.kiln/debian"

skip() { echo "skipped: $*"; exit 77; }
[ "$(id -u)" = 0 ] || skip "a tree is made by root alone"
command -v debootstrap >/dev/null || skip "no debootstrap"
for tool in dpkg-shlibdeps file; do command -v "$tool" >/dev/null || skip "no $tool (Debian: dpkg-dev, file)"; done
# shellcheck source=/dev/null
. /etc/os-release

make_base() { # package sources are this machine's own
  local mirror
  mirror=$(cat /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list /etc/apt/sources.list 2>/dev/null |
    sed -nE 's/^(URIs:|deb) +(\[[^]]*\] +)?(https?:[^ ]+).*/\3/p' | head -n 1)
  rm -rf --one-file-system "$base"
  mkdir -p "$base"
  debootstrap --variant=minbase "$VERSION_CODENAME" "$base" "$mirror" >"$base.log" 2>&1 || { tail -n 5 "$base.log"; return 1; }
  rm -f "$base/etc/apt/sources.list"
  cp -rL /etc/apt/sources.list* /etc/apt/apt.conf.d "$base/etc/apt/"
  mkdir -p "$base/etc/ssl" && cp -rL /etc/ssl/certs "$base/etc/ssl/"
  touch "$base.ready"
}
[ -e "$base.ready" ] || make_base || skip "no tree from the package mirror"

work=$(mktemp -d "$root/.kiln/fresh.XXXXXX")
trap 'rm -rf --one-file-system "$work"' EXIT
mkdir "$work/upper" "$work/under" "$work/tree"
layers="lowerdir=$base,upperdir=$work/upper,workdir=$work/under"
unshare --mount mount -t overlay overlay -o "$layers" "$work/tree" 2>/dev/null ||
  skip "no namespaces or no overlay here (a container, perhaps)"
(cd "$work" && cpack --config "$build/CPackConfig.cmake" -B "$work/package" >"$work/cpack.log" 2>&1) ||
  { tail -n 20 "$work/cpack.log"; exit 1; }
mv "$work"/package/kiln_*.deb "$work/kiln.deb"
dpkg-deb --field "$work/kiln.deb" Package Version Architecture Installed-Size Depends

cat >"$work/inside" <<'INSIDE'
set -eu
say() { printf '%s\n' "== $*"; }
say install
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends /kiln.deb >/install.log 2>&1 || { tail -n 20 /install.log; exit 1; }

say "what the package promises"
test "$(stat -c '%U:%G %a' /var/lib/kiln)" = 'kiln:kiln 750'
test "$(stat -c '%U:%G %a' /etc/kiln/kilnd.conf)" = 'root:root 600'
dpkg-query -W -f '${Conffiles}' kiln | grep -q '/etc/kiln/kilnd.conf'
test -e /lib/systemd/system/kilnd.service || test -e /usr/lib/systemd/system/kilnd.service
getent passwd kiln | grep -q nologin
for program in kilnd kiln; do if ldd /usr/bin/$program | grep 'not found'; then exit 1; fi; done

say serve
set -a; . /etc/kiln/kilnd.conf; set +a
setpriv --reuid kiln --regid kiln --clear-groups --no-new-privs kilnd --port 0 2>/var/log/kilnd.log &
server=$!
for _ in $(seq 100); do
  url=$(sed -nE 's/.*listening on (http:[^ "]+).*/\1/p' /var/log/kilnd.log)
  [ -z "$url" ] || break
  sleep 0.1
done
test -n "$url" || { cat /var/log/kilnd.log; exit 1; }

say bake
mkdir /home/user && cd /home/user
kiln demo-scene column -o column.glb
kiln bake column.glb --server "$url" --preset prt-draft -o far >/dev/null 2>far.log || { tail far.log; exit 1; }
kiln inspect far/scene.glb
kiln bake column.glb --preset prt-draft -o near >/dev/null 2>near.log || { tail near.log; exit 1; }
cmp far/scene.glb near/scene.glb   # the server's bytes are those of a bake without it
test "$(kiln list --server "$url" --json | grep -c succeeded)" -ge 1

say drain
kill "$server"
wait "$server"

say remove
dpkg --remove kiln >/dev/null
test ! -e /usr/bin/kilnd && test -e /var/lib/kiln/kiln.db && test -e /etc/kiln/kilnd.conf
say "all holds"
INSIDE

# shellcheck disable=SC2016
# In namespaces of its own: no mount and no process outlives this.
unshare --mount --pid --fork --kill-child bash -euc '
  work=$1 layers=$2
  mount -t overlay overlay -o "$layers" "$work/tree"
  mount -t proc proc "$work/tree/proc"
  mount --rbind /sys "$work/tree/sys" && mount --rbind /dev "$work/tree/dev"
  cp -L /etc/resolv.conf "$work/tree/etc/resolv.conf"
  cp "$work/kiln.deb" "$work/inside" "$work/tree/"
  exec env -i HOME=/root LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    $(env | grep -iE "^(https?_proxy|no_proxy|SSL_CERT_FILE)=" || true) chroot "$work/tree" /bin/bash /inside
' -- "$work" "$layers"
