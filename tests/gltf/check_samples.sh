#!/usr/bin/env bash
# check_samples.sh KILN_MAKE_SAMPLE: samples of every kind pass the Khronos validator. Exit 77: cannot run here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
command -v node >/dev/null || { echo "SKIPPED: no node"; exit 77; }
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
"$1" "$dir/sphere.glb" 4 3
"$1" "$dir/grey.glb" 6 1
"$1" --components "$dir/components.glb" 6 3
"$1" --everything "$dir/everything.glb" 3 3
"$1" --everything "$dir/order10.glb" 10 3
"$1" --lightmap "$dir/lightmap.glb" 3 3
"$1" --reduced "$dir/reduced.glb" 256
"$1" --reduced "$dir/reduced_without_maps.glb" 0
node "$here/validate.mjs" "$dir"/*.glb
