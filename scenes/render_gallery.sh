#!/usr/bin/env bash
# Renders the pictures of this folder's README into `pictures/`, writes their samples and seconds into the README, and prints a line
# "picture spp seconds" for each.
#
#   scenes/render_gallery.sh                  all pictures
#   scenes/render_gallery.sh tree shrine      these only
#   STERADIAN=path scenes/render_gallery.sh   with this program; otherwise target/release/steradian, or the one on the PATH
#   PERCENT=25 scenes/render_gallery.sh       with a quarter of the samples
set -euo pipefail
cd "$(dirname "$0")"

program=${STERADIAN:-../target/release/steradian}
[ -x "$program" ] || program=$(command -v steradian) || { echo "render_gallery.sh: no program; run cargo build --release" >&2; exit 1; }
mkdir -p pictures

# Picture, scene, size, samples per pixel or seconds ("8s"), further options.
table='
gallery         gallery         288x162  512
revolution      revolution      288x120  512
shrine          shrine          240x240  256
cornell         cornell         208x208  1024
glass           glass           208x208  4096
smallpt         smallpt         240x180  2048
analytic        analytic        288x162  512
shapes          shapes          288x144  1024
glassware       glassware       256x160  1024
phi_max         phi_max         234x208  512
phi_max_normals phi_max         234x208  64    --integrator normal
nee             nee             208x156  8s
nee_by_chance   nee             208x156  8s    --strategy bsdf
nee_only        nee             208x156  8s    --strategy light
fog             fog             256x168  384
clouds          clouds          288x162  512
fur             fur             288x180  256
subdivision     subdivision     288x162  256
glossy          glossy          270x180  2048
principled      principled      176x264  1024
skin            skin            288x180  512
textures        textures        288x144  1024
tree            tree            240x240  256
smooth_normals  smooth_normals  320x140  512
depth_of_field  depth_of_field  288x162  1024
depth_of_field_without depth_of_field 288x162 1024 --no-depth-of-field
gloss           gloss           240x120  512
gloss_without   gloss_without   240x120  512
classic         classic         288x144  64
classic_path    classic         288x144  1024  --integrator path
motion          motion          288x162  1024
many_lights     many_lights     288x162  1024
knot            knot            288x162  512
'

stats=$(mktemp)
trap 'rm -f "$stats"' EXIT
number() { sed -n "s/.*\"$1\": *\([0-9.]*\).*/\1/p" "$stats" | head -n 1; }

while read -r picture scene size samples options; do
    [ -n "$picture" ] || continue
    if [ $# -gt 0 ] && [[ " $* " != *" $picture "* ]]; then continue; fi
    case $samples in
        *s) samples=(--spp 1000000 --time-limit "${samples%s}") ;;
        *) samples=(--spp $((samples * ${PERCENT:-100} / 100))) ;;
    esac
    # shellcheck disable=SC2086 # The options are words.
    "$program" render "$scene.json" -q --size "$size" "${samples[@]}" $options --stats "$stats" -o "pictures/$picture.png"
    spp=$(number spp)
    seconds=$(LC_ALL=C printf '%.0f' "$(number render_seconds)")
    sed -i "/(pictures\/$picture.png)/s/[0-9]* spp, [0-9]* s/$spp spp, $seconds s/" README.md
    echo "$picture $spp $seconds"
done <<<"$table"
