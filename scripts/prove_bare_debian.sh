#!/usr/bin/env bash
# Proves the README's commands on a bare Debian 12: a debootstrap root with python3 and make, nothing else of this machine
# but its apt sources, its certificates and pip's settings. Needs root, debootstrap and about 10 GB; takes about ten minutes.
#   scripts/prove_bare_debian.sh [COMMAND]        COMMAND defaults to: make video && make video && make test
#   KEEP=1 keeps the root, ROOT=/path names it; with an existing ROOT only the checkout is renewed
set -euo pipefail
cd "$(dirname "$0")/.."
root=${ROOT:-/tmp/a2v-bare-debian}
command=${1:-make video && make video ACTION=Jump && make test}
[ "$(id -u)" = 0 ] || { echo "run as root" >&2; exit 2; }

mounted=()
cleanup() {
  for ((i = ${#mounted[@]} - 1; i >= 0; i--)); do
    umount "${mounted[i]}" || { echo "could not unmount ${mounted[i]}; $root stays" >&2; return; } # never delete through a mount
  done
  [ -n "${KEEP:-}" ] || rm -rf --one-file-system "$root"
}
trap cleanup EXIT

if [ ! -e "$root/etc/debian_version" ]; then
  debootstrap --variant=minbase --include=python3,make,ca-certificates bookworm "$root" http://deb.debian.org/debian
fi
cp /etc/resolv.conf /etc/hosts "$root/etc/"
rm -f "$root/etc/apt/sources.list"
cp /etc/apt/sources.list.d/debian.sources "$root/etc/apt/sources.list.d/"
mkdir -p "$root/etc/ssl/certs" && cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"

bind() { # the folder appears inside under its own name, read-only
  mkdir -p "$root$1"
  mount --bind "$1" "$root$1"
  mounted+=("$root$1")
  mount -o remount,bind,ro "$root$1" 2>/dev/null || true
}
# pip's settings: its configuration files, its environment, and the folders of wheels that they name
[ ! -e /etc/pip.conf ] || cp /etc/pip.conf "$root/etc/pip.conf"
{ pip config list 2>/dev/null | sed -n "s/^global\.\([a-z-]*\)='\(.*\)'$/\1 = \2/p" | sed '1i [global]'; } >"$root/etc/pip.conf.user"
mkdir -p "$root/root/.config/pip" && mv "$root/etc/pip.conf.user" "$root/root/.config/pip/pip.conf"
for folder in /opt/wheels /opt/pypi /opt/pypi-more; do [ ! -d "$folder" ] || bind "$folder"; done
settings=()
while IFS= read -r line; do settings+=("$line"); done < <(env | grep -E '^(PIP_|[A-Za-z]+_PROXY=|[a-z]+_proxy=)' || true)

mkdir -p "$root/proc" "$root/dev"
mount -t proc proc "$root/proc" && mounted+=("$root/proc")
mount --bind /dev "$root/dev" && mounted+=("$root/dev")
mount -t tmpfs tmpfs "$root/dev/shm" 2>/dev/null && mounted+=("$root/dev/shm")

rm -rf "$root/root/a2v"
git clone -q --no-hardlinks . "$root/root/a2v"
rm -rf "$root/root/a2v/.git" # the bare root has no git

echo "== packages before: $(chroot "$root" dpkg-query -W -f='${Package}\n' | wc -l); $(chroot "$root" python3 --version)"
start=$SECONDS
env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 "${settings[@]}" \
  chroot "$root" bash -c "cd /root/a2v && $command"
echo "== proved in $((SECONDS - start)) s: $command"
