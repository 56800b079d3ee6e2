#!/usr/bin/env bash
# Runs a command in a clone of this repository, inside a bare Debian: a root file system made by debootstrap that holds nothing but Debian's
# minimal base, cargo and rustc. A missing installation step shows there, and not on a machine that had the packages before.
#
#   tools/bare_debian.sh [--suite bookworm|trixie] [--root DIR] [COMMAND...]      (as root; the command defaults to ./setup.sh)
#
# --root DIR keeps the root file system, and uses it if it exists. The committed state of the checkout is cloned. The machine's package
# mirror, proxies, certificates and DNS are used; its toolchain is mounted read-only. Exit code 69: no such root can be made here; otherwise
# the code of the command.
set -euo pipefail

# In a mount namespace of its own: what is mounted below the root file system is gone with this process, however it ends.
if [ -z "${BARE_DEBIAN_NAMESPACE:-}" ] && unshare --mount true 2>/dev/null; then
    BARE_DEBIAN_NAMESPACE=own exec unshare --mount "$0" "$@"
fi

suite=bookworm root=
while [ $# -gt 0 ]; do
    case "$1" in
        --suite) suite=$2; shift 2 ;;
        --root) root=$2; shift 2 ;;
        -h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
        *) break ;;
    esac
done
[ $# -gt 0 ] || set -- ./setup.sh
checkout=$(cd "$(dirname "$0")/.." && pwd)
[ "$(id -u)" = 0 ] || { echo "bare_debian.sh: debootstrap and chroot need root" >&2; exit 69; }
unavailable() { echo "bare_debian.sh: $1" >&2; exit 69; }
if ! command -v debootstrap >/dev/null; then
    { apt-get update -qq && apt-get install -y -qq --no-install-recommends debootstrap; } >/dev/null || unavailable "debootstrap cannot be installed"
fi

kept=${root:+yes}
root=${root:-$(mktemp -d)}
mkdir -p "$root"
# As a root directory: other users, which tests run programs as, may enter it.
chmod 755 "$root"
toolchain=$(rustc --print sysroot)
mounted() { grep -q " $1 " /proc/mounts; }
clean_up() {
    local point
    for point in dev/pts dev sys proc usr/local/rust; do if mounted "$root/$point"; then umount "$root/$point"; fi; done
    # Never through a mount that is left.
    if [ -z "$kept" ] && ! grep -q " $root/" /proc/mounts; then rm -rf --one-file-system "$root"; fi
}
trap clean_up EXIT
trap 'exit 130' INT TERM

if [ ! -e "$root/etc/debian_version" ]; then
    mirror=$(sed -nE 's/^(URIs:|deb( \[[^]]*\])?) +(https?:[^ ]+).*/\3/p' /etc/apt/sources.list.d/*.sources /etc/apt/sources.list 2>/dev/null | head -1 || true)
    debootstrap --variant=minbase "$suite" "$root" "${mirror:-http://deb.debian.org/debian}" >"$root/debootstrap.log" 2>&1 \
        || { tail -5 "$root/debootstrap.log" >&2; unavailable "debootstrap failed"; }
fi

for point in proc sys dev dev/pts; do
    mkdir -p "$root/$point"
    mounted "$root/$point" || mount --bind "/$point" "$root/$point" || unavailable "file systems cannot be mounted"
done
mkdir -p "$root/usr/local/rust" "$root/root/.cargo" "$root/etc/ssl/certs"
if ! mounted "$root/usr/local/rust"; then
    mount --bind "$toolchain" "$root/usr/local/rust"
    mount -o remount,bind,ro "$root/usr/local/rust"
fi
cp -L /etc/resolv.conf /etc/hosts "$root/etc/"
# Proxies and mirrors of this machine.
for file in /etc/apt/apt.conf.d/*proxy* /etc/apt/apt.conf.d/*registry*; do if [ -e "$file" ]; then cp "$file" "$root/etc/apt/apt.conf.d/"; fi; done
if [ -e "$HOME/.cargo/config.toml" ]; then cp "$HOME/.cargo/config.toml" "$root/root/.cargo/"; fi
certificates=${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}
environment=(HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive CI="${CI:-}"
    PATH=/usr/local/rust/bin:/root/.cargo/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin)
if [ -e "$certificates" ]; then
    cp -L "$certificates" "$root/etc/ssl/certs/host.pem"
    for name in SSL_CERT_FILE CARGO_HTTP_CAINFO CURL_CA_BUNDLE PIP_CERT; do environment+=("$name=/etc/ssl/certs/host.pem"); done
fi
for name in http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY; do if [ -n "${!name:-}" ]; then environment+=("$name=${!name}"); fi; done

rm -rf "$root/root/steradian"
git clone -q "$checkout" "$root/root/steradian"
echo "bare_debian.sh: $suite: $*" >&2
chroot "$root" env -i "${environment[@]}" bash -c 'cd /root/steradian && exec "$@"' bash "$@"
